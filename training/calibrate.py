"""Make probabilities mean what they say: `python -m training.calibrate MODEL.onnx PHOTOS FOLD SURFACES...`.

On photos of a fold that training left out, and on surfaces it never saw, this fits
- slope and offset of the logits, so that of the photos' pixels called 70 % seven in ten are crack (Platt
  1999), for training.export; with the network so calibrated this is run once more;
- the weights of a candidate's score (tasks.detection.candidates): strength, bend, elongation, against
  whether most of it lies on a crack that somebody drew;
and counts false cracks on the surfaces without any, for each least score. Nothing else is fitted on anything.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from schemas.raster import ArrayRaster
from tasks.connected import Marked
from tasks.detection.candidates import STRONGEST, candidates, features
from tasks.detection.network import OUR_LIMITS, Model, Probability, probability
from training.cracks import DOUBTFUL
from training.photos import by_fold

NEAR_PX = 3
LEAST_PX = 30.0  # as in the settings where no scale is known
GSD_MM_PX = 0.5  # assumed, to say false cracks per area
LEAST_MM = 50.0
# Of the score's weights, 1/σ² of a prior around 0: that of the elongation counts half of what the candidates
# ask for by themselves, since among them wide gaps are few.
DECAY = np.array([0.1, 0.1, 0.1, 25.0, 0.1])

Mask = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.float64]


def held_out(model: Model, photos: Path, fold: int) -> Iterator[tuple[Probability, Mask]]:
    yield from _seen(model, photos, by_fold(photos / "groups.txt")[fold])


def unseen(model: Model, folder: Path) -> Iterator[tuple[Probability, Mask]]:
    yield from _seen(model, folder, sorted(p.name for p in (folder / "masks").iterdir()))


def _seen(model: Model, folder: Path, names: list[str]) -> Iterator[tuple[Probability, Mask]]:
    for name in names:
        bgr = cv2.imread(str(folder / "images" / name), cv2.IMREAD_COLOR)
        mask = cv2.imread(str(folder / "masks" / name), cv2.IMREAD_GRAYSCALE)
        rgb = np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])
        p = probability(ArrayRaster(rgb), model)
        p[np.asarray(mask) == DOUBTFUL] = 0  # neither found nor missed
        yield p, np.asarray(mask) > DOUBTFUL


def logistic(features: Floats, truth: Mask, weights: Floats, decay: float | Floats = 1e-3) -> Floats:
    """Coefficients (k,) of a logistic regression on (n, k) features, by Newton's method. decay: of each."""
    w = np.zeros(features.shape[1])
    decay = np.broadcast_to(decay, len(w))
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-np.clip(features @ w, -30, 30)))
        gradient = features.T @ (weights * (p - truth)) + decay * w
        hessian = (features * (weights * p * (1 - p))[:, None]).T @ features + np.diag(
            np.broadcast_to(decay, len(w))
        )
        w = w - np.linalg.solve(hessian, gradient)
    return w


def logit(probability_255: npt.NDArray[np.generic]) -> Floats:
    p = np.clip(np.asarray(probability_255, dtype=np.float64) / 255.0, 1.0 - STRONGEST, STRONGEST)
    return np.asarray(np.log(p / (1.0 - p)))


def fit_pixels(pairs: list[tuple[Probability, Mask]]) -> Floats:
    """Slope and offset of the logits."""
    counts = np.zeros((256, 2))
    for p, truth in pairs:
        for k in (0, 1):
            counts[:, k] += np.bincount(p[truth == bool(k)], minlength=256)
    z = logit(np.arange(256))
    features = np.column_stack([np.r_[z, z], np.ones(512)])
    truth = np.r_[np.zeros(256), np.ones(256)] > 0
    return logistic(features, truth, np.r_[counts[:, 0], counts[:, 1]])


def judged(p: Probability, truth: Mask, least_px: float) -> tuple[Floats, Mask]:
    """Features of the long and thin candidates, and which of them are cracks."""
    likely = Marked.of_levels(np.where(p >= OUR_LIMITS.edge, p, np.uint8(0)))
    found = candidates(likely, OUR_LIMITS).found
    which = (found.extent_px >= least_px) & found.thin
    which[0] = False
    reach = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * NEAR_PX + 1, 2 * NEAR_PX + 1))
    near = cv2.dilate(truth.astype(np.uint8), reach) > 0
    on_crack = np.bincount(found.label[near[found.pixels.y, found.pixels.x]], minlength=len(which))
    right = on_crack / np.maximum(found.area_px, 1.0)
    return features(found)[which], right[which] >= 0.5


def main(model_path: Path, photos: Path, fold: int, folders: list[Path]) -> None:
    model = Model(model_path.read_bytes(), model_path.name, at_smaller_sizes=True)
    of_photos = list(held_out(model, photos, fold))
    of_surfaces = [pair for folder in folders for pair in unseen(model, folder)]
    slope, offset = fit_pixels(of_photos)
    print(f"logits: slope {slope:.3f}, offset {offset:+.3f} (1 and 0 where they are calibrated already)")
    seen, truths = zip(*(judged(p, truth, LEAST_PX) for p, truth in of_photos + of_surfaces), strict=True)
    x, y = np.vstack(seen), np.concatenate(truths)
    w = logistic(x, y, np.ones(len(y)), DECAY)
    print(f"{len(y)} candidates, {y.sum()} cracks: WEIGHTS = {w.round(3).tolist()}")
    score = 1.0 / (1.0 + np.exp(-(x @ w)))
    for low, high in ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8), (0.8, 1.0)):
        inside = (score >= low) & (score <= high)
        if inside.any():
            print(
                f"  score {low:.1f}–{high:.1f}: {inside.sum()} candidates, {y[inside].mean():.2f} are cracks"
            )
    free = [(p, truth) for p, truth in of_surfaces if not truth.any()]
    area_m2 = sum(p.size for p, _ in free) * (GSD_MM_PX / 1000) ** 2
    false = [judged(p, truth, LEAST_MM / GSD_MM_PX)[0] for p, truth in free]
    alarms = 1.0 / (1.0 + np.exp(-(np.vstack(false) @ w)))
    for least in (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9):
        rate = 10 * (alarms >= least).sum() / area_m2
        print(f"  least score {least:.1f}: {rate:.1f} false cracks per 10 m² on {area_m2:.1f} m² without any")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), [Path(p) for p in sys.argv[4:]])
