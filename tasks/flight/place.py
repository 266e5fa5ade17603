"""Where a log's geographic positions lie in the world."""

from dataclasses import dataclass
from typing import Self

from schemas.contract import Vector3
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from tasks.flight.recording import Fix, Recording


@dataclass(frozen=True)
class Place:
    """How a log's geographic positions become world coordinates. Heights count from home, since the
    altitude of a satellite receiver is metres off and the mission is flown by heights above home."""

    origin: GeoOrigin
    home_up_m: float

    @classmethod
    def of_plan(cls, plan: FlightPlan) -> Self:
        return cls(plan.origin, plan.home_m[2])

    @classmethod
    def of_log(cls, recording: Recording) -> Self:
        """World zero is where the vehicle was first."""
        first = recording.fixes[0]
        altitude = first.altitude_m - first.height_m
        return cls(
            GeoOrigin(
                latitude_deg=first.latitude_deg, longitude_deg=first.longitude_deg, altitude_m=altitude
            ),
            0.0,
        )

    def world_m(self, fix: Fix) -> Vector3:
        east, north, _ = self.origin.to_enu(fix.latitude_deg, fix.longitude_deg, 0.0)
        return (east, north, self.home_up_m + fix.height_m)

    def yaw_deg(self, fix: Fix) -> float:
        return self.origin.yaw_deg(fix.yaw_deg)

    def world_pose(self, fix: Fix) -> tuple[Vector3, float]:
        """Position and yaw."""
        return self.world_m(fix), self.yaw_deg(fix)
