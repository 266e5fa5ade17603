"""What the network learns from; PyTorch is not needed for it."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pytest

from tasks.simulation.crack import CrackShape
from tests.development_data import development_data
from training import surfaces
from training.cracks import DOUBTFUL, one_crack, seen, told
from training.photos import ON_CRACK, SIDE_PX, Photo, _dappled, _faded, by_fold, crop, read
from training.surfaces import main, surface

NOWHERE = np.zeros((0, 2), np.int32)


def test_truth_lies_where_a_crack_is_dark(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same surface with and without its cracks differs on the truth, and hardly elsewhere."""
    monkeypatch.setattr(surfaces, "SIDE_PX", 320)
    seed = 2
    rgb, truth = surface(seed)
    assert rgb.shape == (320, 320, 3) and truth.any()
    kept = surfaces._skin
    monkeypatch.setattr(surfaces, "_skin", lambda *known: kept(*known[:-2], (), ()))
    bare, _ = surface(seed)
    darker = bare.astype(int).sum(axis=2) - rgb.astype(int).sum(axis=2)
    assert darker[truth == 255].mean() > 5 * np.abs(darker[truth == 0]).mean()


def test_a_wire_counts_neither_as_crack_nor_as_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(surfaces, "SIDE_PX", 320)
    truths = ((seed, surface(seed)[1]) for seed in range(200))
    wired = next(seed for seed, truth in truths if (truth == DOUBTFUL).any() and not (truth == 255).any())
    main(tmp_path, 1, wired)
    (photo,) = read(tmp_path, [f"{wired:05d}.png"], (1.0, 1.0))
    doubtful = surface(wired)[1] == DOUBTFUL
    assert ((photo.truth[..., 2] == 0) == doubtful).all() and not photo.truth[doubtful, :2].any()


def test_a_crack_covers_as_much_as_it_is_wide() -> None:
    """The shares that pixels see of cracks add up to the cracks' area, in pixels."""
    u = np.linspace(20.3, 80.7, 200)
    half = np.linspace(0.2, 1.5, 200)
    one = CrackShape("c", None, np.column_stack([u, np.full(200, 50.4)]), half, half, half)
    assert seen((one,), 100, 100.0, 1.0).sum() == pytest.approx(60.4 * 1.7, rel=0.02)


def test_a_crack_drawn_on_a_photo_is_dark_and_true() -> None:
    rgb = np.full((300, 300, 3), 180, np.uint8)
    truth = np.zeros((300, 300, 3), np.uint8)
    truth[..., 2] = 255
    untouched = np.full((300, 300), 255, np.uint8)
    photo = Photo("bare", rgb, truth, untouched, NOWHERE, (1.0, 1.0), drawn=1.0)
    contrast = []
    for seed in range(20):
        looks, mask = crop(photo, photo, np.random.default_rng(seed))
        assert mask[2].all() and mask[0].any()
        contrast.append(looks[:, mask[0] == 0].mean() - looks[:, mask[1] > 0].mean())
    assert np.median(contrast) > 0.06  # some are faint


def test_gaps_are_dark_and_some_cracks_hardly_darker_than_the_texture() -> None:
    rms = 0.05
    cracks = [
        one_crack(np.random.default_rng(seed), np.full(2, 500.0), 0.0, 1000.0, 1.0, rms)
        for seed in range(400)
    ]
    width = np.array([np.median(one.left_m + one.right_m) for one in cracks])
    dark = np.array([-np.log(one.kept_light.mean()) for one in cracks])
    assert (width > 25).any() and dark[width > 15].min() > 0.5
    faint = (dark > 1.0 * rms) & (dark < 7.0 * rms)
    assert 0.2 < faint.mean() < 0.5 and faint[width < 5].any()


@pytest.mark.parametrize("chord_px", [8, 16, 32, 64])
def test_cracks_turn_as_real_ones_do(chord_px: int) -> None:
    """Real ones by 19 to 26° RMS from chord to chord of any length (bench-detection, part turns), counted
    through their junctions; here without any."""
    turns: list[float] = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        uv = one_crack(rng, np.full(2, 500.0), rng.uniform(0, 2 * np.pi), 1000.0, 1.0, 0.0).uv_m
        steps = np.diff(uv[::chord_px], axis=0)
        turns += np.degrees(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))).tolist()
    assert 13.0 < np.sqrt(np.mean(np.square(turns))) < 28.0


def test_a_faded_crack_is_fainter_and_the_surface_as_it_was() -> None:
    photo = _line()
    kept = photo.kept.astype(np.float32) / np.float32(255)
    rgb = photo.rgb.astype(np.float32) / np.float32(255)
    crack = photo.truth[..., 1] > 0
    for seed in range(20):
        faded = _faded(rgb, kept, np.random.default_rng(seed))
        assert (faded[kept == 1.0] == rgb[kept == 1.0]).all()
        dark = 1.0 - faded[crack].mean() / rgb[kept == 1.0].mean()
        assert 0.3 < dark < 0.77  # .83 before


