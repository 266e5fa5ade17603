"""A laser scan as a crew brings it."""

from schemas.contract import Contract, Matrix4, Vector3
from schemas.file import File
from schemas.problem import LeftOut
from schemas.target import SeenTarget
from schemas.utm import UtmZone


class Scan(Contract):
    """One station's point cloud. Coordinates in the file are in `unit`, in the scanner's own frame
    unless `T_world_scan` (metres) says where that frame stands in the world."""

    name: str
    file: File
    index: int = 0  # which scan of a file that holds several (E57, PTX)
    unit_m: float = 1.0  # metres per unit of the file's coordinates
    station_position_m: Vector3 | None = None  # scanner position in the world, as measured by the crew
    T_world_scan: Matrix4 | None = None  # full prior pose, where the file or the crew has one
    utm_zone: UtmZone | None = None  # of the file's coordinates, where the file states one
    targets: tuple[SeenTarget, ...] = ()
    left_out: tuple[LeftOut, ...] = ()  # what of its file could not be read
