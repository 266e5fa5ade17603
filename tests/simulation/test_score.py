from collections.abc import Sequence

import numpy as np
import pytest

from schemas.crack import Crack
from schemas.crack_report import CrackReport, SurfaceInspected
from schemas.simulation import Score, TrueCrack, Truth
from tasks.simulation.bridge import bridge
from tasks.simulation.score import score
from tasks.simulation.score_table import score_table
from tasks.simulation.truth import truth

TRUTH = truth(bridge(1))
SURFACES = {s.name: s for s in TRUTH.surfaces}


def reported(
    crack: TrueCrack, width: float = 1.0, length: float = 1.0, keep: slice = slice(None), moved: bool = True
) -> Crack:
    """What a perfect inspection says of a planted crack, in a frame that is off by 0.25 m, 1° and 2 %."""
    surface = SURFACES[crack.surface]
    uv = np.asarray(crack.polyline_uv_m)[keep]
    mm = 1e3 * float(np.linalg.norm(np.diff(uv, axis=0), axis=1).sum())
    if moved:
        c, s = 1.02 * np.cos(np.radians(1)), 1.02 * np.sin(np.radians(1))
        uv = uv @ np.array([[c, s], [-s, c]]) + (0.15, -0.2)
    widths = np.asarray(crack.widths_mm)[keep]
    return Crack(
        id=crack.id,
        surface=f"found-{crack.surface}",
        polyline_px=((0.0, 0.0), (1.0, 1.0)),
        length_px=mm,
        width_median_px=1.0,
        width_max_px=1.0,
        orientation_deg=0.0,
        length_mm=mm * length,
        width_median_mm=float(np.median(widths[widths >= 1.0]) if (widths >= 1).any() else widths.max())
        * width,
        polyline_world_m=tuple((float(x), float(y), float(z)) for x, y, z in surface.to_world(uv) + 0.03),
    )


def judged(cracks: Sequence[Crack]) -> Score:
    surfaces = tuple(
        SurfaceInspected(
            name=f"found-{s.name}",
            area_m2=s.area_m2,
            inspected_m2=s.area_m2,
            gsd_mm_px=1.0,
            photos=10,
            cracks=0,
            method="perfect",
        )
        for s in TRUTH.surfaces
    )
    report = CrackReport(
        inspection="t", method="perfect", surfaces=surfaces, cracks=tuple(cracks), not_inspected=()
    )
    return score(report, TRUTH)


PERFECT = [reported(c) for c in TRUTH.cracks]


def test_truth_says_where_and_how_wide() -> None:
    for crack in TRUTH.cracks:
        uv = np.asarray(crack.polyline_uv_m)
        world = SURFACES[crack.surface].to_world(uv)
        np.testing.assert_allclose(world, crack.polyline_world_m, atol=1e-5)
        assert len(crack.widths_mm) == len(uv)
        walked = 1e3 * np.linalg.norm(np.diff(uv, axis=0), axis=1).sum()
        assert walked == pytest.approx(crack.length_mm, rel=2e-3)
    assert Truth.model_validate_json(TRUTH.model_dump_json()) == TRUTH


def test_a_perfect_report_in_a_shifted_frame_holds_every_bar() -> None:
    result = judged(PERFECT)
    assert result.holds
    assert result.wide_found == result.wide_planted >= 6
    assert not result.false_cracks
    assert all(c.found > 0.97 for c in result.cracks)
    errors = {c.id: abs(c.length_error) for c in result.cracks if c.length_error is not None}
    assert errors.pop("W4") < 0.06  # about a pixel wide: what of it counts comes and goes
    assert max(errors.values()) < 0.03
    assert max(abs(c.width_error_px) for c in result.cracks if c.width_error_px is not None) < 0.06
    assert all(f.scale == pytest.approx(1 / 1.02, abs=2e-3) for f in result.fits)


def test_a_missing_wide_crack_is_missed() -> None:
    result = judged([c for c in PERFECT if c.id != "W2"])
    assert not result.holds
    assert result.wide_found == result.wide_planted - 1
    assert {c.id: c.found for c in result.cracks}["W2"] == 0.0


def test_a_missing_thin_crack_breaks_no_bar() -> None:
    assert judged([c for c in PERFECT if c.id != "W4"]).holds


def test_a_crack_where_none_is_counts_as_false() -> None:
    planted = next(c for c in TRUTH.cracks if c.id == "W1")
    uv = np.asarray(planted.polyline_uv_m) + np.array([1.2, 0.0])
    shifted = planted.model_copy(update={"polyline_uv_m": tuple(map(tuple, uv)), "id": "ghost"})
    result = judged([*PERFECT, reported(shifted)])
    assert [f.id for f in result.false_cracks] == ["ghost"]
    assert result.false_per_5_m2 == pytest.approx(5 / result.inspected_m2)


def test_a_crack_far_from_every_surface_is_false() -> None:
    far = PERFECT[0].model_copy(
        update={"id": "far", "polyline_world_m": ((50.0, 50.0, 1.0), (50.5, 50.0, 1.0))}
    )
    assert [f.id for f in judged([*PERFECT, far]).false_cracks] == ["far"]


@pytest.mark.parametrize(("width", "length"), [(1.25, 1.0), (0.8, 1.0), (1.0, 1.2), (1.0, 0.8)])
def test_wrong_widths_and_lengths_break_their_bar(width: float, length: float) -> None:
    assert not judged([reported(c, width, length) for c in TRUTH.cracks]).holds


@pytest.mark.parametrize(("width", "length"), [(1.05, 1.0), (0.95, 1.0), (1.0, 1.06), (1.0, 0.94)])
def test_errors_within_the_bars_hold(width: float, length: float) -> None:
    assert judged([reported(c, width, length) for c in TRUTH.cracks]).holds


def test_a_crack_reported_in_pieces_counts_as_whole() -> None:
    pieces = []
    for crack in TRUTH.cracks:
        half = len(crack.widths_mm) // 2
        pieces += [reported(crack, keep=slice(None, half + 1)), reported(crack, keep=slice(half, None))]
    result = judged(pieces)
    assert result.wide_found == result.wide_planted and not result.false_cracks
    assert max(abs(c.length_error) for c in result.cracks if c.length_error is not None) < 0.04


def test_half_a_crack_is_found_by_half() -> None:
    crack = next(c for c in TRUTH.cracks if c.id == "S1")
    rest = [c for c in PERFECT if c.id != "S1"]
    piece = reported(crack, keep=slice(0, int(0.4 * len(crack.widths_mm))))
    found = {c.id: c.found for c in judged([*rest, piece]).cracks}["S1"]
    assert found == pytest.approx(0.4, abs=0.06)


def test_an_empty_report_finds_nothing_and_divides_by_nothing() -> None:
    result = judged([])
    assert result.wide_found == 0 and not result.holds and result.false_per_5_m2 == 0.0


def test_the_table_says_what_fails() -> None:
    text = score_table(judged([c for c in PERFECT if c.id != "W2"]))
    assert "cracks ≥ 3 px wide" in text and "NOT every bar holds" in text
    assert "every bar holds" in score_table(judged(PERFECT))
    assert max(map(len, text.splitlines())) <= 110
