"""What the simulator knows and says: truth, photos of the wall, and the score of a report."""

from typing import Literal

from schemas.camera import Camera, CameraPose
from schemas.contract import Contract, Vector2, Vector3
from schemas.file import Folder
from schemas.surface import Surface


class TrueCrack(Contract):
    """A planted crack, or a branch of one. Points and widths belong together, about 5 mm apart."""

    id: str
    parent: str | None  # the crack that this one branches off
    surface: str
    polyline_uv_m: tuple[Vector2, ...]
    polyline_world_m: tuple[Vector3, ...]
    widths_mm: tuple[float, ...]  # averaged over 5 mm along the crack, chipped edges included
    length_mm: float  # of the centreline from tip to tip


class Marker(Contract):
    """A pattern stuck on the surface to help stitching."""

    surface: str
    centre_uv_m: Vector2
    radius_m: float  # of the circle around it


class Truth(Contract):
    scene: str
    seed: int
    gsd_mm_px: float  # that the photos are planned for
    camera: Camera  # as it truly is; the inspection knows it as calibrated
    surfaces: tuple[Surface, ...]  # those that carry cracks
    cracks: tuple[TrueCrack, ...]
    markers: tuple[Marker, ...]
    stations_m: tuple[Vector3, ...]  # true positions of the laser scanner


class WallPhotos(Contract):
    photos: Folder
    poses: tuple[tuple[str, CameraPose], ...]  # name of the photo, pose as measured (5 cm, 1°)
    camera: Camera
    surface: Surface


class CrackScore(Contract):
    """A planted crack against what was reported of it. Lengths and widths are of the stretch at least 1 px
    wide; a measured length counts what the report places along that stretch."""

    id: str
    surface: str
    width_px: float  # true median
    width_true_mm: float  # true median along what was found
    length_true_mm: float
    found: float  # share of the stretch
    length_mm: float  # measured
    width_mm: float | None  # measured median; None: not found, or only bounded from above
    length_error: float | None  # share of the true length; None: not found
    width_error_px: float | None


class FalseCrack(Contract):
    id: str  # in the report
    surface: str
    length_mm: float
    near: Literal["marker", "crack", "nothing"]  # what it may have been taken from


class FrameFit(Contract):
    """How the report's frame of one surface lies to the true one."""

    surface: str
    shift_m: float  # in the middle of the reported cracks
    scale: float  # true over reported lengths; it shows in measured widths and lengths too


class Score(Contract):
    cracks: tuple[CrackScore, ...]
    false_cracks: tuple[FalseCrack, ...]
    inspected_m2: float
    fits: tuple[FrameFit, ...]
    wide_planted: int  # at least 3 px wide
    wide_found: int
    false_per_5_m2: float
    holds: bool  # every bar of the demo
