"""A photo, checked and understood."""

from collections.abc import Sequence
from statistics import median

from schemas.camera import Camera, CameraPose
from schemas.contract import Contract, Vector3, Vector4
from schemas.file import File

BLURRED = 0.25  # of the median along any direction: scenes differ by a fifth, 15 px of motion by five to ten
LOST = 0.5  # share of a photo that is clipped: real photos of structures have at most a few hundredths


class Photo(Contract):
    name: str  # the file's name, with its folder's before it where several of the set are called so
    file: File  # 8-bit and upright: as it came, or a PNG of it where orientation or pixel format were others
    camera: Camera  # from the inspection, or from EXIF; of the upright image
    camera_from: str = "inspection"  # what the focal length rests on, in words where it is a guess
    focal_sigma: float = 0.01  # 1σ of the focal length, relative: how far an adjustment may change it
    pose: CameraPose | None = None  # from the flight log, world ENU
    position_sigma_m: float = 5.0  # how far to trust the position, of pose or GPS
    gps: Vector3 | None = None  # latitude, longitude (degrees), altitude above take-off (m; 0: not known)
    view_deg: Vector3 | None = None  # yaw, pitch, roll of the camera from XMP, as in CameraPose
    velocity_m_s: Vector3 | None = None  # world ENU, of the vehicle at the shot: from its log, or XMP
    surface: str  # the surface (or set) it belongs to
    sharpness: float  # variance of the Laplacian over that of local contrast, dimensionless; blur lowers it
    sharpness_along: Vector4 | None = None  # at 0, 90, 45 and 135°: motion lowers one; None: alike
    exposure: float  # mean grey, 0..1
    white: float = 0.0  # share of pixels that are white through and through, and
    black: float = 0.0  # that are black: their brightness is lost
    metered_ev: float | None = None  # log2 of s · ISO / 100 / f-number², from EXIF: the light it was set for
    orientation: int = 1  # EXIF orientation, already undone in `file` and `camera`

    @property
    def misexposed(self) -> str | None:
        """Why nothing can be seen in it, where that is so."""
        if self.white > LOST:
            return f"overexposed ({self.white:.0%} of it is white)"
        if self.black > LOST:
            return f"underexposed ({self.black:.0%} of it is black)"
        return "blank (all of it is one grey)" if self.sharpness == 0 else None


def sharpness_shares(photos: Sequence[Photo]) -> list[float]:
    """Of each photo, its sharpness over the median photo's, along the direction where this is least; 1 where
    nothing can be compared."""
    along = [p.sharpness_along or (p.sharpness,) * 4 for p in photos]
    usual = [median(one[k] for one in along) for k in range(4)] if along else []
    return [min(a / u if u > 0 else 1.0 for a, u in zip(one, usual, strict=True)) for one in along]


class Features(Contract):
    """SIFT features of one photo (NPZ: xy float32 (N, 2) in undistorted photo pixels, scale float32 (N,),
    angle float32 (N,), response float32 (N,), descriptors uint8 (N, 128): RootSIFT times 512); the strongest
    of each part of the photo first."""

    photo: str  # its name
    file: File
    count: int
