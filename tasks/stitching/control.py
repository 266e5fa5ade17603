"""The gauge: a plane-induced bundle leaves a similarity free, which targets or scale bars fix.

Targets: the similarity with the least squares over those that agree (all pairs are tried, the one with the
least median residual tells which agree: Rousseeuw 1984). Scale bars: one factor. Check points never enter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from schemas.control import Control, ControlResidual, PlaneTarget, ScaleBar
from schemas.problem import BadInput, LeftOut
from tasks.stitching.view import Array, View

JUDGED = 4  # control targets from which on one that contradicts the others can be told
CONTRADICTS = 5.0  # robust sigmas
LEAST_SIGMA_PX = 2.0  # a mark is clicked, and placed on a surface, no better than this
MIRRORED = 0.1  # residuals of the mirrored targets, as a share of those as given

Sightings = Mapping[str, Mapping[int, Array]]  # mark → photo → (2,) pixel of the photo as taken


@dataclass(frozen=True)
class Gauge:
    """q → scale · rotation(angle) · q + shift of the plane, to metres."""

    scale: float
    angle_rad: float
    shift: Array  # (2,)
    scale_from: str  # "targets", "scale bars", "stated GSD"
    used: frozenset[str] = frozenset()  # names of the targets or bars that fixed it

    @property
    def motion(self) -> tuple[float, float, Array]:
        return self.scale, self.angle_rad, self.shift


@dataclass(frozen=True)
class Mark:
    """Where the mosaic has a mark."""

    uv: Array  # (2,) median of the photos that show it
    each: Array  # (K, 2) one a photo


def placed_marks(sightings: Sightings, views: Mapping[int, View]) -> dict[str, Mark]:
    """Marks that solved photos show, on the plane."""
    marks = {}
    for name, seen in sightings.items():
        at = [_on_plane(views[i], pixel) for i, pixel in seen.items() if i in views]
        each = np.array([uv for uv in at if np.isfinite(uv).all()]).reshape(-1, 2)
        if len(each):
            marks[name] = Mark(np.median(each, axis=0), each)
    return marks


def _on_plane(view: View, pixel: Array) -> Array:
    """(2,) of a (2,) pixel as taken."""
    camera = view.camera
    ideal = camera.undistort((pixel[None] - camera.principal_px) / camera.focal_px)
    return np.asarray(view.to_plane(ideal * camera.focal_px + camera.principal_px)[0])


def fix_gauge(
    name: str,
    control: Control,
    marks: Mapping[str, Mark],
    units_per_px: float,
    views: Sequence[View],
) -> Gauge | None:
    """None where fewer than two control targets and no control bar are seen. A bar scales about the middle
    of the views: their place, where poses tell one, stays.

    Raises BadInput where the targets are mirrored."""
    targets = [t for t in control.targets if not t.check and t.mark in marks]
    if len(targets) >= 2:
        return _from_targets(name, targets, marks, units_per_px)
    bars = [b for b in control.scale_bars if not b.check and all(end in marks for end in b.ends)]
    measured = np.array([_length(b, marks) for b in bars])
    if not measured.any():
        return None
    stated = np.array([b.length_mm / 1000.0 for b in bars])
    scale = float(measured @ stated / (measured @ measured))
    middle = np.mean([view.C[:2] for view in views], axis=0)
    return Gauge(scale, 0.0, (1.0 - scale) * middle, "scale bars", frozenset(b.name for b in bars))


def _from_targets(
    name: str, targets: Sequence[PlaneTarget], marks: Mapping[str, Mark], units_per_px: float
) -> Gauge:
    z = np.array([marks[t.mark].uv for t in targets]) @ [1, 1j]
    w = np.array([t.uv_m for t in targets]) @ [1, 1j]
    if np.ptp(np.abs(z - z[0])) == 0.0 or np.ptp(np.abs(w - w[0])) == 0.0:
        raise BadInput(name, "all its targets lie in one place", "Give two or more that lie far apart")
    good = _agreeing(z, w, units_per_px)
    factor, shift = _similarity(z[good], w[good])
    if len(targets) > 2:
        off = np.linalg.norm(factor * z + shift - w)
        mirrored, moved = _similarity(z.conj(), w)
        if np.linalg.norm(mirrored * z.conj() + moved - w) < MIRRORED * off:
            raise BadInput(
                name,
                "its targets fit only mirrored",
                "Give uv_m as [to the right, up], seen from the side that was photographed",
            )
    return Gauge(
        scale=abs(factor),
        angle_rad=float(np.angle(factor)),
        shift=np.array([shift.real, shift.imag]),
        scale_from="targets",
        used=frozenset(t.mark for t, is_good in zip(targets, good, strict=True) if is_good),
    )


def _agreeing(z: Array, w: Array, units_per_px: float) -> Array:
    """(N,) bool: those within a few robust sigmas of the similarity through the best two."""
    every = np.ones(len(z), bool)
    if len(z) < JUDGED:
        return every
    best, least = every, np.inf
    for a, b in combinations(range(len(z)), 2):
        if z[a] == z[b] or w[a] == w[b]:
            continue
        factor, shift = _similarity(z[[a, b]], w[[a, b]])
        off = np.abs(factor * z + shift - w)
        median = float(np.median(np.delete(off, [a, b])))
        if median < least:
            sigma = max(median / 1.1774, LEAST_SIGMA_PX * units_per_px * abs(factor))
            best, least = off < CONTRADICTS * sigma, median
    return best if 2 * best.sum() > len(z) else every


def _similarity(z: Array, w: Array) -> tuple[complex, complex]:
    """w = factor · z + shift, least squares."""
    middle_z, middle_w = z.mean(), w.mean()
    off = z - middle_z
    factor = np.sum(off.conj() * (w - middle_w)) / np.sum(np.abs(off) ** 2)
    return complex(factor), complex(middle_w - factor * middle_z)


def _length(bar: ScaleBar, marks: Mapping[str, Mark]) -> float:
    a, b = (marks[end].uv for end in bar.ends)
    return float(np.linalg.norm(a - b))


def judged(
    control: Control, marks: Mapping[str, Mark], gauge: Gauge | None, on_surface: bool, metric: bool
) -> tuple[tuple[ControlResidual, ...], tuple[LeftOut, ...]]:
    """Residuals of all targets and bars that are seen, and what could not be used; `marks` in metres, under
    the gauge. Targets have residuals where the mosaic is in their frame: by themselves, or because it lies on
    a surface (on_surface); bars where it has any scale (metric)."""
    residuals, missing = [], []
    used = gauge.used if gauge else frozenset()
    by_targets = gauge is not None and gauge.scale_from == "targets"
    for target in control.targets:
        if target.mark not in marks:
            missing.append(_unseen(f"target {target.mark}", [target.mark]))
            continue
        if not target.check and not (by_targets and target.mark in used):
            missing.append(_not_used(target.mark, by_targets))
        if by_targets or on_surface:
            mark = marks[target.mark]
            u, v = (float(x) for x in (mark.uv - target.uv_m) * 1000.0)
            residuals.append(
                ControlResidual(
                    name=target.mark,
                    kind="target",
                    check=target.check,
                    used=by_targets and target.mark in used,
                    photos=len(mark.each),
                    residual_mm=(u, v),
                    spread_mm=_spread_mm(mark),
                )
            )
    for bar in control.scale_bars:
        unseen = [end for end in bar.ends if end not in marks]
        if unseen:
            missing.append(_unseen(f"scale bar {bar.name}", unseen))
        elif metric:
            ends = [marks[end] for end in bar.ends]
            residuals.append(
                ControlResidual(
                    name=bar.name,
                    kind="scale bar",
                    check=bar.check,
                    used=not by_targets and bar.name in used,
                    photos=min(len(end.each) for end in ends),
                    residual_mm=_length(bar, marks) * 1000.0 - bar.length_mm,
                    spread_mm=max(_spread_mm(end) for end in ends),
                )
            )
    return tuple(residuals), tuple(missing)


def _unseen(item: str, marks: Sequence[str]) -> LeftOut:
    return LeftOut(
        item=item,
        stage="stitching",
        what=f"no solved photo shows {' and '.join(marks)}",
        remedy="Check the photos that show it, and the family of the tags",
    )


def _not_used(mark: str, by_targets: bool) -> LeftOut:
    if by_targets:
        what, remedy = (
            "contradicts the other targets",
            "Check its name, its place and the pixels it is said to be at",
        )
    else:
        what, remedy = (
            "fewer than two control targets were seen: they fix no frame",
            "Give two or more that solved photos show, without check: true",
        )
    return LeftOut(item=f"target {mark}", stage="stitching", what=what, remedy=remedy)


def _spread_mm(mark: Mark) -> float:
    return float(np.linalg.norm(mark.each - mark.uv, axis=1).max()) * 1000.0
