"""What becomes of each photo: solved by its matches, placed by its pose, or rejected, and why."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from schemas.photo import BLURRED, Photo, sharpness_shares
from tasks.stitching.pairs import PhotoFeatures
from tasks.stitching.prior import PlaneFrame, Prior
from tasks.stitching.view import Array, View

STRONG = 0.02 / 3  # response of a feature that is no noise
TEXTURED = 200  # strong features that a photo has for sure when it could have been matched
OVERLAP = 0.3  # share of a photo that solved ones must cover, before not matching them speaks against it
FAR_SIGMAS = 5.0  # a solved photo so far from its stated position is worth a word
SURE_SIGMAS = 2.0  # a photo is covered for sure where it is, moved by so many sigma to any side
AROUND = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]], float)
NEAREST = 3  # solved photos whose position errors a placed one borrows

Status = Literal["solved", "placed", "rejected"]


@dataclass(frozen=True)
class Fate:
    status: Status
    reason: str = ""
    view: View | None = None


def unusable(photos: Sequence[Photo], min_sharpness: float | None) -> dict[int, str]:
    """Photos that are not even matched, and why: blurred, clipped, or the same file twice."""
    reasons: dict[int, str] = {}
    shares = sharpness_shares(photos)
    first: dict[str, int] = {}
    for i, photo in enumerate(photos):
        twin = first.setdefault(photo.file.sha256, i)
        blurred = shares[i] < BLURRED if min_sharpness is None else photo.sharpness < min_sharpness
        if twin != i:
            reasons[i] = f"the same picture as {photos[twin].name}"
        elif photo.misexposed:
            reasons[i] = photo.misexposed
        elif blurred and photo.exposure > 0.0:
            share = f"sharpness {photo.sharpness:.3g}, {shares[i]:.0%} of its neighbours' where it is least"
            reasons[i] = f"blurred ({share})"
    return reasons


def fates(
    frame: PlaneFrame,
    solved: dict[int, View],
    features: Sequence[PhotoFeatures],
) -> list[Fate]:
    """One a photo. `solved`: views of those held by their matches."""
    priors, result = frame.priors, []
    for i, prior in enumerate(priors):
        if i in solved:
            result.append(Fate("solved", _far_from_prior(solved[i], prior, frame.sigma_bias), solved[i]))
        elif not prior.has_position:
            what = "the rest of the photos" if solved else "any other photo"
            result.append(Fate("rejected", f"does not match {what}, and its position is not known"))
        else:
            view = _place(prior, priors, solved)
            if view is None:
                result.append(Fate("rejected", "no photo could be matched, and the distance is not known"))
            elif _should_match(view, prior, features[i], solved, features):
                reason = (
                    "shows texture but does not match the photos around its stated position: another place"
                )
                result.append(Fate("rejected", reason))
            else:
                sigma = float(prior.sigma_position[:2].max())
                textured = _strong(features[i]) >= TEXTURED
                why = "no match with another photo holds it" if textured else "too little texture to match"
                reason = f"by its stated position alone (± {sigma:.2f} m): {why}"
                result.append(Fate("placed", reason, view))
    return result


def _far_from_prior(view: View, prior: Prior, sigma_bias: Array) -> str:
    known = np.isfinite(prior.sigma_position)
    sigma = np.hypot(prior.sigma_position, sigma_bias)
    off = np.abs(view.C - prior.view.C)[known] / sigma[known]
    if off.size == 0 or off.max() < FAR_SIGMAS:
        return ""
    metres = float(np.linalg.norm((view.C - prior.view.C)[known]))
    return f"lies {metres:.2f} m from its stated position"


def _place(prior: Prior, priors: Sequence[Prior], solved: dict[int, View]) -> View | None:
    """The prior, moved as the nearest solved photos moved from theirs: position errors walk slowly."""
    view = prior.view
    if not solved:
        return view if np.isfinite(prior.sigma_position[2]) else None
    known = [k for k in solved if priors[k].has_position]
    if not known:
        return None
    distance = [float(np.linalg.norm(priors[k].view.C[:2] - view.C[:2])) for k in known]
    near = [known[k] for k in np.argsort(distance, kind="stable")[:NEAREST]]
    moved = np.mean([solved[k].C - priors[k].view.C for k in near], axis=0)
    C = view.C + moved
    if not np.isfinite(prior.sigma_position[2]):
        C[2] = float(np.median([solved[k].C[2] for k in near]))
    same = [
        v.camera for k, v in solved.items() if priors[k].view.camera.model_dump() == view.camera.model_dump()
    ]
    relief = solved[near[0]].relief
    return replace(view, C=C, camera=same[0] if same else view.camera, relief=relief)


def elsewhere(
    component: npt.NDArray[np.int64],
    held: set[int],
    views: Sequence[View],
    frame: PlaneFrame,
    features: Sequence[PhotoFeatures],
) -> set[int]:
    """Photos of connected groups that lie where a larger group lies, yet match none of it: another place."""
    strangers: set[int] = set()
    for number in range(1, int(component.max(initial=-1)) + 1):
        members = [i for i in sorted(held) if component[i] == number]
        others = {i: views[i] for i in held if component[i] < number and i not in strangers}
        if members and all(
            _should_match(views[i], frame.priors[i], features[i], others, features) for i in members
        ):
            strangers |= set(members)
    return strangers


def _should_match(
    view: View,
    prior: Prior,
    own: PhotoFeatures,
    solved: dict[int, View],
    features: Sequence[PhotoFeatures],
) -> bool:
    """Both it and the solved photos that cover it, wherever it lies within its position's error, have
    texture: then not matching means another place."""
    if not solved or _strong(own) < TEXTURED:
        return False
    if float(np.median([_strong(features[k]) for k in solved])) < TEXTURED:
        return False
    w, h = view.camera.width_px - 1.0, view.camera.height_px - 1.0
    x, y = np.meshgrid(np.linspace(0, w, 12), np.linspace(0, h, 9))
    uv = view.to_plane(np.column_stack([x.ravel(), y.ravel()]))
    sure = np.ones(len(uv), bool)
    for shift in SURE_SIGMAS * float(prior.sigma_position[:2].max()) * AROUND:
        covered = np.zeros(len(uv), bool)
        for other in solved.values():
            covered |= _inside(other, uv + shift)
        sure &= covered
    return float(sure.mean()) > OVERLAP


def _inside(view: View, uv: Array) -> Array:
    px = view.to_undistorted(uv)
    size = np.array([view.camera.width_px - 1, view.camera.height_px - 1])
    with np.errstate(invalid="ignore"):
        return np.asarray(((px >= 0) & (px <= size)).all(axis=1))


def _strong(features: PhotoFeatures) -> int:
    return int((features.response > STRONG).sum())
