"""`make bench-detection`: F1 on the development sets, false cracks where there are none, and time, beside
doxapy, scikit-image and OpenCV. Both sets are real; their scale is unknown, 0.5 mm a pixel is assumed.

Of `uav` the fold that the shipped network never saw is a row of its own; on the other folds it has learned.
What is not on this machine, a set or a peer, is a row that says so.
"""

import importlib.util
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from flows.console import out
from flows.evaluate_command import ALL, as_table
from schemas.settings import DetectSettings
from tasks.assessment.evaluation import evaluate
from tasks.detection.detect import detect_image
from tasks.detection.sauvola import grey_of
from tests.development_data import ROOT
from training.photos import by_fold
from training.surfaces import surface

SETS = ("uav", "uav, fold 0", "deepcrack_train")
BARS = {
    ("hairline", "uav, fold 0"): (0.65, 0.80),
    ("hairline", "deepcrack_train"): (0.84, 0.92),
    ("ridge", "uav"): (0.45, 0.55),
    ("ridge", "deepcrack_train"): (0.83, 0.91),
}  # F1 at 0 and 2 px
GSD_MM_PX = 0.5
SURFACES, FIRST_SEED = 100, 960_000  # crack-free, unseen by training and calibration
FALSE_PER_10_M2 = 1.0
SPEED_BARS = {"paper": 0.6, "ridge": 18.0, "hairline": 25.0}  # × doxapy's Sauvola
SPEED_MP = 4.0

Pixels = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]
Finder = Callable[[Pixels], Mask]


def main() -> None:
    finders = {**{name: _ours(settings) for name, settings in ALL.items()}, **peers()}
    rows = [row for name in SETS for row in on_photos(name, finders)]
    rows += false_cracks() + speed(finders)
    path = Path("build/bench/detection.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows, indent=1) + "\n")
    out.print(f"\n{path}")


def _ours(settings: DetectSettings) -> Finder:
    return lambda rgb: detect_image(rgb, None, settings, None).mask


def peers() -> dict[str, Finder]:
    """Local thresholds and ridge filters of others at their usual settings; window 63 as ours."""
    found: dict[str, Finder] = {"OpenCV adaptive": _adaptive}
    if importlib.util.find_spec("doxapy"):
        import doxapy

        for kind in ("SAUVOLA", "NIBLACK", "WOLF", "NICK", "WAN", "TRSINGH", "ISAUVOLA", "SU", "BATAINEH"):
            found[f"doxapy {kind.title()}"] = _doxapy(doxapy, kind)
    else:
        out.print("doxapy is not installed: pip install -e '.[bench]'")
    from skimage import filters

    found["skimage Sauvola"] = lambda rgb: (
        grey_of(rgb) < filters.threshold_sauvola(grey_of(rgb).astype(float), 63, k=0.5, r=128)
    )
    for name in ("sato", "frangi", "meijering"):
        found[f"skimage {name}"] = _ridges(getattr(filters, name), filters.threshold_otsu)
    return found


def _adaptive(rgb: Pixels) -> Mask:
    mean, inverse = cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV
    return np.asarray(cv2.adaptiveThreshold(grey_of(rgb), 1, mean, inverse, 63, 25) > 0)


def _doxapy(doxapy: Any, kind: str) -> Finder:
    def find(rgb: Pixels) -> Mask:
        grey = grey_of(rgb)
        binary = np.empty_like(grey)
        binarization = doxapy.Binarization(getattr(doxapy.Binarization.Algorithms, kind))
        binarization.initialize(grey)
        binarization.to_binary(binary, {"window": 63, "k": -0.2 if kind == "NIBLACK" else 0.5})
        return np.asarray(binary == 0)

    return find


def _ridges(of: Callable[..., Any], otsu: Callable[..., Any]) -> Finder:
    def find(rgb: Pixels) -> Mask:
        response = of(grey_of(rgb).astype(float) / 255, sigmas=(1, 2, 4), black_ridges=True)
        return np.asarray(response > otsu(response))

    return find


def on_photos(name: str, finders: dict[str, Finder]) -> list[dict[str, Any]]:
    folder = ROOT / "cracks" / name.split(",")[0]
    if not folder.is_dir():
        return [{"what": f"F1 on {name}", "value": None, "data": "not on this machine"}]
    names = None
    if "fold" in name:
        names = by_fold(folder / "groups.txt")[int(name.split()[-1])]
    evaluations = []
    for finder in finders:
        pairs = ((finders[finder](rgb), truth) for rgb, truth in _pairs(folder, names))
        evaluations += evaluate(finder, pairs)
    out.print(f"\n{name}, {evaluations[0].images} images")
    out.print(as_table(evaluations))
    rows = []
    best = max(e.aggregate.f1 for e in evaluations if e.method in finders and e.method not in ALL)
    for one in evaluations:
        bar = BARS.get((one.method, name), (None, None)) if one.tolerance_px < 5 else (None,)
        least = bar[min(one.tolerance_px, len(bar) - 1, 1)]
        low, high = one.f1_interval
        figures = {
            "F1": one.aggregate.f1,
            "length found": one.length.recall,
            "length true": one.length.precision,
        }
        for what, value in figures.items():
            asked = least if what == "F1" else None
            rows.append(
                {
                    "what": f"{what} of {one.method} at {one.tolerance_px} px",
                    "value": round(value, 3),
                    "unit": "1",
                    "bar": asked,
                    "holds": None if asked is None else value >= asked,
                    "interval": [low, high] if what == "F1" else None,
                    "peer": "the best peer at 0 px",
                    "peer_value": round(best, 3) if what == "F1" and one.tolerance_px == 0 else None,
                    "data": name,
                    "seed": None,
                }
            )
    return rows


def _pairs(folder: Path, names: list[str] | None) -> Iterator[tuple[Pixels, Mask]]:
    masks = {path.stem: path for path in (folder / "masks").iterdir()}
    for path in sorted((folder / "images").iterdir()):
        if names is None or path.name in names:
            bgr = np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR), dtype=np.uint8)
            truth = np.asarray(cv2.imread(str(masks[path.stem]), cv2.IMREAD_GRAYSCALE)) > 0
            yield np.ascontiguousarray(bgr[..., ::-1]), truth


