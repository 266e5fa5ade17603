"""From probabilities to cracks: what hangs together is judged as a whole.

A crack starts where the network is sure and goes on while it is fairly sure (hysteresis). Its score is the
probability that a candidate of its strength and length is a crack, fitted on photos and surfaces that the
network had not seen (training.calibrate): so one threshold stands for one rate of false alarms.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tasks.detection.components import Components, components
from tasks.detection.network import Probability

EDGE = 128  # of 255: a pixel belongs to a crack from here on
SURE = 179  # and one of a crack's pixels reaches this
STRENGTH_WEIGHT, LENGTH_WEIGHT, OFFSET = 1.0, 1.0, -4.0
STRONGEST = 254.5 / 255.0  # nothing is surer than its last bit

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


def candidates(probability: Probability) -> Candidates:
    """Connected pixels of at least EDGE that hold one of at least SURE, each with its score."""
    found = components(probability >= EDGE)
    sure = found.holding(probability >= SURE)
    score = np.where(sure, score_of(strength(found, probability), found.extent_px), 0.0)
    score[0] = 0.0
    return Candidates(found, score)


def strength(found: Components, probability: Probability) -> Floats:
    """Mean probability of each component's surer half, that is along its middle: its rim is never sure."""
    inside = found.labels > 0
    labels, values = found.labels[inside], probability[inside].astype(np.int64)
    order = np.lexsort((-values, labels))
    labels, values = labels[order], values[order]
    pixels = np.bincount(labels, minlength=len(found.area_px))
    rank = np.arange(len(labels)) - (np.cumsum(pixels) - pixels)[labels]
    core = rank < (pixels[labels] + 1) // 2
    summed = np.bincount(labels[core], values[core], minlength=len(pixels))
    return np.asarray(summed / np.maximum((pixels + 1) // 2, 1) / 255.0)


def score_of(core: Floats, extent_px: Floats) -> Floats:
    """Logistic in the logit of the strength and in the logarithm of the length."""
    p = np.clip(core, 1.0 - STRONGEST, STRONGEST)
    z = STRENGTH_WEIGHT * np.log(p / (1.0 - p)) + LENGTH_WEIGHT * np.log(np.maximum(extent_px, 1.0)) + OFFSET
    return np.asarray(1.0 / (1.0 + np.exp(-z)))
