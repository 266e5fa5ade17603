"""`make bench-detection`: F1 on the development sets, false cracks where there are none, and time, beside
doxapy, scikit-image and OpenCV. Both sets are real; their scale is unknown, 0.5 mm a pixel is assumed.

Of `uav` the fold that the shipped network never saw is a row of its own; on the other folds it has learned.
Part folds asks of each fold a network that never saw it, from `make train-folds PHOTOS=FOLDER`
(of fold 0 the shipped one).
What is not on this machine, a set or a peer, is a row that says so.
"""

import importlib.util
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
from tasks.assessment.evaluation import evaluate, near, tally
from tasks.connected import Marked
from tasks.detection.components import components
from tasks.detection.detect import detect_image
from tasks.detection.network import OUR_LIMITS, Model
from tasks.detection.sauvola import grey_of, sauvola
from tests.benchmarks import crack_rows, large_mosaic_rows, wall_rows
from tests.benchmarks.table import Row, absent, gather, row
from tests.development_data import ROOT
from training.photos import FOLDS, by_fold
from training.surfaces import surface

SETS = ("uav", "deepcrack_train")
LEARNED = ("hairline", "uav")  # its own photos judge no network: see `folds`
BARS = {
    ("hairline", "deepcrack_train"): (0.84, 0.92),
    ("ridge", "uav"): (0.45, 0.55),
    ("ridge", "deepcrack_train"): (0.83, 0.91),
}  # F1 at 0 and 2 px
GSD_MM_PX = 0.5
SURFACES, FIRST_SEED = 300, 960_000  # crack-free, unseen by training and calibration
FALSE_PER_10_M2 = 1.0
NEAR_PX = 5  # of a drawn crack: not a crack-free part
FOLD_NETWORKS = Path("build/training/folds")  # K.onnx
SPEED_BARS = {"Sauvola": 0.6, "ridge": 18.0, "hairline": 25.0}  # × doxapy's Sauvola
SPEED_PX = (3000, 4000)  # of a photo of 12 MP

Pixels = npt.NDArray[np.uint8]
Mask = npt.NDArray[np.bool_]
Finder = Callable[[Pixels], Mask]


def finders() -> dict[str, Finder]:
    return {**{name: _ours(settings) for name, settings in ALL.items()}, **peers()}


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


def photos() -> Iterator[Row]:
    """F1 with its interval and length found and true, of every method and peer on every set."""
    for name in SETS:
        yield from on_photos(name)


def on_photos(name: str) -> Iterator[Row]:
    if not (ROOT / "cracks" / name.split(",")[0]).is_dir():
        yield absent(f"F1 on {name}", "", "the set is not on this machine")
        return
    evaluations = []
    for method, find in finders().items():
        if (method, name) == LEARNED:
            continue
        evaluations += evaluate(method, [tally(find(rgb), truth) for rgb, truth in _of_set(name)])
    out.print(as_table(evaluations))
    best = {
        d: max(e.aggregate.f1 for e in evaluations if e.method not in ALL and e.tolerance_px == d)
        for d in (0, 2, 5)
    }
    for one in evaluations:
        d = one.tolerance_px
        bars = BARS.get((one.method, name))
        bar = f"≥ {bars[d > 0]:g}" if bars and d < 5 else None
        low, high = one.f1_interval
        what = f"F1 of {one.method} at {d} px, 95 % in {low:.2f}–{high:.2f}"
        peer = "the best peer" if one.method in ALL else None
        yield row(what, one.aggregate.f1, "1", bar, name, None, peer, best[d] if peer else None)
        yield row(f"length found by {one.method} at {d} px", one.length.recall, "1", None, name, None)
        yield row(f"length of {one.method} true at {d} px", one.length.precision, "1", None, name, None)


