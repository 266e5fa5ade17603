"""From a mosaic on disk to cracks in the world, through the stages' own functions."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from artifacts.store import Store
from schemas.crack import Measurement
from schemas.detection import Detection, Patterns
from schemas.mosaic import Mosaic
from schemas.problem import BadInput
from schemas.settings import DetectSettings, PatternSettings
from tasks.detection import task as detection
from tasks.measurement import task as measurement
from tasks.patterns import task as patterns
from tests.measurement.drawn_crack import drawn_crack
from tests.measurement.mosaics import mosaic_of, wall

Chain = tuple[Patterns, Detection, Measurement]


def through(mosaic: Mosaic, settings: DetectSettings | None = None) -> Chain:
    settings = settings or DetectSettings(method="ridge")
    taken_out = patterns.remove_patterns.bare(mosaic, PatternSettings())
    found = detection.detect.bare(mosaic, taken_out, settings)
    return taken_out, found, measurement.measure.bare(mosaic, taken_out, found, settings)


def test_a_crack_in_millimetres_and_in_the_world(own_store: Path) -> None:
    drawn = drawn_crack(lambda x: 0 * x + 4.0, slope=0.2)
    mosaic = mosaic_of(Store(own_store), drawn.rgb, 0.5, wall(0.24, 0.08))
    taken_out, found, result = through(mosaic)
    assert taken_out.inspectable_px > 0.98 * drawn.rgb.shape[0] * drawn.rgb.shape[1]
    assert [crack.id for crack in result.cracks] == ["wall-C001"]
    crack = result.cracks[0]
    assert crack.length_mm == pytest.approx(drawn.length_px * 0.5, rel=0.02)
    assert crack.width_median_mm == pytest.approx(2.0, abs=0.08)
    assert crack.width_sigma_mm is not None and 0.0 < crack.width_sigma_mm < 0.15
    assert crack.orientation_deg == pytest.approx(180 - np.degrees(np.arctan(0.2)), abs=2)
    assert crack.photo == "a.jpg"
    assert crack.position_m == pytest.approx((2.12, 3.0, 4.96), abs=0.003)  # the middle of the picture
    world = np.array(crack.polyline_world_m)
    u, v = world[:, 0] - 2.0, world[:, 2] - 5.0
    assert np.abs(world[:, 1] - 3.0).max() < 1e-9
    assert np.abs(v * 1000 + np.interp(u * 2000, drawn.x, drawn.y) * 0.5).max() < 0.5
    assert [sample.s_mm for sample in crack.widths] == sorted(sample.s_mm for sample in crack.widths)
    for stage, result_of_stage in (
        (patterns.remove_patterns, taken_out),
        (detection.detect, found),
        (measurement.measure, result),
    ):
        assert stage.pages is not None and stage.pages({"mosaic": mosaic}, result_of_stage)


def test_what_is_not_known_of_the_scale_is_not_known_of_a_crack(own_store: Path) -> None:
    """± 6 % of the scale, as GPS tells it."""
    mosaic = mosaic_of(Store(own_store), drawn_crack(lambda x: 0 * x + 4.0).rgb, 0.5)
    exact, vague = (
        through(mosaic.model_copy(update={"scale_sigma": sigma}))[2].cracks[0] for sigma in (None, 0.06)
    )
    for crack, share in ((exact, 0.0), (vague, 0.06)):
        assert crack.length_sigma_mm == pytest.approx(np.hypot(3.9, share * (crack.length_mm or 0)), rel=0.1)
        assert (crack.width_sigma_mm or 0) > share * (crack.width_median_mm or 0)
        assert all(one.sigma_mm > share * one.width_mm for one in crack.widths)
    assert (exact.length_mm, exact.width_median_mm) == (vague.length_mm, vague.width_median_mm)


def test_without_a_scale_only_pixels_are_said(own_store: Path) -> None:
    drawn = drawn_crack(lambda x: 0 * x + 4.0)
    _, found, result = through(
        mosaic_of(Store(own_store), drawn.rgb, None), DetectSettings(method="ridge", baselines=True)
    )
    crack = result.cracks[0]
    assert crack.length_px == pytest.approx(drawn.length_px, rel=0.02)
    assert crack.length_mm is None and crack.width_median_mm is None and crack.widths == ()
    assert [name for name, _ in found.baselines] == ["T = 125", "T = 155", "from the peaks", "Otsu"]


def test_ids_and_bytes_are_the_same_in_every_run(own_store: Path, tmp_path: Path) -> None:
    drawn = drawn_crack(lambda x: 3.0 + np.sin(x / 30))
    mosaic = mosaic_of(Store(own_store), drawn.rgb, 1.0, wall(0.48, 0.16))
    first, second = through(mosaic), through(mosaic)
    assert [a.model_dump_json() for a in first] == [b.model_dump_json() for b in second]


def test_the_rim_of_the_coverage_is_no_crack(own_store: Path) -> None:
    drawn = drawn_crack(lambda x: 0 * x + 3.0)
    known = np.ones(drawn.rgb.shape[:2], dtype=bool)
    known[:30], known[:, 200:215] = False, False
    rgb = np.where(known[..., None], drawn.rgb, 0).astype(np.uint8)
    taken_out, found, result = through(mosaic_of(Store(own_store), rgb, 1.0, coverage=known))
    assert taken_out.blank_px == (~known).sum() and found.inspected_px == known.sum()
    assert all(abs(crack.orientation_deg - 90) > 60 for crack in result.cracks)
    assert 1 <= len(result.cracks) <= 2


def test_a_truncated_mosaic_is_named(own_store: Path) -> None:
    files = Store(own_store)
    mosaic = mosaic_of(files, drawn_crack(lambda x: 0 * x + 3.0).rgb, 1.0)
    half = own_store.parent / "half.tif"
    half.write_bytes(files.path(mosaic.image).read_bytes()[: mosaic.image.size // 3])
    with pytest.raises(BadInput, match=r"wall: its mosaic"):
        through(mosaic.model_copy(update={"image": files.put(half)}))


def test_a_short_crack_that_somebody_drew_is_measured(own_store: Path) -> None:
    """10 mm long, 50 px: shorter than what is searched for, even in so small an image."""
    rgb = drawn_crack(lambda x: 0 * x + 4.0, slope=0.0, amplitude_px=0.0).rgb
    mosaic = mosaic_of(Store(own_store), rgb, 0.2)
    mask = np.zeros(rgb.shape[:2], np.uint8)
    mask[78:82, 100:150] = 1
    with Store(own_store).scratch() as folder:
        cv2.imwrite(str(folder / "m.png"), mask)
        found = detection.given_mask(mosaic, Store(own_store).put(folder / "m.png"), "m.png")
    taken_out = patterns.remove_patterns.bare(mosaic, PatternSettings())
    (crack,) = measurement.measure.bare(mosaic, taken_out, found, DetectSettings()).cracks
    assert crack.length_mm == pytest.approx(10.0, abs=1.0)
