"""Formwork joints, panel seams, cables and edges: dark lines as well, but straight. Cracks wander.

A straight run is looked for in each component (by a Hough vote, then least squares), so that a crack that
meets a joint stays. Short straight pieces count as a joint where they lie on one line that is long enough.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tasks.connected import Marked
from tasks.detection.components import components

STRAIGHT_PX = 1.0  # largest RMS offset of a joint's centreline from a line: mosaics bend less than that
VOTE_PX = 4.0  # width of a cell of the Hough vote
DIRECTIONS = np.arange(0.0, np.pi, np.radians(0.5))
STEP_PX = 8.0  # the centreline is looked at in steps of this length
FILLED = 0.6  # least share of a joint's length that is dark
SAMPLED = 2000  # pixels that vote

Points = npt.NDArray[np.float64]  # (N, 2) x, y


class Run(NamedTuple):
    """A straight run of dark pixels: which of a component's points, from where to where."""

    inside: npt.NDArray[np.bool_]
    start: npt.NDArray[np.float64]  # (2,)
    end: npt.NDArray[np.float64]

    @property
    def length_px(self) -> float:
        return float(np.hypot(*(self.end - self.start)))


class Joint(NamedTuple):
    position_px: tuple[float, float]
    length_px: float


def without_joints(pixels: Marked, joint_px: float, piece_px: float) -> tuple[Marked, list[Joint]]:
    """`pixels` less the straight lines of at least `joint_px`; pieces of them of at least `piece_px`."""
    found = components(pixels)
    order = np.argsort(found.label, kind="stable")
    ends = np.cumsum(found.area_px).astype(np.intp)
    runs: list[tuple[Run, npt.NDArray[np.intp]]] = []
    for label in np.flatnonzero(found.extent_px[1:] >= piece_px) + 1:
        index = order[ends[label - 1] : ends[label]]
        while len(index) >= piece_px:
            at = np.column_stack([pixels.x[index], pixels.y[index]]).astype(np.float64)
            run = straight_run(at, piece_px)
            if run is None:
                break
            runs.append((run, index[run.inside]))
            index = index[~run.inside]
    joints, left = [], np.ones(len(pixels.y), dtype=bool)
    for group in _on_one_line([run for run, _ in runs]):
        length = sum(runs[i][0].length_px for i in group)
        if length < joint_px:
            continue
        for i in group:
            left[runs[i][1]] = False
        longest = max((runs[i][0] for i in group), key=lambda run: run.length_px)
        middle = (longest.start + longest.end) / 2
        joints.append(Joint((float(middle[0]), float(middle[1])), length))
    return pixels.where(left), joints


def straight_run(points: Points, least_px: float) -> Run | None:
    """The longest straight run among a component's pixels, or None where none reaches `least_px`."""
    line = _vote(points)
    reach = 2.0 * VOTE_PX
    for _ in range(3):
        centre, direction = line
        along, across = _along_across(points, centre, direction)
        near = np.abs(across) <= reach
        if near.sum() < 2:
            return None
        line = _fit(points[near])
    centre, direction = line
    along, across = _along_across(points, centre, direction)
    near = np.abs(across) <= reach
    steps, where = np.unique(np.floor(along[near] / STEP_PX).astype(int), return_inverse=True)
    pixels = np.bincount(where)
    offset = np.bincount(where, across[near]) / pixels
    thickness = float(np.median(pixels)) / STEP_PX
    wandered = np.abs(offset) > max(2.0 * STRAIGHT_PX, 0.25 * thickness)
    first, last = _longest_stretch(steps, ~wandered)
    chosen = slice(first, last + 1)
    length = (steps[last] - steps[first] + 1) * STEP_PX
    if last - first < 2 or length < least_px:
        return None
    if float(np.sqrt(np.mean(offset[chosen] ** 2))) > STRAIGHT_PX or thickness > 1.5 * reach:
        return None
    lowest, highest = steps[first] * STEP_PX, (steps[last] + 1) * STEP_PX
    half = thickness / 2 + 2.0
    inside = (np.abs(across) <= half) & (along >= lowest) & (along <= highest)
    if not inside.any():
        return None
    return Run(inside, centre + lowest * direction, centre + highest * direction)


