"""The stitched image of one surface."""

import math
from typing import Literal

from schemas.contract import Contract, Matrix3, Vector2, Vector3
from schemas.control import ControlResidual
from schemas.file import File
from schemas.photo import Photo
from schemas.problem import LeftOut
from schemas.relief import Relief
from schemas.surface import Surface


class PhotoPlacement(Contract):
    name: str
    status: Literal["solved", "placed", "rejected"]  # by matches; by its pose alone; not in the mosaic
    reason: str = ""  # why it was placed or rejected
    H_mosaic_photo: Matrix3 | None = None  # undistorted photo pixels to mosaic pixels, of a flat surface;
    camera_uvw_m: Vector3 | None = None  # what stands h over the plane lies h/w of the way to (u, v) of this
    matches: int = 0
    rms_px: float | None = None  # reprojection residual in the mosaic
    covariance_mm2: tuple[Vector2, Vector2] | None = None  # of where its middle lies among the others
    gain: float = 1.0


class MatchEdge(Contract):
    """Two photos whose features match by the pairwise test."""

    photos: tuple[int, int]  # indices into the mosaic's photos
    matches: int
    held: bool  # False: it disagrees with the rest of the graph and does not count


class Mosaic(Contract):
    """Mosaic pixel (x, y) lies at u = origin_uv_m[0] + x·gsd, v = origin_uv_m[1] − y·gsd of its surface
    (v is up, y down). Without a surface the frame is the mosaic's own plane. gsd_mm_px None: no scale is
    known, and nothing can be said in millimetres."""

    name: str  # of the surface or photo set
    surface: Surface | None
    image: File  # tiled TIFF, 8-bit RGB
    coverage: File  # tiled TIFF, 8-bit, 255 where a photo covers the pixel: blank is known, not guessed
    source: File  # tiled TIFF, 16-bit, 1 + index into `photos` of the photo each pixel comes from
    width_px: int
    height_px: int
    gsd_mm_px: float | None
    scale_from: str  # the gauge: "targets", "scale bars", "poses", "stated GSD", "GPS", "none"
    scale_sigma: float | None = None  # relative 1σ of the scale, where poses or GPS tell it
    origin_uv_m: Vector2
    photos: tuple[Photo, ...]
    placements: tuple[PhotoPlacement, ...]  # one a photo, in the order of `photos`
    edges: tuple[MatchEdge, ...] = ()
    covered_m2: float | None
    rms_px: float | None
    relief: Relief | None = None  # on which the photos are laid; None: on the plane
    height_sigma_m: float | None = None  # 1σ of the surface over relief or plane; None: not known
    control: tuple[ControlResidual, ...] = ()  # what fixed the gauge, and what judges it
    left_out: tuple[LeftOut, ...] = ()

    @property
    def gauge(self) -> str:
        """In words: what the scale rests on, and what control says of it."""
        if self.gsd_mm_px is None:
            return "scale not known"
        words = f"{self.gsd_mm_px:.3g} mm/px from {self.scale_from}"
        if self.scale_sigma is not None:
            words += f" (± {100 * self.scale_sigma:.2g} %)"
        if self.relief is not None:
            rms_mm, sigma_mm = 1000 * self.relief.rms_m, 1000 * self.relief.sigma_m
            whose = self.relief.measured_by
            words += f"; on the {whose}' relief ({rms_mm:.1f} mm RMS, known to {sigma_mm:.1f} mm)"
        for kind, of in (("fitted", [r for r in self.control if r.used]), ("check", self._checks)):
            if of:
                rms_mm = math.sqrt(sum(r.length_mm**2 for r in of) / len(of))
                words += f"; {len(of)} {kind}: {rms_mm:.2f} mm RMS"
        return words

    @property
    def _checks(self) -> list[ControlResidual]:
        return [r for r in self.control if r.check]
