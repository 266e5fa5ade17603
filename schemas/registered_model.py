"""The registered 3D model: one cloud, one pose per station, and how well they agree."""

import math

from schemas.contract import Contract, Matrix4, Matrix6, Vector3
from schemas.file import File
from schemas.problem import LeftOut
from schemas.target import TargetResidual
from schemas.utm import UtmZone


class Station(Contract):
    name: str
    T_world_scan: Matrix4  # maps scan coordinates (metres) to world (metres, minus origin_m)
    points: int
    scanner_m: Vector3 | None = None  # in the world minus origin_m; None: not known
    covariance: Matrix6 | None = (
        None  # turn (rad) and shift (m) of the scanner about the world's axes, relative
    )
    # to all stations together; None: the only station

    @property
    def sigma_mm(self) -> float | None:
        """Standard deviation of the scanner's place, its three axes together."""
        return (
            None
            if self.covariance is None
            else 1000 * math.sqrt(sum(self.covariance[k][k] for k in (3, 4, 5)))
        )

    @property
    def sigma_deg(self) -> float | None:
        """Standard deviation of its attitude, likewise."""
        if self.covariance is None:
            return None
        return math.degrees(math.sqrt(sum(self.covariance[k][k] for k in (0, 1, 2))))


class ScanPair(Contract):
    """One edge of the pose graph."""

    source: str
    target: str
    T_target_source: Matrix4
    overlap: float  # share of source points with a target point closer than tau_m (paper, eq. 1)
    rmse_m: float  # point-to-plane residual of the inliers
    inliers: int


class RegisteredModel(Contract):
    cloud: File  # PLY, float32 metres: x y z nx ny nz and station (uchar/ushort index into stations)
    origin_m: Vector3 = (0.0, 0.0, 0.0)  # subtracted from large coordinates (UTM) to keep float32 exact
    utm_zone: UtmZone | None = None  # of the world, where the scans' files state it
    stations: tuple[Station, ...]
    pairs: tuple[ScanPair, ...] = ()
    targets: tuple[TargetResidual, ...] = ()
    points: int
    min_m: Vector3
    max_m: Vector3
    left_out: tuple[LeftOut, ...] = ()

    @property
    def control_rmse_m(self) -> float | None:
        """Of the control targets that were fitted to; None without any."""
        return _rms([one for one in self.targets if one.used])

    @property
    def check_rmse_m(self) -> float | None:
        """Of the check points, which the fit never saw; None without any."""
        return _rms([one for one in self.targets if one.check])


def _rms(residuals: list[TargetResidual]) -> float | None:
    if not residuals:
        return None
    return math.sqrt(sum(x * x for one in residuals for x in one.residual_m) / len(residuals))
