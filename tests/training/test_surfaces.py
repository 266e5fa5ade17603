"""What the network learns from; PyTorch is not needed for it."""

from pathlib import Path

import numpy as np
import pytest

from tests.development_data import development_data
from training import surfaces
from training.photos import ON_CRACK, SIDE_PX, Photo, by_fold, crop
from training.surfaces import surface


def test_truth_lies_where_a_crack_is_dark(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same surface with and without its cracks differs on the truth, and hardly elsewhere."""
    monkeypatch.setattr(surfaces, "SIDE_PX", 320)
    seed = 4
    rgb, truth = surface(seed)
    assert rgb.shape == (320, 320, 3) and truth.any()
    kept = surfaces._skin
    monkeypatch.setattr(surfaces, "_skin", lambda rng, seed, face, px, cracks: kept(rng, seed, face, px, ()))
    bare, _ = surface(seed)
    darker = bare.astype(int).sum(axis=2) - rgb.astype(int).sum(axis=2)
    assert darker[truth > 0].mean() > 5 * np.abs(darker[truth == 0]).mean()


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


def test_a_crop_keeps_truth_on_its_crack() -> None:
    """However turned, scaled and relit: the truth stays on the dark line."""
    rgb = np.full((300, 300, 3), 180, np.uint8)
    truth = np.zeros((300, 300, 2), np.uint8)
    rgb[148:153], truth[148:153] = 30, 255
    on_crack = np.argwhere(truth[..., 0] > 0).astype(np.int32)
    photo = Photo("line", rgb, truth, on_crack, (0.5, 2.0))
    contrast = []
    for seed in range(30):
        seen, mask = crop(photo, np.random.default_rng(seed))
        assert seen.shape == (3, SIDE_PX, SIDE_PX) and mask.shape == (2, SIDE_PX, SIDE_PX)
        assert seen.min() >= 0.0 and seen.max() <= 1.0
        if mask[0].sum() > 100:
            contrast.append(seen[:, mask[0] == 0].mean() - seen[:, mask[0] > 0].mean())
    assert len(contrast) > 30 * ON_CRACK * 0.7 and np.median(contrast) > 0.15
