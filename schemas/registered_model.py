"""The registered 3D model: one cloud, one pose per station, and how well they agree."""

from schemas.contract import Contract, Matrix4, Vector3
from schemas.file import File
from schemas.problem import LeftOut


class Station(Contract):
    name: str
    T_world_scan: Matrix4  # maps scan coordinates (metres) to world (metres, minus origin_m)
    points: int


class ScanPair(Contract):
    """One edge of the pose graph."""

    source: str
    target: str
    T_target_source: Matrix4
    overlap: float  # share of source points with a neighbour closer than tau_m (paper, eq. 1)
    rmse_m: float  # point-to-plane residual of the inliers
    inliers: int


class RegisteredModel(Contract):
    cloud: File  # PLY, float32 metres: x y z nx ny nz and station (uchar/ushort index into stations)
    origin_m: Vector3 = (0.0, 0.0, 0.0)  # subtracted from large coordinates (UTM) to keep float32 exact
    stations: tuple[Station, ...]
    pairs: tuple[ScanPair, ...] = ()
    points: int
    min_m: Vector3
    max_m: Vector3
    left_out: tuple[LeftOut, ...] = ()
