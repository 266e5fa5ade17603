"""What the drone and its gimbal can do."""

import math

from pydantic import Field

from schemas.contract import Contract

BOUND_3D = 2.795  # 95 % quantile of the length of a normal 3D vector, σ = 1 along each axis
BOUND_OF_AXES = 2.388  # and of its largest component


class Vehicle(Contract):
    radius_m: float = Field(default=0.4, gt=0)  # half the largest diagonal, propellers included
    clearance_m: float = Field(default=1.0, ge=0)  # least distance to keep between vehicle and anything
    speed_m_s: float = Field(default=2.0, gt=0)  # cruise between shooting points
    acceleration_m_s2: float = Field(default=1.0, gt=0)
    yaw_rate_deg_s: float = Field(default=45.0, gt=0)
    hold_s: float = Field(default=1.0, ge=0)  # settling time at a shooting point before the shutter
    gimbal_pitch_min_deg: float = Field(default=-90.0, ge=-90, le=90)  # what the gimbal can tilt to
    gimbal_pitch_max_deg: float = Field(default=90.0, ge=-90, le=90)
    endurance_s: float = Field(default=20 * 60.0, gt=0)  # flight time of a battery
    reserve: float = Field(default=0.25, ge=0, lt=1)  # share of it kept for the way home
    position_bias_m: float = Field(default=0.2, ge=0)  # 1σ of the slowly walking position error
    position_jitter_m: float = Field(default=0.05, ge=0)  # 1σ of its quick part

    @property
    def position_error_m(self) -> float:
        """95 % bound of the position error's length in 3D, its slow and quick part together."""
        return BOUND_3D * math.hypot(self.position_bias_m, self.position_jitter_m)

    @property
    def sideways_error_m(self) -> float:
        """95 % bound of the position error along the axis where it is largest, both parts together."""
        return BOUND_OF_AXES * math.hypot(self.position_bias_m, self.position_jitter_m)

    @property
    def inflation_m(self) -> float:
        """How far the planned centre of the vehicle stays from every scanned point."""
        return self.radius_m + self.clearance_m + self.position_error_m

    @property
    def margin_m(self) -> float:
        """How far the planned centre stays from space that it may not enter but that nothing was seen in:
        a fence, a no-fly box, what no scanner saw. The vehicle stays out of it whole, wherever it errs."""
        return self.radius_m + self.position_error_m
