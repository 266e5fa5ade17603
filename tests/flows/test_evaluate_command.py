"""`hairline evaluate` on three drawn images, one of them with a mask of another size."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from artifacts import palette
from artifacts.evaluation_pictures import MISSED, RIGHT
from flows.evaluate_command import evaluate


def write_cracked(folder: Path, name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    y = np.arange(20, 236)
    x = 128 + np.cumsum(rng.normal(0, 0.9, len(y))).astype(int)
    mask = np.zeros((256, 256), np.uint8)
    cv2.polylines(mask, [np.column_stack([x, y]).astype(np.int32)], False, 255, 3)
    surface = 150 + 6 * cv2.GaussianBlur(rng.standard_normal((256, 256)), (0, 0), 1.0)
    grey = np.where(mask > 0, 60, surface).clip(0, 255).astype(np.uint8)
    cv2.imwrite(str(folder / "images" / name), np.dstack([grey] * 3))
    cv2.imwrite(str(folder / "masks" / name), mask)


def test_figures_curves_and_the_worst_images(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for part in ("images", "masks"):
        (tmp_path / part).mkdir()
    for seed, name in enumerate(("a.png", "b.png", "c.png")):
        write_cracked(tmp_path, name, seed)
    cv2.imwrite(str(tmp_path / "masks" / "c.png"), np.zeros((9, 9), np.uint8))
    out = tmp_path / "out"
    evaluate(tmp_path / "images", tmp_path / "masks", out=out, method=("ridge", "hairline"))
    table = capsys.readouterr().out
    assert len(re.findall(r"\d\.\d\d–\d\.\d\d", table)) == 6  # both methods at three tolerances
    assert max(len(line) for line in table.splitlines() if " px " in line) <= 80
    told = json.loads((out / "evaluation.json").read_text())
    assert told["images"] == 2
    assert [(one["item"], one["what"]) for one in told["left_out"]] == [
        ("c.png", "is 256×256 px, its mask 9×9")
    ]
    ridge = next(one for one in told["results"] if (one["method"], one["tolerance_px"]) == ("ridge", 2))
    assert ridge["aggregate"]["f1"] > 0.9
    assert len(told["curves"]["precision"]) == 255
    picture = cv2.imread(str(out / "curves.png"))
    assert picture is not None and picture.std() > 1
    worst = sorted((out / "worst").iterdir())
    assert [path.name[0] for path in worst] == ["1", "2"]
    assert {path.stem[-1] for path in worst} == {"a", "b"}
    side_by_side = cv2.imread(str(worst[0]))[..., ::-1].astype(int)
    for third, colour in ((1, MISSED), (2, RIGHT)):  # what was drawn; what was found
        part = side_by_side[:, third * side_by_side.shape[1] // 3 :]
        assert (np.abs(part - palette.rgb(colour).astype(int)).max(axis=2) < 40).sum() > 100


def test_masks_without_any_crack_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for part in ("images", "masks"):
        (tmp_path / part).mkdir()
    write_cracked(tmp_path, "a.png", 0)
    evaluate(tmp_path / "images", tmp_path / "masks", out=tmp_path / "out", method=("ridge",))
    assert "marks any crack" not in capsys.readouterr().err
    cv2.imwrite(str(tmp_path / "masks" / "a.png"), np.zeros((256, 256), np.uint8))
    evaluate(tmp_path / "images", tmp_path / "masks", out=tmp_path / "out", method=("ridge",))
    assert "marks any crack" in capsys.readouterr().err
