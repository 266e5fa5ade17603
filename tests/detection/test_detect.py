import cv2
import numpy as np
import pytest

from schemas.bit_mask import BitMask
from schemas.detection import Peaks
from schemas.raster import ArrayRaster
from schemas.settings import DetectSettings
from tasks.connected import Marked
from tasks.detection import windows
from tasks.detection.detect import baselines, detect_image, detect_raster
from tests.measurement.drawn_crack import drawn_crack

RIDGE, PAPER = DetectSettings(method="ridge"), DetectSettings(method="paper")


def rough(height: int, width: int, grey: float = 150.0, contrast: float = 0.05, seed: int = 0) -> np.ndarray:
    """Concrete-like: most of its contrast in coarse grains and stains."""
    rng = np.random.default_rng(seed)
    texture = sum(
        cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), s) * 2 * s * share
        for s, share in ((1.0, 0.5), (4.0, 0.6), (15.0, 0.8))
    )
    values = grey * (1 + contrast * texture) + rng.normal(size=(height, width)) * 2
    return np.dstack([np.clip(values, 0, 255).astype(np.uint8)] * 3)


def wander(length: int, seed: int = 1) -> np.ndarray:
    steps = np.random.default_rng(seed).normal(0, 0.45, length)
    return np.cumsum(cv2.GaussianBlur(np.cumsum(steps)[:, None], (0, 0), 3).ravel() * 0.02 + steps)


def with_crack(
    rgb: np.ndarray, y: int, width: int, depth: float, x0: int, x1: int, seed: int = 1
) -> np.ndarray:
    """Darkens a wandering line in place; returns its mask."""
    mask = np.zeros(rgb.shape[:2], dtype=np.uint8)
    line = np.column_stack([np.arange(x0, x1), y + wander(x1 - x0, seed)])
    cv2.polylines(mask, [np.rint(line).astype(np.int32)], False, 1, width)
    soft = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 0.7)[..., None]
    rgb[:] = (rgb * (1 - depth * soft)).astype(np.uint8)
    return mask > 0