def _vote(points: Points) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Centre and direction of the line that most pixels lie on."""
    some = points
    if len(points) > SAMPLED:  # drawn: every so many-th would beat with the pattern of a wall
        some = points[np.random.default_rng(0).choice(len(points), SAMPLED, replace=False)]
    origin = some.mean(axis=0)
    across = (some - origin) @ np.vstack([-np.sin(DIRECTIONS), np.cos(DIRECTIONS)])
    cells = np.rint(across / VOTE_PX).astype(int)
    low, wide = int(cells.min()), int(np.ptp(cells)) + 1
    votes = np.bincount(((cells - low) + np.arange(len(DIRECTIONS)) * wide).ravel())
    best, cell = divmod(int(votes.argmax()), wide)
    direction = np.array([np.cos(DIRECTIONS[best]), np.sin(DIRECTIONS[best])])
    normal = np.array([-direction[1], direction[0]])
    return origin + (cell + low) * VOTE_PX * normal, direction


def _fit(points: Points) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Centre and direction of the line with the least squared distances."""
    centre = points.mean(axis=0)
    x, y = (points - centre).T
    angle = np.arctan2(2.0 * (x * y).mean(), (x * x).mean() - (y * y).mean()) / 2.0
    return centre, np.array([np.cos(angle), np.sin(angle)])


def _along_across(
    points: Points, centre: npt.NDArray[np.float64], direction: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    offset = points - centre
    return offset @ direction, offset @ np.array([-direction[1], direction[0]])


def _longest_stretch(steps: npt.NDArray[np.intp], straight: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """First and last index of the longest stretch of straight steps with few of them missing."""
    best, start = (0, 0), 0
    for i in range(len(steps)):
        if not straight[i] or (i > start and steps[i] - steps[i - 1] > 3):
            start = i if straight[i] else i + 1
        elif steps[i] - steps[start] > steps[best[1]] - steps[best[0]]:
            best = (start, i)
    return best


def _on_one_line(runs: list[Run]) -> list[list[int]]:
    """Runs grouped by the line they lie on, where they fill enough of it; the longest first."""
    groups: list[list[int]] = []
    size = np.array([run.length_px for run in runs])
    ends = np.array([(run.start, run.end) for run in runs]).reshape(-1, 2, 2)
    left = np.argsort(-size, kind="stable")
    while len(left):
        group, left = [int(left[0])], left[1:]
        while len(left):
            fits = _continue(size[group].sum(), *_span(runs, group), size[left], ends[left])
            if not fits.any():
                break
            first = int(fits.argmax())
            group.append(int(left[first]))
            left = np.delete(left, first)
        groups.append(group)
    return groups


def _span(runs: list[Run], group: list[int]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    ends = np.array([point for i in group for point in (runs[i].start, runs[i].end)])
    direction = runs[group[0]].end - runs[group[0]].start
    along = ends @ direction
    return ends[along.argmin()], ends[along.argmax()]


def _continue(
    dark_px: float,
    start: npt.NDArray[np.float64],
    end: npt.NDArray[np.float64],
    size: npt.NDArray[np.float64],
    ends: npt.NDArray[np.float64],
) -> npt.NDArray[np.bool_]:
    """(n,) which runs, (n,) long with (n, 2, 2) ends, lie on the line start–end, of which so much is dark,
    near enough that it stays filled."""
    length = float(np.hypot(*(end - start)))
    x, y = (end - start) / length
    along = (ends - start) @ np.array([x, y])
    across = np.abs((ends - start) @ np.array([-y, x])).max(axis=1)
    beyond = np.maximum(0.0, np.maximum(-along.max(axis=1), along.min(axis=1) - length))
    total = np.maximum(length, along.max(axis=1)) - np.minimum(0.0, along.min(axis=1))
    near = across <= 3.0 * STRAIGHT_PX + 0.01 * beyond
    return np.asarray(near & (dark_px + size >= FILLED * total))