def enlarged() -> Iterator[Row]:
    """F1 of `hairline` on the same photos enlarged, as if from nearer and less sharp."""
    name = "deepcrack_train"
    if not (ROOT / "cracks" / name).is_dir():
        yield absent(f"F1 on {name}, enlarged", "", "the set is not on this machine")
        return
    for factor in (2, 4):
        tallies = []
        for rgb, truth in _of_set(name):
            large = cv2.resize(rgb, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
            mask = detect_image(np.asarray(large, np.uint8), None, ALL["hairline"], None).mask
            small = cv2.resize(mask.astype(np.float32), truth.shape[::-1], interpolation=cv2.INTER_AREA)
            tallies.append(tally(np.asarray(small) >= 0.5, truth))
        for one in evaluate("hairline", tallies):
            what = f"F1 of hairline at {one.tolerance_px} px"
            yield row(what, one.aggregate.f1, "1", None, f"{name}, enlarged {factor} times", None)


def _of_set(name: str) -> Iterator[tuple[Pixels, Mask]]:
    """Photos and what somebody drew on them; "SET, fold N": one fold of the set, by group."""
    folder = ROOT / "cracks" / name.split(",")[0]
    names = by_fold(folder / "groups.txt")[int(name.split()[-1])] if "fold" in name else None
    masks = {path.stem: path for path in (folder / "masks").iterdir()}
    for path in sorted((folder / "images").iterdir()):
        if names is None or path.name in names:
            bgr = np.asarray(cv2.imread(str(path), cv2.IMREAD_COLOR), dtype=np.uint8)
            truth = np.asarray(cv2.imread(str(masks[path.stem]), cv2.IMREAD_GRAYSCALE)) > 0
            yield np.ascontiguousarray(bgr[..., ::-1]), truth


def folds() -> Iterator[Row]:
    """F1 of `hairline` on every photo of uav, each by a network that never saw its group; the worst fold."""
    networks = {k: FOLD_NETWORKS / f"{k}.onnx" for k in range(FOLDS)}
    missing = [str(path) for path in networks.values() if not path.is_file()]
    if missing or not (ROOT / "cracks" / "uav").is_dir():
        what = f"no {missing[0]}: make train-folds" if missing else "cracks/uav is not on this machine"
        yield absent("F1 of hairline on uav, five folds", "", what)
        return
    of_fold = {
        k: Model(path.read_bytes(), path.name, at_smaller_sizes=True, limits=OUR_LIMITS)
        for k, path in networks.items()
    }
    found = {
        k: [
            tally(detect_image(rgb, None, DetectSettings(), None, model=model).mask, truth)
            for rgb, truth in _of_set(f"uav, fold {k}")
        ]
        for k, model in of_fold.items()
    }
    every = evaluate("hairline", [one for tallies in found.values() for one in tallies])
    of_each = {k: evaluate("hairline", tallies) for k, tallies in found.items()}
    for at, one in enumerate(every):
        d = one.tolerance_px
        bar = {0: "≥ 0.65", 2: "≥ 0.8"}.get(d)
        low, high = one.f1_interval
        what = f"F1 of hairline at {d} px, 95 % in {low:.2f}–{high:.2f}"
        yield row(what, one.aggregate.f1, "1", bar, "uav, five folds", None)
        worst = min(of_each, key=lambda k: of_each[k][at].aggregate.f1)
        for k, those in of_each.items():
            told = f"F1 of hairline at {d} px" + (", the worst fold" if k == worst else "")
            yield row(told, those[at].aggregate.f1, "1", None, f"uav, fold {k}", None)


def false_cracks() -> Iterator[Row]:
    """Found where the simulator drew none: cast, rough, smooth, wood, brick, and all that lies on them; of
    the network for each least score."""
    methods = {name: ALL[name] for name in ("ridge", "paper")}
    found = dict.fromkeys(methods, 0)
    scores: list[float] = []
    area_m2 = 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + SURFACES):
        rgb, _ = surface(seed, crack_free=True)
        area_m2 += rgb.shape[0] * rgb.shape[1] * (GSD_MM_PX / 1000) ** 2
        all_of_them = detect_image(rgb, None, DetectSettings(min_score=0.0), GSD_MM_PX)
        scores += [one.score for one in all_of_them.scores]
        for name, settings in methods.items():
            mask = detect_image(rgb, None, settings, GSD_MM_PX).mask
            found[name] += cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)[0] - 1
    data, seed_text = f"{area_m2:.1f} m² of simulated surface at {GSD_MM_PX} mm/px", f"{FIRST_SEED}…"
    default = DetectSettings().min_score
    for least in sorted({default, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9}):
        rate = 10 * sum(score >= least for score in scores) / area_m2
        bar = f"≤ {FALSE_PER_10_M2:g}" if least == default else None
        yield row(f"false cracks of hairline, least score {least}", rate, "1/10 m²", bar, data, seed_text)
    for name, count in found.items():
        yield row(f"false cracks of {name}", 10 * count / area_m2, "1/10 m²", None, data, seed_text)