def found_share(found: np.ndarray, truth: np.ndarray) -> float:
    near = cv2.dilate(found.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return float((truth & near).sum() / truth.sum())


def false_px(found: np.ndarray, truth: np.ndarray) -> int:
    near = cv2.dilate(truth.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    return int((found & ~near).sum())


@pytest.mark.parametrize(("width", "depth"), [(2, 0.5), (3, 0.35), (6, 0.3)])
def test_finds_a_crack_and_nothing_else(width: int, depth: float) -> None:
    rgb = rough(300, 700, contrast=0.03)
    truth = with_crack(rgb, 150, width, depth, 60, 640)
    found = detect_image(rgb, None, RIDGE, 1.0).mask
    assert found_share(found, truth) > 0.9
    assert false_px(found, truth) == 0


def test_ridge_asks_half_the_size_about_what_it_found(monkeypatch: pytest.MonkeyPatch) -> None:
    rgb = rough(301, 700, contrast=0.03)
    truth = with_crack(rgb, 150, 8, 0.35, 60, 640)
    asked = []

    def none_of_it(pixels: Marked, half: BitMask) -> Marked:
        asked.append((pixels.mask.whole(), half.whole()))
        return pixels.where(np.zeros(len(pixels.y), dtype=bool))

    monkeypatch.setattr("tasks.detection.detect.seen_at_half_size", none_of_it)
    told: list[float] = []
    found = detect_raster(ArrayRaster(rgb), RIDGE, 1.0, Peaks(), told.append)
    ((full, half),) = asked
    assert not found.mask.any() and found_share(full, truth) > 0.9
    assert half.shape == (150, 350) and found_share(half, truth[:300:2, ::2]) > 0.9
    assert told == sorted(told) and told[-1] == 1.0


def test_rough_concrete_without_cracks_is_left_alone() -> None:
    for seed in range(4):
        rgb = rough(1000, 1000, contrast=0.06, seed=seed)
        assert not detect_image(rgb, None, RIDGE, 1.0).mask.any()


def test_holes_stains_and_a_shadows_edge_are_no_cracks() -> None:
    rgb = rough(500, 700)
    for x in (100, 300, 500):
        cv2.circle(rgb, (x, 100), 12, (40, 40, 40), cv2.FILLED)  # tie holes
    stain = cv2.GaussianBlur(
        cv2.ellipse(np.zeros((500, 700)), ((350, 250), (60, 200), 10), 1.0, -1), (0, 0), 12
    )
    rgb[:] = (rgb * (1 - 0.4 * stain[..., None])).astype(np.uint8)
    shade = (np.arange(700) + np.arange(500)[:, None] * 0.3 > 620)[..., None]
    rgb[:] = np.where(shade, rgb * 0.4, rgb).astype(np.uint8)
    assert not detect_image(rgb, None, RIDGE, 1.0).mask.any()


def test_a_formwork_joint_is_told_from_the_crack_that_crosses_it() -> None:
    rgb = rough(600, 900, contrast=0.03)
    truth = with_crack(rgb, 300, 4, 0.5, 60, 840)
    cv2.line(rgb, (450, 0), (470, 599), (70, 70, 70), 4)
    found = detect_image(rgb, None, RIDGE, 1.0)
    joint = cv2.line(np.zeros((600, 900), np.uint8), (450, 0), (470, 599), 1, 4) > 0
    assert found_share(found.mask, truth) > 0.9
    assert (
        found.mask & joint & ~cv2.dilate(truth.astype(np.uint8), np.ones((25, 25))).astype(bool)
    ).sum() == 0
    assert len(found.joints) == 1 and found.joints[0].length_px == pytest.approx(600, abs=40)


def test_masked_pixels_have_no_say() -> None:
    """Whatever lies under a mask, the crack beside it is found the same."""
    rgb = rough(300, 500, contrast=0.03)
    truth = with_crack(rgb, 150, 3, 0.4, 20, 480)
    valid = np.ones(rgb.shape[:2], dtype=bool)
    valid[100:200, 230:270] = False
    masks = []
    for under in (0, 128, 255):
        rgb[~valid] = under
        masks.append(detect_image(rgb, valid, RIDGE, 1.0).mask)
    assert (masks[0] == masks[1]).all() and (masks[1] == masks[2]).all()
    assert not masks[0][~valid].any()
    assert found_share(masks[0], truth & valid) > 0.9 and false_px(masks[0], truth) == 0


@pytest.mark.parametrize("settings", [RIDGE, PAPER], ids=["ridge", "paper"])
def test_windows_give_what_the_whole_gives(settings: DetectSettings, monkeypatch: pytest.MonkeyPatch) -> None:
    rgb = rough(620, 500, contrast=0.08)
    with_crack(rgb, 200, 4, 0.7, 10, 490)
    for at in range(20, 600, 45):
        cv2.circle(rgb, (340, at), 14, (45, 45, 45), cv2.FILLED)  # compact
    cv2.rectangle(rgb, (60, 290), (210, 390), (45, 45, 45), cv2.FILLED)  # shade, larger than the window
    valid = np.ones(rgb.shape[:2], dtype=bool)
    valid[:, :30], valid[180:230, 120:150] = False, False
    peaks = Peaks(peaks=(60, 150), i_surface=150)
    masks, told = [], []
    for most_px, step_px in ((windows.MOST_PX, windows.STEP_PX), (1, 8)):
        monkeypatch.setattr(windows, "MOST_PX", most_px)
        monkeypatch.setattr(windows, "STEP_PX", step_px)
        told.clear()
        masks.append(detect_raster(ArrayRaster(rgb, valid), settings, 2.0, peaks, told.append).mask)
    assert len(told) > 3 and masks[0].any() and (masks[0] == masks[1]).all()


@pytest.mark.parametrize("method", ["hairline", "ridge", "paper", "global"])
@pytest.mark.parametrize("level", [0, 128, 255])
@pytest.mark.parametrize("shape", [(1, 1), (2, 300), (120, 90)])
def test_flat_images_hold_no_crack(method: str, level: int, shape: tuple[int, int]) -> None:
    rgb = np.full((*shape, 3), level, dtype=np.uint8)
    found = detect_image(rgb, None, DetectSettings.model_validate({"method": method}), None)
    assert found.mask.shape == shape and not found.mask.any()
    assert found.inspected_px == shape[0] * shape[1]


def test_half_in_shade_finds_the_same_crack() -> None:
    """Both halves of the light, one crack: the paper's wall. A global threshold floods the shade."""
    rgb = rough(300, 800, contrast=0.03)
    truth = with_crack(rgb, 150, 4, 0.6, 40, 760)
    rgb[:] = (rgb * np.where(np.arange(800) < 400, 1.0, 0.5)[:, None]).astype(np.uint8)
    ours = detect_image(rgb, None, RIDGE, 1.0).mask
    assert found_share(ours, truth) > 0.9 and false_px(ours, truth) == 0
    paper = detect_image(rgb, None, PAPER, 1.0).mask
    assert false_px(paper, truth) < 50
    given = baselines(ArrayRaster(rgb), Peaks(peaks=(75, 150), i_surface=150))
    named = {name: mask.whole() for name, mask in given}
    assert set(named) == {"T = 125", "T = 155", "from the peaks", "Otsu"}
    assert false_px(named["T = 125"], truth) > 50_000


def test_the_papers_rule_takes_out_what_lies_beyond_t1_and_t2() -> None:
    rgb = rough(200, 300, contrast=0.02)
    rgb[50:100, 50:100] = 0
    cut = detect_image(rgb, None, PAPER, None, Peaks(peaks=(0, 150), i_surface=150, i_blank=0, t1=75.0))
    uncut = detect_image(rgb, None, PAPER, None)
    assert not cut.mask[55:95, 55:95].any() and uncut.mask[55:95, 55:95].any()


def test_a_drawn_crack_of_one_pixel_is_found() -> None:
    drawn = drawn_crack(lambda x: 0 * x + 1.0)
    truth = np.zeros(drawn.rgb.shape[:2], dtype=bool)
    truth[np.rint(drawn.y).astype(int), np.clip(np.rint(drawn.x), 0, 479).astype(int)] = True
    assert found_share(detect_image(drawn.rgb, None, RIDGE, 1.0).mask, truth) > 0.9
