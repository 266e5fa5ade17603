"""A crack report against the simulator's truth.

What counts as a crack. The truth lists a crack and each of its branches as parts of their own. Points of a
reported centreline are credited to the nearest part, so it does not matter how a report divides a branching
crack among its entries; a reported `length_mm` is taken as spread evenly over its polyline. Widths and
lengths are judged on the stretch of a part that is at least MEASURABLE_PX wide: what is narrower may be
found or not, and is neither an error nor false.

Where. A report lies in the frame of its own scans and poses: off by decimetres, and scaled by a few per cent
where the vehicle's bias changed its stand-off. So for each true surface one similarity in its plane is
estimated (up to SEARCH_M and SCALES), for position alone: widths and lengths are judged as reported. Then
each reported crack may move by DRIFT_M more (mosaics bend) before it must lie within NEAR_M of the true
centreline. A reported crack with less
than half of its length so credited is false.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.crack import Crack
from schemas.crack_report import CrackReport
from schemas.simulation import CrackScore, FalseCrack, FrameFit, Score, TrueCrack, Truth
from schemas.surface import Surface

Array = npt.NDArray[np.float64]

MEASURABLE_PX = 1.0
WIDE_PX = 3.0
SEARCH_M, DRIFT_M, NEAR_M = 0.6, 0.06, 0.015
SCALES = (1.0, 0.99, 1.01, 0.98, 1.02, 0.97, 1.03, 0.96, 1.04)
OFF_PLANE_M = 0.6
SPACING_M = 0.005
FOUND_SHARE = 0.5
WIDTH_BAR_PX, WIDTH_BAR, LENGTH_BAR, FALSE_BAR_PER_5_M2 = 0.3, 0.10, 0.10, 1.0


@dataclass
class _Reported:
    """A reported crack in the (u, v) of the true surface it lies on."""

    crack: Crack
    uv: Array  # (N, 2), about SPACING_M apart
    length_mm: Array  # (N,) of the crack's length that each point stands for
    part: npt.NDArray[np.intp] | None = None  # (N,) index of the true point credited, −1: none


@dataclass
class _Truth:
    """All true points of one surface."""

    uv: Array  # (M, 2)
    width_mm: Array  # (M,)
    part: npt.NDArray[np.intp]  # (M,) index into `parts`
    parts: tuple[TrueCrack, ...]
    tree: cKDTree


def score(report: CrackReport, truth: Truth) -> Score:
    by_surface = _placed(report, truth)
    gsd = {s.name: s.gsd_mm_px for s in report.surfaces if s.gsd_mm_px}
    cracks: list[CrackScore] = []
    false: list[FalseCrack] = []
    fits: list[FrameFit] = []
    for surface in truth.surfaces:
        reported = by_surface[surface.name]
        known = _truth_of(truth, surface)
        fits.append(_align(surface.name, reported, known))
        gsds = [gsd[r.crack.surface] for r in reported if r.crack.surface in gsd]
        gsd_mm_px = gsds[0] if gsds else truth.gsd_mm_px
        cracks += [_judged(i, known, reported, gsd_mm_px) for i in range(len(known.parts))]
        false += [_false(r, known, truth) for r in reported if _credited(r) < FOUND_SHARE]
    nowhere = [c for c in report.cracks if not any(r.crack is c for rs in by_surface.values() for r in rs)]
    false += [
        FalseCrack(id=c.id, surface=c.surface, length_mm=c.length_mm or 0.0, near="nothing") for c in nowhere
    ]
    inspected_m2 = sum(s.inspected_m2 or 0.0 for s in report.surfaces)
    wide = [c for c in cracks if c.width_px >= WIDE_PX]
    found = [c for c in wide if c.found >= FOUND_SHARE]
    per_5_m2 = 5.0 * len(false) / inspected_m2 if inspected_m2 > 0 else float(len(false))
    measured = [c for c in cracks if c.found >= FOUND_SHARE and c.width_px >= WIDE_PX]
    return Score(
        cracks=tuple(cracks),
        false_cracks=tuple(false),
        inspected_m2=inspected_m2,
        fits=tuple(fits),
        wide_planted=len(wide),
        wide_found=len(found),
        false_per_5_m2=per_5_m2,
        holds=len(found) == len(wide)
        and per_5_m2 <= FALSE_BAR_PER_5_M2
        and all(width_holds(c) and length_holds(c) for c in measured),
    )


def width_holds(crack: CrackScore) -> bool:
    if crack.width_mm is None or crack.width_error_px is None:
        return False
    relative = abs(crack.width_mm / crack.width_true_mm - 1.0)
    return abs(crack.width_error_px) <= WIDTH_BAR_PX or relative <= WIDTH_BAR


def length_holds(crack: CrackScore) -> bool:
    return crack.length_error is not None and abs(crack.length_error) <= LENGTH_BAR


def _placed(report: CrackReport, truth: Truth) -> dict[str, list[_Reported]]:
    """The reported cracks by the true surface whose plane and extent they lie in."""
    placed: dict[str, list[_Reported]] = {s.name: [] for s in truth.surfaces}
    for crack in report.cracks:
        if len(crack.polyline_world_m) < 2:
            continue
        best: tuple[float, Surface, Array] | None = None
        for surface in truth.surfaces:
            uvw = surface.to_surface(crack.polyline_world_m)
            low_u, low_v, high_u, high_v = surface.bounds_m
            middle = uvw.mean(axis=0)
            beyond = max(low_u - middle[0], middle[0] - high_u, low_v - middle[1], middle[1] - high_v, 0.0)
            off = float(np.abs(uvw[:, 2]).mean()) + beyond
            if off < OFF_PLANE_M and (best is None or off < best[0]):
                best = off, surface, uvw[:, :2]
        if best is not None:
            uv, share = _resampled(best[2])
            length_mm = crack.length_mm if crack.length_mm is not None else 1e3 * _length(best[2])
            placed[best[1].name].append(_Reported(crack, uv, length_mm * share))
    return placed


def _truth_of(truth: Truth, surface: Surface) -> _Truth:
    parts = tuple(c for c in truth.cracks if c.surface == surface.name)
    uv = np.vstack([np.zeros((0, 2)), *(np.asarray(c.polyline_uv_m) for c in parts)])
    width = np.concatenate([np.zeros(0), *(np.asarray(c.widths_mm) for c in parts)])
    part = np.repeat(np.arange(len(parts)), [len(c.widths_mm) for c in parts])
    return _Truth(uv, width, part, parts, cKDTree(uv if len(uv) else np.full((1, 2), 1e9)))


def _length(uv: Array) -> float:
    return float(np.linalg.norm(np.diff(uv, axis=0), axis=1).sum())


def _resampled(uv: Array) -> tuple[Array, Array]:
    """(N, 2) points evenly spaced along a polyline, and the share of its length that each stands for."""
    s = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(uv, axis=0), axis=1))]
    count = max(round(s[-1] / SPACING_M), 1)
    at = (np.arange(count) + 0.5) / count * s[-1]
    points = np.column_stack([np.interp(at, s, uv[:, 0]), np.interp(at, s, uv[:, 1])])
    return points, np.full(count, 1.0 / count)


def _align(name: str, reported: list[_Reported], known: _Truth) -> FrameFit:
    """Move the reported points onto the truth and credit each."""
    shift_m, scale = 0.0, 1.0
    if reported and len(known.uv):
        every = np.vstack([r.uv for r in reported])
        middle = every.mean(axis=0)
        first, shift = _coarse(every, middle, known)
        start = middle + first * (every - middle) + shift
        A, t = _refined(start, known, (0.12, 0.06, 0.03, 0.02, 0.015), similarity=True)
        shift_m = float(np.linalg.norm(A @ (middle + shift) + t - middle))
        scale = first * float(np.sqrt(np.linalg.det(A)))
        for one in reported:
            moved = (middle + first * (one.uv - middle) + shift) @ A.T + t
            _, drift = _refined(moved, known, (0.06, 0.03, 0.015), similarity=False)
            one.uv = moved + drift * min(1.0, DRIFT_M / max(float(np.linalg.norm(drift)), 1e-12))
    for one in reported:
        distance, nearest = known.tree.query(one.uv)
        one.part = np.where(distance < NEAR_M, nearest, -1)
    return FrameFit(surface=name, shift_m=round(shift_m, 4), scale=round(scale, 5))


def _coarse(points: Array, middle: Array, known: _Truth) -> tuple[float, Array]:
    """The scale about `middle` and the shift (2,) that most pairs of reported and true points agree on."""
    cell, reach = 0.03, round(SEARCH_M / 0.03)
    best: tuple[float, float, Array] = (-1.0, 1.0, np.zeros(2))
    for scale in SCALES:
        votes = np.zeros((2 * reach + 1, 2 * reach + 1))
        scaled = middle + scale * (points - middle)
        for point in scaled[:: max(len(points) // 1000, 1)]:
            d = np.rint((known.uv - point) / cell).astype(int)
            d = d[(np.abs(d) <= reach).all(axis=1)] + reach
            votes[d[:, 0], d[:, 1]] += 1.0  # once a point, however many true points share the cell
        at = np.unravel_index(int(votes.argmax()), votes.shape)
        if votes.max() > best[0]:
            best = float(votes.max()), scale, (np.asarray(at, dtype=float) - reach) * cell
    return best[1], best[2]


def _refined(
    points: Array, known: _Truth, radii_m: tuple[float, ...], similarity: bool
) -> tuple[Array, Array]:
    """The motion p ↦ A·p + t that brings points to their nearest true points, those too far left out: a
    similarity (Umeyama), or a shift alone."""
    A, t = np.eye(2), np.zeros(2)
    for radius in np.repeat(radii_m, 4):
        moved = points @ A.T + t
        distance, nearest = known.tree.query(moved)
        use = distance < radius
        if use.sum() < 10:
            break
        a, b = moved[use], known.uv[nearest[use]]
        a0, b0 = a.mean(axis=0), b.mean(axis=0)
        step = np.eye(2)
        if similarity:
            da, db = a - a0, b - b0
            dot, cross = float((da * db).sum()), float((da[:, 0] * db[:, 1] - da[:, 1] * db[:, 0]).sum())
            step = np.array([[dot, -cross], [cross, dot]]) / float((da * da).sum())
        A, t = step @ A, step @ (t - a0) + b0
    return A, t


def _credited(one: _Reported) -> float:
    assert one.part is not None
    return float((one.part >= 0).mean())


def _judged(index: int, known: _Truth, reported: list[_Reported], gsd_mm_px: float) -> CrackScore:
    part = known.parts[index]
    mine = np.flatnonzero(known.part == index)
    uv, width = known.uv[mine], known.width_mm[mine]
    measurable = width >= MEASURABLE_PX * gsd_mm_px
    ends = np.linalg.norm(np.diff(uv, axis=0), axis=1)
    own_mm = 1e3 * (np.r_[ends, 0.0] + np.r_[0.0, ends]) / 2  # length that each true point stands for
    length_true = float(own_mm[measurable].sum())
    seen = np.zeros(len(mine), bool)
    length, widths, weights = 0.0, [], []
    for one in reported:
        assert one.part is not None
        credited = np.isin(one.part, mine[measurable])
        length += float(one.length_mm[credited].sum())
        if credited.any():
            hit = np.searchsorted(mine, one.part[credited])
            seen[np.unique(np.clip(np.add.outer(hit, np.arange(-2, 3)), 0, len(mine) - 1))] = True
            if one.crack.width_median_mm is not None and not one.crack.width_is_upper_bound:
                widths.append(one.crack.width_median_mm)
                weights.append(int(credited.sum()))
    seen &= measurable
    found = float(own_mm[seen].sum() / length_true) if length_true > 0 else 0.0
    true_mm = float(np.median(width[seen])) if seen.any() else float(np.median(width))
    measured = float(np.average(widths, weights=weights)) if widths else None
    got = found >= FOUND_SHARE
    return CrackScore(
        id=part.id,
        surface=part.surface,
        width_px=float(np.median(width[measurable]) if measurable.any() else width.max()) / gsd_mm_px,
        width_true_mm=true_mm,
        length_true_mm=length_true,
        found=found,
        length_mm=length,
        width_mm=measured,
        length_error=length / length_true - 1.0 if got else None,
        width_error_px=(measured - true_mm) / gsd_mm_px if got and measured is not None else None,
    )


def _false(one: _Reported, known: _Truth, truth: Truth) -> FalseCrack:
    near: Literal["marker", "crack", "nothing"] = "nothing"
    if len(known.uv) and np.median(known.tree.query(one.uv)[0]) < 4 * NEAR_M:
        near = "crack"
    for marker in truth.markers:
        if np.median(np.linalg.norm(one.uv - marker.centre_uv_m, axis=1)) < marker.radius_m + NEAR_M:
            near = "marker"
    length_mm = float(one.length_mm.sum())
    return FalseCrack(id=one.crack.id, surface=one.crack.surface, length_mm=length_mm, near=near)
