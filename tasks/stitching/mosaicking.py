"""Photos of one surface become one metric mosaic (paper, section 3.1, after Brown & Lowe 2007)."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from schemas.control import Control, ControlResidual
from schemas.photo import Photo
from schemas.problem import BadInput, LeftOut
from schemas.settings import StitchSettings
from schemas.surface import Surface
from tasks.stitching.canvas import Canvas, lay_out
from tasks.stitching.compositing import Pixels, Tile, composite
from tasks.stitching.control import Gauge, Sightings, fix_gauge, judged, placed_marks
from tasks.stitching.gain import solve_light
from tasks.stitching.nadir import borne_out
from tasks.stitching.pairs import PhotoFeatures
from tasks.stitching.placement import Fate, fates, unusable
from tasks.stitching.prior import PlaneFrame, placeless, plane_frame
from tasks.stitching.relief import HeightMap
from tasks.stitching.seams import darkness
from tasks.stitching.solution import Solved, neighbours, solve
from tasks.stitching.strangers import strangers
from tasks.stitching.view import Array

NOTHING: Sightings = {}
WRONG, DOUBTED = 1.5, 4.0  # a stated scale is in doubt from this factor and so many sigma of GPS's on
PLACED_WORTH = 1e-3  # a photo placed by its pose alone fills only what no solved photo shows


@dataclass(frozen=True)
class Registered:
    """Where every photo lies, and on what canvas."""

    photos: tuple[Photo, ...]
    fates: tuple[Fate, ...]  # one a photo
    solved: Solved  # indexed as `photos`
    canvas: Canvas
    surface: Surface | None  # whose frame the canvas is in
    scale_from: str
    pairs: tuple[tuple[int, int], ...]  # neighbours among the photos that are in the mosaic
    control: tuple[ControlResidual, ...] = ()
    left_out: tuple[LeftOut, ...] = ()  # of control and positions: what was not used

    @property
    def shown(self) -> list[int]:
        return [i for i, fate in enumerate(self.fates) if fate.view is not None]


def register_photos(
    name: str,
    surface: Surface | None,
    photos: Sequence[Photo],
    features: Sequence[PhotoFeatures],
    settings: StitchSettings,
    on_progress: Callable[[float], None],
    control: Control | None = None,
    sightings: Sightings = NOTHING,
    relief: HeightMap | None = None,
) -> Registered:
    """Raises BadInput where no photo finds a place. sightings: where the photos show control's marks;
    relief: of the surface, which counts where the photos have poses in its frame."""
    bad = unusable(photos, settings.min_sharpness)
    good = [i for i in range(len(photos)) if i not in bad]
    kept, kept_features = [photos[i] for i in good], [features[i] for i in good]
    away_m = strangers(kept)
    kept = [
        p.model_copy(update={"pose": None, "gps": None}) if i in away_m else p for i, p in enumerate(kept)
    ]
    frame, pairs, solved = _solved(kept, kept_features, surface, settings, on_progress, relief)
    found = fates(frame, solved.views, kept_features)
    if len(kept) == 1 and found[0].view is None:
        found = [
            Fate("placed", "the only photo: taken to look squarely at the surface", frame.priors[0].view)
        ]
    every = [Fate("rejected", bad.get(i, "")) for i in range(len(photos))]
    for i, fate in zip(good, found, strict=True):
        every[i] = fate
    if all(fate.view is None for fate in every):
        raise BadInput(
            name,
            f"none of its {len(photos)} photos finds a place ({photos[0].name}: {every[0].reason})",
            "Give photos that overlap by a third or more, or their poses",
        )
    solved, scale_from = _reindexed(solved, good), frame.scale_from
    marks = placed_marks(sightings, solved.views)
    views = [fate.view for fate in every if fate.view is not None]
    usual_gsd = float(np.median([view.units_per_px for view in views]))
    gauge = fix_gauge(name, control, marks, usual_gsd, views) if control else None
    if gauge is None and frame.surface is None and settings.gsd_mm_px is not None:
        gauge = Gauge(settings.gsd_mm_px / 1000.0 / usual_gsd, 0.0, np.zeros(2), "stated GSD")
    doubts = () if gauge is None else _contradicted(name, gauge, frame.scale_from, solved, usual_gsd)
    if gauge is not None:
        solved = _gauged(solved, gauge)
        every = [_moved(fate, gauge, solved.relief) for fate in every]
        marks, scale_from = placed_marks(sightings, solved.views), gauge.scale_from
    residuals, left_out = (
        ((), ())
        if control is None
        else judged(control, marks, gauge, frame.surface is not None, scale_from != "none")
    )
    gsd = None if settings.gsd_mm_px is None else settings.gsd_mm_px / 1000.0
    canvas = lay_out(name, [f.view for f in every if f.view is not None], frame.surface, gsd)
    among = tuple((good[a], good[b]) for a, b in pairs if every[good[a]].view and every[good[b]].view)
    return Registered(
        tuple(photos),
        tuple(every),
        solved,
        canvas,
        frame.surface,
        scale_from,
        among,
        residuals,
        (
            *left_out,
            *doubts,
            *(_misplaced(kept[i].name, metres) for i, metres in away_m.items()),
            *((_untold(name),) if scale_from == "none" and any(p.gps for p in kept) else ()),
        ),
    )


class _Solution(NamedTuple):
    frame: PlaneFrame
    pairs: list[tuple[int, int]]
    solved: Solved


def _solved(
    photos: Sequence[Photo],
    features: Sequence[PhotoFeatures],
    surface: Surface | None,
    settings: StitchSettings,
    on_progress: Callable[[float], None],
    relief: HeightMap | None,
) -> _Solution:
    """By what is known of their positions; without, where these are not borne out or lead to nothing."""

    def in_frame(frame: PlaneFrame, relief: HeightMap | None) -> _Solution:
        pairs, sigmas = neighbours(features, frame), [photo.focal_sigma for photo in photos]
        solved = solve(features, frame, sigmas, pairs, settings.ransac_px, on_progress, relief)
        return _Solution(frame, pairs, solved)

    frame = plane_frame(photos, surface)
    first = in_frame(frame, None if frame.surface is None else relief)
    if frame.surface is not None or frame.scale_from == "none":
        return first
    wrong = frame.view_guessed and not borne_out(frame.priors, first.solved.views, first.solved.sigma_scale)
    if first.solved.views and not wrong:
        return first
    blind = in_frame(placeless(photos), None)
    return blind if blind.solved.views or wrong else first


def _misplaced(name: str, metres: float) -> LeftOut:
    away = f"{metres / 1000:.4g} km" if metres >= 1000 else f"{metres:.0f} m"
    what = f"its stated position lies {away} from those of all other photos: it was not used"
    return LeftOut(item=name, stage="stitch", what=what, remedy="Check the position in the photo's header")


def _untold(name: str) -> LeftOut:
    what = "its scale is not known: the photos' GPS positions do not fit what they show, or do not tell it"
    return LeftOut(
        item=name, stage="stitch", what=what, remedy="Give targets, a scale bar, poses or gsd_mm_px"
    )


def _contradicted(
    name: str, gauge: Gauge, known_from: str, solved: Solved, usual_gsd_m: float
) -> tuple[LeftOut, ...]:
    """A word where the scale that somebody stated is quite another than the one that positions tell."""
    sigma = solved.sigma_scale
    if known_from == "none" or not np.isfinite(sigma):
        return ()
    if abs(np.log(gauge.scale)) < max(np.log(WRONG), DOUBTED * sigma):
        return ()
    told, stated = 1000.0 * usual_gsd_m, 1000.0 * gauge.scale * usual_gsd_m
    by_positions = f"{told:.3g} (± {100 * sigma:.2g} %) by {known_from}"
    what = f"its scale is {stated:.3g} mm/px by {gauge.scale_from}, {by_positions}"
    remedy = "One of them is wrong: every length and width hangs on it"
    return (LeftOut(item=name, stage="stitch", what=what, remedy=remedy),)


def blend_photos(
    registered: Registered, read: Callable[[int], Pixels], on_progress: Callable[[float], None]
) -> tuple[Array, Iterator[Tile]]:
    """Gains of all photos (1 where not shown) and the tiles. `read(i)`: RGB of photo i."""
    shown = registered.shown
    position = {i: k for k, i in enumerate(shown)}
    views = [view for i in shown if (view := registered.fates[i].view) is not None]
    pairs = [(position[a], position[b]) for a, b in registered.pairs]
    dark: list[npt.NDArray[np.float32]] = []

    def read_once(k: int) -> Pixels:
        pixels = read(shown[k])
        dark.append(darkness(pixels))
        return pixels

    light = solve_light(
        views,
        read_once,
        pairs,
        [registered.photos[i].metered_ev for i in shown],
        lambda f: on_progress(0.3 * f),
    )
    every = np.ones(len(registered.photos))
    every[shown] = light.gains[:, 1]
    tiles = composite(
        registered.canvas,
        views,
        [_worth(registered, i) for i in shown],
        light,
        dark,
        lambda k: read(shown[k]),
        lambda f: on_progress(0.3 + 0.7 * f),
    )
    return every, (replace(tile, source=_renumbered(tile.source, shown)) for tile in tiles)


def _worth(registered: Registered, index: int) -> float:
    """Sharp photos before blurred ones, solved before placed."""
    median = float(np.median([registered.photos[i].sharpness for i in registered.shown]))
    sharp = min(1.0, registered.photos[index].sharpness / median) if median > 0 else 1.0
    return sharp if registered.fates[index].status == "solved" else PLACED_WORTH


def _renumbered(source: npt.NDArray[np.uint16], shown: Sequence[int]) -> npt.NDArray[np.uint16]:
    return np.array([0, *(i + 1 for i in shown)], np.uint16)[source]


def _moved(fate: Fate, gauge: Gauge, relief: HeightMap | None) -> Fate:
    if fate.view is None:
        return fate
    return replace(fate, view=replace(fate.view.moved(*gauge.motion), relief=relief))


def _gauged(solved: Solved, gauge: Gauge) -> Solved:
    c, s = np.cos(gauge.angle_rad), np.sin(gauge.angle_rad)
    J = gauge.scale * np.array([[c, -s], [s, c]])
    relief, sigma = solved.relief, solved.relief_sigma
    if relief is not None and sigma is not None:  # the photos' own: a scan's lies where it lies
        relief, sigma = relief.moved(*gauge.motion), sigma.moved(*gauge.motion)
    return replace(
        solved,
        views={i: replace(view.moved(*gauge.motion), relief=relief) for i, view in solved.views.items()},
        covariance={i: J @ two @ J.T for i, two in solved.covariance.items()},
        relief=relief,
        relief_sigma=sigma,
    )


def _reindexed(solved: Solved, good: Sequence[int]) -> Solved:
    return replace(
        solved,
        views={good[i]: view for i, view in solved.views.items()},
        matches={good[i]: count for i, count in solved.matches.items()},
        rms_px={good[i]: rms for i, rms in solved.rms_px.items()},
        covariance={good[i]: two for i, two in solved.covariance.items()},
        edges=tuple(replace(edge, a=good[edge.a], b=good[edge.b]) for edge in solved.edges),
        held=frozenset((good[a], good[b]) for a, b in solved.held),
    )
