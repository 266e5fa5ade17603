"""Train the network: `python -m training.train PHOTOS SURFACES OUT [--fold N] [--steps N] [--start PT]`.

PHOTOS holds images/, masks/ and groups.txt, SURFACES what training.surfaces wrote. With --fold the photos of
that fold (by group) are left out and judged along the way; without, all take part. Of each batch two thirds
are photos, the rest surfaces. One thread and a seed: the same result on the same machine. --start goes on
from weights that an earlier call wrote: the rate does not fall then, and the weights of every few thousand
steps are kept for training.average to take the mean of (Izmailov et al. 2018).
"""

import argparse
import copy
import math
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from training.network import Network
from training.photos import DRAWN, Photo, by_fold, crop, read

BATCH = 6  # two of three are photos, the others surfaces
RATE, WARM_UP, DECAY = 3e-3, 300, 1e-3
AVERAGED = 0.999  # weights are averaged over about 1 / (1 − AVERAGED) steps: these are judged and kept
EVERY = 1000  # steps between reports
KEPT = 3  # of so many reports the weights of one are judged, and kept


def loss_of(logit: Tensor, truth: Tensor) -> Tensor:
    """Cross entropy for calibrated probabilities, Dice for areas, and recall of centrelines: a crack that is
    cut costs as much where it is thin as where it is wide. logit (N, 1, H, W), truth (N, 3, H, W): crack,
    centreline, and 0 where no answer is wrong."""
    crack, line, judged = truth[:, :1], truth[:, 1:2], truth[:, 2:]
    entropy = functional.binary_cross_entropy_with_logits(logit, crack, weight=judged)
    p = judged * torch.sigmoid(logit)
    dice = 1.0 - (2.0 * (p * crack).sum() + 1.0) / (p.sum() + crack.sum() + 1.0)
    missed = 1.0 - ((p * line).sum() + 1.0) / (line.sum() + 1.0)
    return 4.0 * entropy + 0.3 * dice + 0.1 * missed


def batch(photos: list[Photo], surfaces: list[Photo], seed: int) -> tuple[Tensor, Tensor]:
    rng = np.random.default_rng(seed)
    sources = [surfaces if k % 3 == 2 else photos for k in range(BATCH)]
    pairs = [crop(any_of(source, rng), any_of(photos, rng), rng) for source in sources]
    return torch.from_numpy(np.stack([p[0] for p in pairs])), torch.from_numpy(
        np.stack([p[1] for p in pairs])
    )


def any_of(photos: list[Photo], rng: np.random.Generator) -> Photo:
    return photos[rng.integers(len(photos))]


@torch.no_grad()
def probabilities(net: Network, rgb: np.ndarray) -> np.ndarray:
    """(H, W) float32 of an (H, W, 3) uint8 photo."""
    height, width = rgb.shape[:2]
    padded = cv2.copyMakeBorder(rgb, 0, -height % 32, 0, -width % 32, cv2.BORDER_REFLECT_101)
    x = torch.from_numpy(np.ascontiguousarray(padded.transpose(2, 0, 1))[None]).float() / 255.0
    out: np.ndarray = torch.sigmoid(net(x))[0, 0, :height, :width].numpy()
    return out


def judged(net: Network, photos: list[Photo]) -> str:
    """Aggregate F1 at 0 px at a few thresholds."""
    thresholds = (0.3, 0.4, 0.5, 0.6)
    counts = np.zeros((len(thresholds), 3))
    for photo in photos:
        p, truth = probabilities(net, photo.rgb), photo.truth[..., 0] > 0
        for k, threshold in enumerate(thresholds):
            found = p >= threshold
            counts[k] += (found & truth).sum(), found.sum(), truth.sum()
    f1 = 2 * counts[:, 0] / np.maximum(counts[:, 1] + counts[:, 2], 1)
    return " ".join(f"{t}:{f:.3f}" for t, f in zip(thresholds, f1, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photos", type=Path)
    parser.add_argument("surfaces", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--fold", type=int)
    parser.add_argument("--steps", type=int, default=60000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path)
    parser.add_argument("--rate", type=float, default=RATE)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    cv2.setNumThreads(0)
    folds = by_fold(args.photos / "groups.txt")
    left_out = [] if args.fold is None else folds[args.fold]
    kept = [name for fold in folds for name in fold if name not in left_out]
    photos = read(args.photos, kept, (0.5, 4.0), DRAWN)
    held = read(args.photos, left_out, (1.0, 1.0))
    surfaces = read(args.surfaces, sorted(p.name for p in (args.surfaces / "masks").iterdir()), (0.7, 2.0))

    net = Network().to(memory_format=torch.channels_last)
    if args.start is not None:
        net.load_state_dict(torch.load(args.start, weights_only=True))
    averaged = copy.deepcopy(net).eval()
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    began, total = time.monotonic(), 0.0
    with ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(batch, photos, surfaces, args.seed << 32)
        for step in range(1, args.steps + 1):
            rgb, truth = coming.result()
            coming = ahead.submit(batch, photos, surfaces, (args.seed << 32) + step)
            falling = 1.0 if args.start else 0.5 + 0.5 * math.cos(math.pi * step / args.steps)
            rate = args.rate * min(step / WARM_UP, falling)
            for group in optimiser.param_groups:
                group["lr"] = rate
            loss = loss_of(net(rgb.contiguous(memory_format=torch.channels_last)), truth)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            total += float(loss.detach())
            keep = min(AVERAGED, (1 + step) / (10 + step))
            with torch.no_grad():
                for mine, new in zip(averaged.state_dict().values(), net.state_dict().values(), strict=True):
                    if mine.dtype.is_floating_point:
                        mine.mul_(keep).add_(new, alpha=1.0 - keep)
            if step % EVERY == 0 or step == args.steps:
                torch.save(averaged.state_dict(), args.out / "weights.pt")
                minutes, held_out = (time.monotonic() - began) / 60, ""
                if step % (KEPT * EVERY) == 0:
                    held_out = judged(averaged, held) if held else ""
                    if args.start:
                        torch.save(averaged.state_dict(), args.out / f"{step:06d}.pt")
                print(f"{step} {minutes:.1f} min, loss {total / EVERY:.4f} {held_out}", flush=True)
                total = 0.0


if __name__ == "__main__":
    main()
