"""From probabilities to cracks: what hangs together is judged as a whole.

A crack starts where the network is sure and goes on while it is fairly sure (hysteresis). The middle of a
faint crack is no likelier than the blurred rim of a dark one, so a rim ends where there is a third of the
likeliest nearby. Pieces that are hardly apart, as where the edge of a shadow crosses a crack, are one
candidate: half a crack is often as straight as a joint. Its score is the probability that one as strong,
straight and slender is a crack, fitted on photos and surfaces that the network had not seen
(training.calibrate): so one threshold stands for one rate of false alarms.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tasks.connected import Marked, highest_near
from tasks.detection.components import Components, components
from tasks.detection.network import Limits

RIM = 1 / 3  # of the highest probability within RIM_PX: what has less is no crack but its blurred rim
RIM_PX = 12
REACH_PX = 5  # pieces of one crack are at most twice as far apart; at 5, 20 or 40 px all is alike
STRONGEST = 254.5 / 255.0  # nothing is surer than its last bit
WEIGHTS = (1.634, -0.946, -0.363, 0.335, -2.006)  # of the features, from training.calibrate

Floats = npt.NDArray[np.float64]


class Scored(NamedTuple):
    position_px: tuple[float, float]  # x, y of its box's middle
    score: float


class Candidates(NamedTuple):
    found: Components
    score: Floats  # of each component by label, 0..1; 0 for the background

    def at(self, which: npt.NDArray[np.bool_]) -> tuple[Scored, ...]:
        """Where the chosen components are, and their scores."""
        scored = []
        for label in np.flatnonzero(which[1:]) + 1:
            x, y, width, height = self.found.box(int(label))
            scored.append(Scored((x + width / 2, y + height / 2), round(float(self.score[label]), 3)))
        return tuple(scored)


def candidates(pixels: Marked, limits: Limits) -> Candidates:
    """What hangs together of the connected pixels that hold one of at least `sure`, each with its score.
    pixels: those of at least `edge`; their level is 255 × the probability."""
    pieces = components(pixels.where(pixels.level >= RIM * highest_near(pixels, RIM_PX)))
    sure = pieces.keep(pieces.holding(pieces.pixels.level >= limits.sure))
    found = components(sure, REACH_PX)
    score = score_of(features(found))
    score[0] = 0.0
    return Candidates(found, score)


def features(found: Components) -> Floats:
    """(n, 5) by label: logit of the strength, the bend and its square, ln of the elongation, 1.

    The bend is ln(short / long) of the axes of inertia: a ruled line of 300 px has −5, a crack −3 to −1, a
    ring 0. Both ends are rarely cracks, hence the square."""
    p = np.clip(strength(found), 1.0 - STRONGEST, STRONGEST)
    bend = _bend(found)
    elongation = np.log(np.maximum(found.elongation, 1.0))
    return np.column_stack([np.log(p / (1.0 - p)), bend, bend**2, elongation, np.ones(len(p))])


def score_of(of_candidates: Floats) -> Floats:
    """(n,) logistic in the (n, 5) features."""
    return np.asarray(1.0 / (1.0 + np.exp(-(of_candidates @ np.asarray(WEIGHTS)))))


def strength(found: Components) -> Floats:
    """Mean probability of each component's surer half, that is along its middle: its rim is never sure."""
    order = np.lexsort((255 - found.pixels.level, found.label))
    labels, values = found.label[order], found.pixels.level[order]
    pixels = np.bincount(labels, minlength=len(found.area_px))
    rank = np.arange(len(labels)) - (np.cumsum(pixels) - pixels)[labels]
    core = rank < (pixels[labels] + 1) // 2
    summed = np.bincount(labels[core], values[core], minlength=len(pixels))
    return np.asarray(summed / np.maximum((pixels + 1) // 2, 1) / 255.0)


def _bend(found: Components) -> Floats:
    """ln of the ratio of the axes of inertia of each component, at most 0."""
    label, count = found.label, np.maximum(found.area_px, 1.0)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(label, values, minlength=len(count)) / count)

    dx, dy = (at - mean(at.astype(np.float64))[label] for at in (found.pixels.x, found.pixels.y))
    xx, yy, xy = mean(dx * dx), mean(dy * dy), mean(dx * dy)
    middle, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    pixel = 1 / 12  # a single pixel's own inertia
    return np.asarray(0.5 * np.log((np.maximum(middle - spread, 0.0) + pixel) / (middle + spread + pixel)))
