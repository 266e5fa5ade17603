"""Structures that repeat themselves, and clouds with nothing in common: a wrong tie is worse than none."""

from pathlib import Path

import numpy as np
import pytest

from schemas.problem import BadInput
from schemas.scanning import Scanning
from tasks.registration.look_alikes import Fit, least_contradicted, rivals
from tasks.registration.rigid_motion import Array, inverse, transform, yaw
from tasks.registration.station_cloud import Cloud
from tests.benchmarks.look_alike_rows import equal_piers
from tests.benchmarks.surveys import pose_errors, registered, survey
from tests.registration.site import (
    BRIDGE,
    YARD,
    Box,
    as_scan,
    errors_mm_deg,
    points_seen,
    pose_of,
    write_ply,
)
from tests.registration.test_register import SETTINGS, Given, poses, register

VIADUCT: tuple[Box, ...] = (  # eleven equal piers, 12 m apart; a scanner sees 30 m, and no end of it
    ((-100, -50, -1), (100, 50, 0)),
    *(((12 * k - 0.6, -2, 0), (12 * k + 0.6, 2, 7)) for k in range(-5, 6)),
    ((-66, -3, 7), (66, 3, 7.8)),
)
HOUSES: tuple[Box, ...] = (((-3, -14, 0), (3, -11, 4)), ((5, 8, 0), (7, 14, 3)))


def beside(seed: int) -> list[Array]:
    """T_world_scan of three stations along the viaduct."""
    rng = np.random.default_rng(seed)
    return [
        yaw(
            float(rng.uniform(0, 2 * np.pi)),
            (x + float(rng.uniform(-1.5, 1.5)), float(rng.uniform(-10, -6)), 1.6),
        )
        for x in (-8.0, 0.0, 8.0)
    ]


def scanned(folder: Path, boxes: tuple[Box, ...], seed: int, *, stated: bool) -> list[Given]:
    """The stations' scans, s0 to s2, with positions to 5 cm or without."""
    rng = np.random.default_rng([seed, 3])
    given = []
    for k, T in enumerate(beside(seed)):
        path = write_ply(folder / f"s{k}.ply", points_seen(boxes, T, 10 * seed + k))
        x, y, z = (T[:3, 3] + rng.normal(0, 0.05, 3)).tolist()
        given.append(as_scan(path, **({"station_position_m": (x, y, z)} if stated else {})))
    return given


@pytest.mark.parametrize("seed", [1, 2])
def test_a_scan_that_fits_beside_every_pier_is_refused(seed: int, tmp_path: Path) -> None:
    told = r"s1, s2: .* s1: it fits in more than one place about equally well, 12\.0 m apart"
    with pytest.raises(BadInput, match=told) as caught:
        register(scanned(tmp_path, VIADUCT, seed, stated=False), SETTINGS)
    assert "position_m" in caught.value.remedy


@pytest.mark.parametrize("seed", [1, 2])
def test_stated_positions_tell_the_piers_apart(seed: int, tmp_path: Path) -> None:
    found = register(scanned(tmp_path, VIADUCT, seed, stated=True), SETTINGS)
    assert not found.left_out
    worst_mm, worst_deg = errors_mm_deg(poses(found), beside(seed))
    assert worst_mm < 2.0
    assert worst_deg < 0.02


def test_a_third_position_tells_on_which_side_the_second_scanner_stood(tmp_path: Path) -> None:
    """Three piers on the other side of the first, the second scanner is as far from it to 10 cm."""
    case = survey(equal_piers(1), Scanning(step_deg=0.3), tmp_path)
    _, T, _ = registered(case)
    assert len(T) == 3
    assert max(pose_errors(T, case).station_mm.values()) < 2.0


def test_stations_in_sight_of_what_is_there_once_are_tied(tmp_path: Path) -> None:
    """The third sees the houses too, but 24 m on it would see them where the others' range ends."""
    found = register(scanned(tmp_path, (*VIADUCT, *HOUSES), 1, stated=False), SETTINGS)
    assert [s.name for s in found.stations] == ["s0", "s1"]
    assert errors_mm_deg(poses(found), beside(1)[:2])[0] < 1.0
    assert [left.item for left in found.left_out] == ["s2"]
    assert "24.0 m apart" in found.left_out[0].what


def merged(folder: Path, name: str, boxes: tuple[Box, ...], stations: tuple[int, int], T: Array) -> Given:
    """Two stations' points in one cloud, which no scanner's place is known of; T: into its file's frame."""
    seen = [transform(T @ pose_of(k), points_seen(boxes, pose_of(k), 20 + k)) for k in stations]
    return as_scan(write_ply(folder / f"{name}.ply", np.concatenate(seen)))


def test_clouds_without_scanners_are_tied_where_much_of_them_meets(tmp_path: Path) -> None:
    elsewhere = yaw(2.0, (150.0, 80.0, 0.0))
    yard = merged(tmp_path, "yard", YARD, (0, 1), np.eye(4))
    found = register([yard, merged(tmp_path, "rest", YARD, (2, 3), elsewhere)], SETTINGS)
    first, second = poses(found)
    assert np.abs(inverse(first) @ second - inverse(elsewhere)).max() < 0.005
    with pytest.raises(BadInput, match="bridge"):
        register([yard, merged(tmp_path, "bridge", BRIDGE, (2, 3), elsewhere)], SETTINGS)


def fit(x_m: float, doubt: float = 0.01, rmse_m: float = 0.01, off_m: float = np.inf) -> Fit:
    return Fit(yaw(0.0, (x_m, 0.0, 0.0)), rmse_m, None, doubt, doubt, off_m)


def test_a_rival_is_another_place_that_does_as_well() -> None:
    cloud = Cloud(np.zeros((1, 3), dtype=np.float32), np.ones((1, 3), dtype=np.float32))

    def rival_m(*others: Fit) -> float | None:
        fits = [fit(0.0), *others]
        best = least_contradicted(fits)
        return None if best is None else min(rivals(best, fits, cloud, 1.0).values(), default=None)

    assert rival_m(fit(24.0), fit(12.0)) == pytest.approx(12.0)
    assert rival_m(fit(0.5)) is None  # the same place
    assert rival_m(fit(12.0, doubt=0.12)) is None  # seen through
    assert rival_m(fit(12.0, doubt=0.101)) is None  # far more was
    assert rival_m(fit(12.0, rmse_m=0.025)) == pytest.approx(12.0)
    assert rival_m(fit(12.0, rmse_m=0.035)) is None  # other parts, that only resemble: measured on bridges
    assert rival_m(fit(12.0, doubt=0.05, off_m=0.1)) is None  # stated, so it is the place
    assert rival_m(fit(12.0, off_m=0.1), fit(24.0, off_m=1.0)) is None  # half a metre off counts
    assert rival_m(fit(12.0, off_m=0.1), fit(36.0, off_m=0.2)) == pytest.approx(24.0)
