"""Control: what fixes a mosaic's gauge and what judges it, against known cameras."""

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from schemas.control import Control, PlaneTarget, ScaleBar
from schemas.mosaic import Mosaic
from schemas.problem import BadInput
from schemas.settings import StitchSettings
from tasks.stitching.control import Gauge, Mark, fix_gauge, judged
from tasks.stitching.mosaicking import _contradicted
from tasks.stitching.solution import Solved
from tasks.stitching.tags import find_tags
from tasks.stitching.task import stitch
from tests.stitching.photo_sets import SETTINGS, PhotoSet, errors_px
from tests.stitching.scenes import WALL

PLACES = {"A": (0.3, 0.2), "B": (2.2, 0.3), "C": (0.4, 1.4), "D": (2.1, 1.5), "E": (1.2, 0.8)}
CORNERS = ("A", "B", "C", "D")


def sightings(wall: PhotoSet, noise_px: float = 0.3) -> dict[str, dict[str, tuple[float, float]]]:
    """Where the photos show the places, as somebody would click them."""
    rng = np.random.default_rng(2)
    seen: dict[str, dict[str, tuple[float, float]]] = {}
    for mark, uv in PLACES.items():
        for name, (camera, pose) in sorted(wall.truth.items()):
            x, y = camera.project(WALL.to_world([uv]), pose)[0]
            if 5 < x < camera.width_px - 5 and 5 < y < camera.height_px - 5:
                dx, dy = rng.normal(0, noise_px, 2)
                seen.setdefault(mark, {})[name] = (float(x + dx), float(y + dy))
    return seen


def without_poses(wall: PhotoSet) -> PhotoSet:
    photos = tuple(p.model_copy(update={"pose": None}) for p in wall.photos)
    return PhotoSet(photos, wall.features, wall.truth)


def controlled(photos: PhotoSet, control: Control, settings: StitchSettings = SETTINGS) -> Mosaic:
    mosaic: Mosaic = stitch.bare("wall", None, photos.photos, photos.features, settings, control)
    return mosaic


@pytest.fixture(scope="module")
def surveyed(wall: PhotoSet) -> Mosaic:
    targets = [PlaneTarget(mark=m, uv_m=PLACES[m]) for m in CORNERS]
    bar = ScaleBar(ends=("A", "D"), length_mm=1000 * float(np.hypot(1.8, 1.3)))
    control = Control(
        marks=sightings(wall),
        targets=(*targets, PlaneTarget(mark="E", uv_m=PLACES["E"], check=True)),
        scale_bars=(bar,),
    )
    return controlled(without_poses(wall), control)


def test_targets_put_photos_without_poses_into_the_frame_of_the_survey(
    surveyed: Mosaic, wall: PhotoSet
) -> None:
    assert surveyed.scale_from == "targets"
    assert surveyed.gsd_mm_px == pytest.approx(2.0, rel=0.02)
    errors = errors_px(surveyed, wall.truth, gauge=False)
    assert np.sqrt((errors**2).mean()) < 0.4  # marks were clicked to 0.3 px, each in two photos or more
    assert errors.max() < 1.0


def test_check_points_and_bars_judge_and_take_no_part(surveyed: Mosaic) -> None:
    by_name = {r.name: r for r in surveyed.control}
    assert {name for name, r in by_name.items() if r.used} == set(CORNERS)
    assert by_name["E"].check
    assert not by_name["A – D"].used
    for residual in surveyed.control:
        assert np.abs(residual.residual_mm).max() < 1.2
        assert residual.photos >= 1
        assert residual.spread_mm < 2.0
    moved = [r.residual_mm for r in surveyed.control if r.used]
    assert np.abs(np.mean(moved, axis=0)).max() < 0.01  # least squares: control's own balance


def test_a_scale_bar_fixes_the_scale_alone(wall: PhotoSet) -> None:
    bars = (
        ScaleBar(ends=("A", "D"), length_mm=1000 * float(np.hypot(1.8, 1.3))),
        ScaleBar(ends=("B", "C"), length_mm=1000 * float(np.hypot(1.8, 1.1)), check=True),
    )
    marks = sightings(wall)
    mosaic = controlled(
        without_poses(wall),
        Control(marks={m: {p: marks[m][p] for p in sorted(marks[m])[:2]} for m in CORNERS}, scale_bars=bars),
    )
    assert mosaic.scale_from == "scale bars"
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=0.01)
    used, check = mosaic.control
    assert used.used
    assert used.residual_mm == pytest.approx(0.0, abs=1e-3)
    assert check.check
    assert not check.used
    assert check.residual_mm == pytest.approx(0.0, abs=1.5)


def marks_at(places: dict[str, tuple[float, float]]) -> dict[str, Mark]:
    """As a mosaic of another scale, turn and origin would have them."""
    z = {name: (u + 1j * v - 3.0) / (2.5 * np.exp(0.7j)) for name, (u, v) in places.items()}
    return {name: Mark(np.array([c.real, c.imag]), np.array([[c.real, c.imag]])) for name, c in z.items()}


def test_a_target_that_contradicts_the_others_is_named_and_not_used() -> None:
    stated = PLACES | {"C": (0.4, 1.9)}
    control = Control(tags="4X4_50", targets=tuple(PlaneTarget(mark=m, uv_m=uv) for m, uv in stated.items()))
    gauge = fix_gauge("wall", control, marks_at(PLACES), 0.001, [])
    assert gauge is not None
    assert gauge.used == {"A", "B", "D", "E"}
    assert gauge.scale == pytest.approx(2.5)
    assert gauge.angle_rad == pytest.approx(0.7)
    _, left_out = judged(control, marks_at(PLACES), gauge, False, True)
    assert [(one.item, one.what) for one in left_out] == [("target C", "contradicts the other targets")]