def test_what_drowns_in_the_texture_is_neither_crack_nor_none() -> None:
    """The same dark line on a smooth and on a rough wall, and one that only half of the wall drowns."""
    rng = np.random.default_rng(0)
    truth = np.zeros((200, 200), np.uint8)
    truth[99:102] = 255
    line = np.where(truth > 0, 0.8, 1.0)[..., None]
    smooth, rough = (np.exp(rng.normal(0.0, sigma, (200, 200, 1))) * np.full(3, 0.4) for sigma in (0.02, 1.0))
    half = np.where(np.arange(200)[None, :, None] < 100, smooth, rough)
    on_smooth, on_rough, on_half = (
        told(np.clip(wall * line, 0, 1).astype(np.float32), truth) for wall in (smooth, rough, half)
    )
    assert (on_smooth == truth).all()
    assert (on_rough[99:102] == DOUBTFUL).mean() > 0.9 and not on_rough[truth == 0].any()
    assert (on_half[99:102, :60] == 255).all() and (on_half[99:102, 140:] == DOUBTFUL).mean() > 0.9


def test_groups_of_one_photo_never_part(tmp_path: Path) -> None:
    groups = tmp_path / "groups.txt"
    groups.write_text("".join(f"{k}.png {k // 4}\n" for k in range(60)))
    folds = by_fold(groups)
    assert sorted(name for fold in folds for name in fold) == sorted(f"{k}.png" for k in range(60))
    of_group = [{int(name.split(".")[0]) // 4 for name in fold} for fold in folds]
    assert sum(len(groups) for groups in of_group) == 15
    assert {len(fold) for fold in folds} == {12}


def test_folds_of_the_real_set_are_even() -> None:
    sizes = [len(fold) for fold in by_fold(development_data("cracks/uav") / "groups.txt")]
    assert sum(sizes) == 252 and max(sizes) - min(sizes) <= 3


def _line() -> Photo:
    """A dark crack five pixels wide across a bright photo."""
    rgb = np.full((300, 300, 3), 180, np.uint8)
    mask = np.zeros((300, 300), np.uint8)
    rgb[148:153], mask[148:153] = 30, 255
    with TemporaryDirectory() as folder:
        for part, picture in (("images", rgb), ("masks", mask)):
            (Path(folder) / part).mkdir()
            cv2.imwrite(str(Path(folder) / part / "line.png"), picture)
        (photo,) = read(Path(folder), ["line.png"], (0.5, 2.0))
    return photo


def test_a_lent_crack_is_dark_and_true(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cracks of one photo laid on another: as dark there beside its surface, and drawn in the truth."""
    monkeypatch.setattr("training.photos.LENT", 1.0)
    line = _line()
    grey, no_crack = np.full((300, 300, 3), 120, np.uint8), np.full((300, 300, 3), [0, 0, 255], np.uint8)
    bare = replace(line, rgb=grey, truth=no_crack, on_crack=NOWHERE)
    contrast = []
    for seed in range(20):
        looks, mask = crop(bare, line, np.random.default_rng(seed))
        assert mask[2].all() and mask[0].any()
        contrast.append(looks[:, mask[0] == 0].mean() / max(1e-3, looks[:, mask[1] > 0].mean()))
    assert np.median(contrast) > 2.0


def test_a_crop_keeps_truth_on_its_crack() -> None:
    """However turned, scaled and relit: the truth stays on the dark line."""
    photo = _line()
    contrast = []
    for seed in range(30):
        looks, mask = crop(photo, photo, np.random.default_rng(seed))
        assert looks.shape == (3, SIDE_PX, SIDE_PX) and mask.shape == (3, SIDE_PX, SIDE_PX)
        assert looks.min() >= 0.0 and looks.max() <= 1.0
        if mask[0].sum() > 100:
            contrast.append(looks[:, mask[0] == 0].mean() - looks[:, mask[0] > 0].mean())
    assert len(contrast) > 30 * ON_CRACK * 0.7 and np.median(contrast) > 0.15


def test_leaves_shadows_darken_a_part_and_whatever_lies_there_alike() -> None:
    """In the shadow as in the sun a surface keeps its own contrast."""
    rng = np.random.default_rng(3)
    surfaces = [rng.uniform(0.2, 0.6, (SIDE_PX, SIDE_PX, 3)).astype(np.float32) for _ in range(2)]
    for seed in range(10):
        share, other = (_dappled(rgb, np.random.default_rng(seed)) / rgb for rgb in surfaces)
        assert share == pytest.approx(other, abs=1e-5)
        green = share[..., 1]
        assert 0.2 < green.min() < 0.8 and green.max() < 1 + 1e-5
        assert 0.01 < (green < 0.9).mean() < 0.6
