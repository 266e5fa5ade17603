"""The site's datum: where surveyed control targets put the model, and what the check points say of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from schemas.problem import BadInput, LeftOut
from schemas.target import SiteTarget, TargetResidual
from tasks.registration.load_stations import STAGE
from tasks.registration.rigid_motion import Array, fit, transform
from tasks.registration.world_frame import fit_yaw

AGREE_M = 0.05  # a sighting that misses by more is not of the point that it names
STRAIGHT_M = 0.5  # targets nearer than this to one line fix no turn about it


@dataclass(frozen=True)
class Sighting:
    """A surveyed target as one station saw it."""

    target: SiteTarget
    station: str
    frame_m: Array  # (3,) in the frame of the registered stations


def tie_to_datum(sightings: Sequence[Sighting]) -> Array | None:
    """(4, 4) T_datum_frame that brings the control targets to their surveyed places; None without control.

    Of the motions by three targets each (by two, turning about z alone, where all lie on a line), that on
    which most sightings agree, fitted to these by least squares without a change of scale. Check points have
    no say. Raises BadInput where control is given and does not fix the motion.
    """
    control = [s for s in sightings if not s.target.check]
    if not control:
        return None
    names = sorted({s.target.name for s in control})
    frame_m = np.array([np.median([s.frame_m for s in control if s.target.name == n], axis=0) for n in names])
    datum_m = np.array([next(s.target.position_m for s in control if s.target.name == n) for n in names])
    level = _straight(datum_m)
    all_frame_m = np.array([s.frame_m for s in control])
    all_datum_m = np.array([s.target.position_m for s in control])
    best: Array | None = None
    most = (0, 0.0)
    for T in _hypotheses(frame_m, datum_m, level):
        missed_m = np.linalg.norm(transform(T, frame_m) - datum_m, axis=1)
        agree = missed_m < AGREE_M
        votes = int(agree.sum()), -float(missed_m[agree].sum())
        if best is None or votes > most:
            best, most = T, votes
    least = 2 if level else 3
    if best is None or most[0] < least or 2 * most[0] <= len(names):
        raise BadInput(
            "targets",
            f"the {len(names)} control targets that are seen ({', '.join(names)}) do not fix where the "
            f"site's datum lies: {most[0]} of them agree to {1000 * AGREE_M:g} mm",
            "Give at least three that are not in line, and compare their names and coordinates.",
        )
    for _ in range(2):
        agree = np.linalg.norm(transform(best, all_frame_m) - all_datum_m, axis=1) < AGREE_M
        fitted = _fitted(all_frame_m[agree], all_datum_m[agree], level)
        best = best if fitted is None else fitted
    return best


def residuals(sightings: Sequence[Sighting], T_datum_frame: Array) -> tuple[TargetResidual, ...]:
    """What each sighting misses its surveyed place by, control first."""
    found = []
    for s in sorted(sightings, key=lambda s: (s.target.check, s.target.name, s.station)):
        off = transform(T_datum_frame, s.frame_m[None])[0] - s.target.position_m
        found.append(
            TargetResidual(
                name=s.target.name,
                station=s.station,
                check=s.target.check,
                used=not s.target.check and bool(np.linalg.norm(off) < AGREE_M),
                residual_m=(float(off[0]), float(off[1]), float(off[2])),
            )
        )
    return tuple(found)


def unused(
    found: Sequence[TargetResidual], given: Sequence[SiteTarget], seen: Sequence[tuple[str, str]]
) -> list[LeftOut]:
    """Targets that say nothing: never seen, without coordinates, or contradicted by the rest.

    seen: (station, target) of every sighting that the scans state.
    """
    known = {target.name for target in given}
    left = [
        LeftOut(
            item=f"target {name}",
            stage=STAGE,
            what="no registered scan says where it saw it",
            remedy="Add it to the targets of a scan, or take it off the list.",
        )
        for name in sorted(known - {name for _, name in seen})
    ]
    left += [
        LeftOut(
            item=f"target {name} in {station}",
            stage=STAGE,
            what="its place on the site is not given",
            remedy="Add it to the inspection's targets, or correct its name.",
        )
        for station, name in seen
        if name not in known
    ]
    left += [
        LeftOut(
            item=f"target {one.name} in {one.station}",
            stage=STAGE,
            what=f"it misses its surveyed place by {_length_mm(one):.0f} mm, so it is not fitted to",
            remedy="Compare its name and coordinates.",
        )
        for one in found
        if not one.check and not one.used
    ]
    return left


def _length_mm(one: TargetResidual) -> float:
    return 1000 * float(np.linalg.norm(one.residual_m))


def _hypotheses(frame_m: Array, datum_m: Array, level: bool) -> Iterator[Array]:
    for chosen in combinations(range(len(frame_m)), 2 if level else 3):
        at = list(chosen)
        T = _fitted(frame_m[at], datum_m[at], level)
        if T is not None and (level or not _straight(datum_m[at])):
            yield T


def _fitted(frame_m: Array, datum_m: Array, level: bool) -> Array | None:
    return fit_yaw(frame_m, datum_m) if level else fit(frame_m, datum_m)


def _straight(points_m: Array) -> bool:
    """Whether all lie on one line, or nearly."""
    offset_m = points_m - points_m.mean(axis=0)
    across_m = np.linalg.svd(offset_m, compute_uv=False)[1:2] if len(points_m) > 2 else np.zeros(1)
    return bool(across_m.max(initial=0.0) < STRAIGHT_M)
