"""A photo, checked and understood."""

from schemas.camera import Camera, CameraPose
from schemas.contract import Contract, Vector3
from schemas.file import File

BLURRED = 0.3  # of the median sharpness: scenes differ by a fifth, 4 px of blur by four to ten
LOST = 0.5  # share of a photo that is clipped: real photos of structures have at most a few hundredths


class Photo(Contract):
    name: str  # the file's name, unique in its set
    file: File  # 8-bit and upright: as it came, or a PNG of it where orientation or pixel format were others
    camera: Camera  # from the inspection, or from EXIF; of the upright image
    camera_from: str = "inspection"  # what the focal length rests on, in words where it is a guess
    focal_sigma: float = 0.01  # 1σ of the focal length, relative: how far an adjustment may change it
    pose: CameraPose | None = None  # from the flight log, world ENU
    position_sigma_m: float = 5.0  # how far to trust the position, of pose or GPS
    gps: Vector3 | None = None  # latitude, longitude (degrees), altitude above take-off (m; 0: not known)
    view_deg: Vector3 | None = None  # yaw, pitch, roll of the camera from XMP, as in CameraPose
    surface: str  # the surface (or set) it belongs to
    sharpness: float  # variance of the Laplacian over that of local contrast, dimensionless; blur lowers it
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
        return f"underexposed ({self.black:.0%} of it is black)" if self.black > LOST else None


class Features(Contract):
    """SIFT features of one photo (NPZ: xy float32 (N, 2) in undistorted photo pixels, scale float32 (N,),
    angle float32 (N,), response float32 (N,), descriptors uint8 (N, 128): RootSIFT times 512); the strongest
    of each part of the photo first."""

    photo: str
    file: File
    count: int