def false_cracks() -> list[dict[str, Any]]:
    """Found where the simulator drew none: cast, rough, smooth, wood, brick, and all that lies on them."""
    methods = {name: ALL[name] for name in ("hairline", "ridge", "paper")}
    found = dict.fromkeys(methods, 0)
    area_m2 = 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + SURFACES):
        rgb, _ = surface(seed, crack_free=True)
        area_m2 += rgb.shape[0] * rgb.shape[1] * (GSD_MM_PX / 1000) ** 2
        for name, settings in methods.items():
            mask = detect_image(rgb, None, settings, GSD_MM_PX).mask
            found[name] += cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)[0] - 1
    rows = []
    for name, count in found.items():
        rate = 10 * count / area_m2
        out.print(f"{name}: {rate:.1f} false cracks per 10 m² on {area_m2:.1f} m² of simulated surface")
        rows.append(
            {
                "what": f"false cracks of {name} per 10 m²",
                "value": round(rate, 2),
                "unit": "1/10 m²",
                "bar": FALSE_PER_10_M2 if name == "hairline" else None,
                "holds": rate <= FALSE_PER_10_M2 if name == "hairline" else None,
                "data": f"{SURFACES} simulated surfaces without cracks, 0.5 mm/px assumed",
                "seed": FIRST_SEED,
            }
        )
    return rows


def speed(finders: dict[str, Finder]) -> list[dict[str, Any]]:
    """CPU milliseconds per megapixel on a textured image, one thread; the best of three."""
    side = round((SPEED_MP * 1e6) ** 0.5)
    rgb, _ = surface(FIRST_SEED)
    rgb = np.ascontiguousarray(np.tile(rgb, (side // len(rgb) + 1,) * 2 + (1,))[:side, :side])
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    spent = {}
    for name, find in finders.items():
        times = []
        for _ in range(3):
            began = time.process_time()
            find(rgb)
            times.append(time.process_time() - began)
        spent[name] = 1e3 * min(times) / SPEED_MP
    cv2.setNumThreads(before)
    peer = spent.get("doxapy Sauvola")
    rows = []
    for name, ms in spent.items():
        bar = SPEED_BARS.get(name)
        ratio = ms / peer if peer else None
        out.print(f"{name}: {ms:.1f} ms/MP" + (f", {ratio:.1f} × doxapy's Sauvola" if ratio else ""))
        rows.append(
            {
                "what": f"time of {name}",
                "value": round(ms, 1),
                "unit": "ms/MP",
                "bar": f"{bar} × the peer" if bar else None,
                "holds": ratio <= bar if bar and ratio else None,
                "peer": "doxapy Sauvola",
                "peer_value": round(peer, 1) if peer else None,
                "data": f"{SPEED_MP:.0f} MP, simulated",
                "seed": FIRST_SEED,
            }
        )
    return rows


if __name__ == "__main__":
    main()
