"""Control targets make the datum, check points judge it, blunders are named."""

import numpy as np
import pytest

from schemas.problem import BadInput
from schemas.target import SiteTarget
from tasks.registration.rigid_motion import Array, exp, inverse, transform, yaw
from tasks.registration.site_datum import Sighting, residuals, tie_to_datum, unused

PLACES_M = np.array([[0, 0, 0], [12, 1, 0.5], [11, 9, 3], [-1, 8, 1], [5, 4, 6], [3, -2, 2]], dtype=float)
TO_GRID = exp(np.array([0.01, -0.02, 0.9, 0, 0, 0])) @ yaw(0.0, (0.0, 0.0, 0.0))
TO_GRID[:3, 3] = 512_345.0, 5_432_100.0, 87.0


def sightings(noise_m: float = 0.0, checks: tuple[int, ...] = (), count: int = 6) -> list[Sighting]:
    """Of each target from two stations."""
    rng = np.random.default_rng(0)
    found = []
    for k, place_m in enumerate(PLACES_M[:count]):
        x, y, z = transform(TO_GRID, place_m[None])[0]
        target = SiteTarget(name=f"T{k}", position_m=(float(x), float(y), float(z)), check=k in checks)
        found += [Sighting(target, s, place_m + rng.normal(0, noise_m, 3)) for s in ("a", "b")]
    return found


def moved(seen: list[Sighting], name: str, by_m: float) -> list[Sighting]:
    return [
        Sighting(s.target, s.station, s.frame_m + by_m * np.array([1.0, 0.0, 0.0]))
        if s.target.name == name and s.station == "a"
        else s
        for s in seen
    ]


def off_m(T: Array | None) -> float:
    assert T is not None
    apart = transform(inverse(TO_GRID) @ T, PLACES_M) - PLACES_M
    return float(np.linalg.norm(apart, axis=1).max())


def test_control_gives_the_datum_and_check_points_have_no_say() -> None:
    seen = sightings(checks=(4, 5))
    assert off_m(tie_to_datum(seen)) < 1e-6
    wrong = moved(moved(seen, "T4", 0.04), "T5", 7.0)
    T = tie_to_datum(wrong)
    assert off_m(T) < 1e-6
    assert T is not None
    found = residuals(wrong, T)
    assert [r.check for r in found] == [False] * 8 + [True] * 4
    assert not any(r.used for r in found if r.check)
    of_t4 = next(r for r in found if r.name == "T4" and r.station == "a")
    assert np.linalg.norm(of_t4.residual_m) == pytest.approx(0.04, abs=1e-6)


def test_noise_of_millimetres_averages_out() -> None:
    seen = sightings(noise_m=0.002)
    T = tie_to_datum(seen)
    assert 0.0001 < off_m(T) < 0.004


def test_a_blunder_is_outvoted_and_named() -> None:
    seen = moved(sightings(), "T2", 0.3)
    T = tie_to_datum(seen)
    assert off_m(T) < 1e-6
    assert T is not None
    found = residuals(seen, T)
    given = [s.target for s in seen[::2]] + [SiteTarget(name="lost", position_m=(0.0, 0.0, 0.0))]
    left = unused(found, given, [(s.station, s.target.name) for s in seen] + [("a", "unknown")])
    assert [one.item for one in left] == ["target lost", "target unknown in a", "target T2 in a"]
    assert "300 mm" in left[-1].what


def test_two_targets_turn_about_the_vertical_alone() -> None:
    level = yaw(0.7, (100.0, 200.0, 5.0))
    seen = []
    for k in (0, 1):
        x, y, z = transform(level, PLACES_M[k][None])[0]
        target = SiteTarget(name=f"T{k}", position_m=(float(x), float(y), float(z)))
        seen.append(Sighting(target, "a", PLACES_M[k]))
    T = tie_to_datum(seen)
    assert T is not None
    assert np.allclose(T, level, atol=1e-9)


def test_control_that_fixes_nothing_is_refused() -> None:
    assert tie_to_datum(sightings(checks=tuple(range(6)))) is None
    with pytest.raises(BadInput, match="1 control targets that are seen"):
        tie_to_datum(sightings(count=1))
    swapped = moved(moved(sightings(count=3), "T0", 9.0), "T1", -8.0)
    only_a = [s for s in swapped if s.station == "a"]
    with pytest.raises(BadInput, match="do not fix where"):
        tie_to_datum(only_a)