def false_on_photos() -> Iterator[Row]:
    """Found on the crack-free parts of photos that the network never saw: away from every crack that somebody
    drew."""
    name = "deepcrack_train"
    if not (ROOT / "cracks" / name).is_dir():
        yield absent(f"false cracks on {name}", "", "the set is not on this machine")
        return
    found, free_px = 0, 0
    for rgb, truth in _of_set(name):
        mask = detect_image(rgb, None, ALL["hairline"], GSD_MM_PX).mask
        drawn = near(truth, NEAR_PX)
        free_px += int((~drawn).sum())
        pieces = components(Marked.of_levels(mask.view(np.uint8)))
        label = pieces.label[drawn[pieces.pixels.y, pieces.pixels.x]]
        on_drawn = np.bincount(label, minlength=len(pieces.area_px)) / np.maximum(pieces.area_px, 1)
        found += int((on_drawn[1:] < 0.5).sum())
    area_m2 = free_px * (GSD_MM_PX / 1000) ** 2
    data = f"{area_m2:.1f} m² of {name}, {GSD_MM_PX} mm/px assumed"
    rate, bar = 10 * found / area_m2, f"≤ {FALSE_PER_10_M2:g}"
    yield row("false cracks of hairline away from what was drawn", rate, "1/10 m²", bar, data, None)


def speed() -> Iterator[Row]:
    """CPU milliseconds per megapixel on a textured image, one thread; the best of three."""
    high, wide = SPEED_PX
    rgb, _ = surface(FIRST_SEED)
    rgb = np.ascontiguousarray(np.tile(rgb, (high // len(rgb) + 1, wide // len(rgb) + 1, 1))[:high, :wide])
    mp = rgb[..., 0].size / 1e6
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    spent = {}
    thresholds = {"Sauvola": lambda image: sauvola(grey_of(image), 63, 0.5, 128.0)}
    for name, find in {**finders(), **thresholds}.items():
        times = []
        for _ in range(3):
            began = time.process_time()
            find(rgb)
            times.append(time.process_time() - began)
        spent[name] = 1e3 * min(times) / mp
    cv2.setNumThreads(before)
    peer = spent.get("doxapy Sauvola")
    data = f"{mp:.0f} MP, simulated"
    for name, ms in spent.items():
        yield row(f"time of {name}", ms, "ms/MP", None, data, f"{FIRST_SEED}")
        if peer and name in SPEED_BARS:
            times_peer, bar = ms / peer, f"≤ {SPEED_BARS[name]:g}"
            yield row(f"time of {name}", times_peer, "× doxapy's Sauvola", bar, data, None, "doxapy", peer)


PARTS = {
    "photos": photos,
    "enlarged": enlarged,
    "folds": folds,
    "false-cracks": false_cracks,
    "false-on-photos": false_on_photos,
    "speed": speed,
    "walls": wall_rows.rows,
    "turns": crack_rows.turns,
    "widths": crack_rows.widths,
    "blur": crack_rows.blur,
    "size": large_mosaic_rows.rows,
}

if __name__ == "__main__":
    gather("detection", PARTS)