def test_one_target_fixes_nothing_and_says_so() -> None:
    control = Control(tags="4X4_50", targets=(PlaneTarget(mark="A", uv_m=(0, 0)),))
    assert fix_gauge("wall", control, marks_at(PLACES), 0.001, []) is None
    residuals, left_out = judged(control, marks_at(PLACES), None, False, False)
    assert residuals == ()
    assert "fewer than two" in left_out[0].what


def test_mirrored_targets_are_refused() -> None:
    targets = tuple(PlaneTarget(mark=m, uv_m=(u, -v)) for m, (u, v) in PLACES.items())
    with pytest.raises(BadInput, match="mirrored"):
        fix_gauge("wall", Control(tags="4X4_50", targets=targets), marks_at(PLACES), 0.001, [])


def test_a_mark_in_a_photo_that_is_not_there_is_named(wall: PhotoSet) -> None:
    seen: dict[str, dict[str, tuple[float, float]]] = {"A": {"nowhere.jpg": (1, 2)}, "B": {}}
    control = Control(marks=seen, scale_bars=(ScaleBar(ends=("A", "B"), length_mm=10),))
    two = PhotoSet(wall.photos[:2], wall.features[:2], wall.truth)
    named = {one.item: one.what for one in controlled(two, control).left_out}
    assert named["mark A"] == "there is no readable photo nowhere.jpg in this set"
    assert named["scale bar A – B"] == "no solved photo shows A and B"


@pytest.mark.parametrize(
    "bad",
    [
        {},
        {"targets": [{"mark": "A", "uv_m": [0, 0]}]},
        {"tags": "4X4_50", "scale_bars": [{"ends": ["1", "1"], "length_mm": 100}]},
        {"tags": "4X4_50", "targets": [{"mark": "1", "uv_m": [0, 0]}, {"mark": "1", "uv_m": [1, 0]}]},
        {"tags": "5X4_50", "targets": [{"mark": "1", "uv_m": [0, 0]}]},
    ],
)
def test_control_that_means_nothing_is_refused(bad: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Control.model_validate(bad)


def test_a_tags_centre_is_found_to_a_tenth_of_a_pixel() -> None:
    """Seen aslant: the mean of its corners would lie 2 px off."""
    side = 400
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    page = np.full((600, 600), 200, np.uint8)
    page[100:500, 100:500] = cv2.aruco.generateImageMarker(dictionary, 7, side)
    H = np.array([[0.30, 0.05, 200.0], [-0.02, 0.26, 150.0], [1e-4, 4e-4, 1.0]])
    finer = np.array([[4.0, 0.0, 1.5], [0.0, 4.0, 1.5], [0.0, 0.0, 1.0]])
    fine = cv2.warpPerspective(page, finer @ H, (2560, 1920), borderValue=120)
    fine = cv2.GaussianBlur(fine, (0, 0), 2.8)
    seen = cv2.resize(fine, (640, 480), interpolation=cv2.INTER_AREA)
    twice = np.hstack([seen, seen])
    centre = H @ [299.5, 299.5, 1.0]
    found = find_tags(cv2.cvtColor(seen, cv2.COLOR_GRAY2RGB), "APRILTAG_36H11")
    assert list(found) == ["7"]
    assert found["7"] == pytest.approx(centre[:2] / centre[2], abs=0.1)
    assert find_tags(cv2.cvtColor(twice, cv2.COLOR_GRAY2RGB), "APRILTAG_36H11") == {}


def test_marks_name_a_photo_by_its_file_where_no_other_is_called_so(wall: PhotoSet, surveyed: Mosaic) -> None:
    """The photos lie in two folders; one name is in both, and needs its folder to be told."""
    bare = without_poses(wall)
    folders = tuple(
        p.model_copy(update={"name": f"card{1 + k % 2}/{p.name}"}) for k, p in enumerate(bare.photos)
    )
    twice = folders[0].model_copy(update={"name": f"card2/{bare.photos[0].name}"})
    photos = PhotoSet((*folders, twice), (*bare.features, bare.features[0]), bare.truth)
    seen = sightings(wall)
    targets = tuple(PlaneTarget(mark=m, uv_m=PLACES[m]) for m in CORNERS)
    mosaic = controlled(photos, Control(marks=seen, targets=targets))
    assert mosaic.scale_from == "targets"
    assert mosaic.gsd_mm_px == pytest.approx(surveyed.gsd_mm_px, rel=0.002)
    unclear = {left.what for left in mosaic.left_out if left.item.startswith("mark ")}
    assert unclear == {f"there is no readable photo {bare.photos[0].name} in this set"}


@pytest.mark.parametrize(
    ("known_from", "sigma", "words"),
    [("poses", 0.05, 1), ("GPS", 0.05, 1), ("GPS", 0.3, 0), ("none", 0.05, 0)],
)
def test_a_stated_scale_that_positions_contradict_is_doubted(
    known_from: str, sigma: float, words: int
) -> None:
    solved = Solved({}, {}, {}, {}, sigma, 0.0, (), frozenset())
    doubts = _contradicted("wall", Gauge(2.0, 0.0, np.zeros(2), "stated GSD"), known_from, solved, 0.001)
    assert len(doubts) == words
    for doubt in doubts:
        assert doubt.what == f"its scale is 2 mm/px by stated GSD, 1 (± 5 %) by {known_from}"
