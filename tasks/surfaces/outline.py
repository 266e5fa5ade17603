"""The outline of points on a plane: concave, with holes (the convex hull is the paper's).

The outline is the α-hull: whatever no empty disc of radius r can reach, with r by the local density of the
samples. On a raster that is a closing, and the distance to what the discs sweep gives its contour to a
fraction of a pixel. Parts that a disc can separate are different surfaces.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage
from skimage.measure import find_contours

from tasks.surfaces.cloud import Floats, Indices, Mask

Field = npt.NDArray[np.float32]

TILE = 6  # in widest discs: the window of the local density
GAP_QUANTILE = 0.4  # below a half, so that slots beside a narrow surface do not count as its gaps
DISC_PER_GAP = 4.85  # radius of the disc that finds no pinhole in 10 m² of random samples, by that quantile
INSET_PER_GAP = 1.4  # how far outermost samples lie inside the edge, where they are random
SMALLEST_HOLE = 4.0  # in discs: less may be samples missing by chance
PIXELS_PER_DISC = 5
MOST_PIXELS = 4_000_000  # of a raster; larger surfaces get coarser pixels


@dataclass(frozen=True)
class Part:
    """A connected piece: its polygon, with holes, and which of the points (N,) lie on it."""

    polygon: shapely.Polygon
    members: Mask


def outline_parts(
    uv_m: Floats, finest_m: float, widest_m: float, narrowest_m: float, smallest_m2: float
) -> list[Part]:
    """The pieces of at least `smallest_m2` that (N, 2) samples cover, largest first.

    The empty disc's radius follows the samples' density between finest_m and widest_m. What is narrower
    than narrowest_m is cut off. Polygons leave their contour by half the finest disc at most.
    """
    raster = _Raster(uv_m, 2 * widest_m, finest_m / PIXELS_PER_DISC)
    to_sample_m = raster.distance_m(~raster.holding(uv_m))
    gap_m = _local_gap_m(raster, to_sample_m, widest_m)
    disc_m = np.clip(DISC_PER_GAP * gap_m, finest_m, widest_m)
    depth_m = raster.distance_m(to_sample_m <= disc_m) - raster.pixel_m  # half of it on either side of a disc
    inside_m = depth_m - np.maximum(disc_m - INSET_PER_GAP * gap_m, raster.pixel_m)
    core = raster.distance_m(inside_m >= 0) >= narrowest_m / 2
    inside_m = np.minimum(inside_m, narrowest_m / 2 - raster.distance_m(~core))
    labels, _ = ndimage.label(inside_m >= 0)
    label_of_sample = labels[raster.pixels(uv_m)]
    parts = []
    for label, box in enumerate(ndimage.find_objects(labels), start=1):
        own = labels[box] == label
        if own.sum() * raster.pixel_m**2 < smallest_m2 / 2:
            continue
        top, left = box[0].start - 1, box[1].start - 1  # the raster's margin makes room for one more
        window = np.s_[top : box[0].stop + 1, left : box[1].stop + 1]
        own_m = np.where(np.isin(labels[window], (0, label)), inside_m[window], -1.0)
        rings_m = [
            (ring[:, ::-1] + (left, top)) * raster.pixel_m + raster.corner_m
            for ring in find_contours(own_m, 0.0)  # type: ignore[no-untyped-call]
            if len(ring) > 3
        ]
        hole_m2 = SMALLEST_HOLE * np.pi * float(disc_m[box][own].mean()) ** 2
        polygon = _polygon(rings_m, max(finest_m / 2, raster.pixel_m), hole_m2)
        if polygon.area >= smallest_m2:
            parts.append(Part(polygon, np.asarray(label_of_sample == label)))
    return sorted(parts, key=lambda part: (-part.polygon.area, part.polygon.bounds))


class _Raster:
    """Pixels over (N, 2) points and a margin; pixel (0, 0) has its centre at corner_m. Rows run along v."""

    def __init__(self, uv_m: Floats, margin_m: float, pixel_m: float) -> None:
        self.corner_m = uv_m.min(axis=0) - margin_m
        size_m = uv_m.max(axis=0) + margin_m - self.corner_m
        self.pixel_m = max(pixel_m, float(np.sqrt(size_m[0] * size_m[1] / MOST_PIXELS)))
        width, height = np.ceil(size_m / self.pixel_m).astype(int) + 1
        self.shape = (int(height), int(width))

    def pixels(self, uv_m: Floats) -> tuple[Indices, Indices]:
        column, row = np.rint((uv_m - self.corner_m) / self.pixel_m).astype(np.int64).T
        return row, column

    def holding(self, uv_m: Floats) -> Mask:
        """The pixels that hold a point."""
        mask = np.zeros(self.shape, dtype=bool)
        mask[self.pixels(uv_m)] = True
        return mask

    def distance_m(self, mask: Mask) -> Field:
        """Of each pixel of the mask, from the nearest pixel outside it; 0 outside."""
        distance = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return np.asarray(distance * np.float32(self.pixel_m))


def _local_gap_m(raster: _Raster, to_sample_m: Field, widest_m: float) -> Field:
    """Distance from a place on the surface to its nearest sample: the quantile in tiles,
    where the samples close under the widest disc (what is wider is an opening), interpolated between."""
    closed = raster.distance_m(to_sample_m <= widest_m) >= widest_m
    side = max(int(TILE * widest_m / raster.pixel_m), 1)
    rows, columns = -(-raster.shape[0] // side), -(-raster.shape[1] // side)
    padded = np.full((rows * side, columns * side), np.nan, dtype=np.float32)
    padded[: raster.shape[0], : raster.shape[1]] = np.where(closed, to_sample_m, np.nan)
    tiles = np.sort(padded.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(rows, columns, -1))
    counts = np.isfinite(tiles).sum(axis=-1)  # NaN sorts last
    ranked = np.take_along_axis(tiles, (counts * GAP_QUANTILE).astype(int)[..., None], axis=-1)[..., 0]
    known = counts > 0
    if not known.any():
        return np.full(raster.shape, widest_m, dtype=np.float32)
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    tile_gap_m = ranked[tuple(nearest)]
    smooth = cv2.resize(tile_gap_m, (columns * side, rows * side), interpolation=cv2.INTER_LINEAR)
    return np.asarray(smooth[: raster.shape[0], : raster.shape[1]])


def _polygon(rings_m: list[Floats], simplify_m: float, smallest_hole_m2: float) -> shapely.Polygon:
    """The largest ring less those inside it, counter-clockwise, simplified; empty where none encloses."""
    shells = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings_m]
    shells.sort(key=lambda shell: -shell.area)
    holes = [shell for shell in shells[1:] if shell.area >= smallest_hole_m2]
    whole = shapely.union_all(shells[:1]).difference(shapely.union_all(holes))
    simple = shapely.make_valid(shapely.simplify(whole, simplify_m))
    pieces = [piece for piece in shapely.get_parts(simple) if isinstance(piece, shapely.Polygon)]
    return shapely.orient_polygons(max(pieces, key=lambda piece: piece.area, default=shapely.Polygon()))
