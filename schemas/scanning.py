"""How the simulated scans are made: the scanner, and what can go wrong. Each fault is off at zero or None."""

from pydantic import Field

from schemas.contract import Contract


class Scanning(Contract):
    """The defaults are a good scanner on a quiet site. Systematic errors are the scanner's own: the same at
    every station."""

    step_deg: float = Field(default=0.36, gt=0)  # between neighbouring rays, both ways
    range_sigma_m: float = Field(default=0.003, ge=0)
    angle_sigma_deg: float = Field(default=0.004, ge=0)
    level_sigma_deg: float = Field(default=0.02, ge=0)  # what the tripod's level leaves
    station_sigma_m: float = Field(default=0.05, ge=0)  # of the measured position, each axis
    astray: int = Field(default=0, ge=0)  # stations whose position was written down wrong,
    astray_m: float = Field(default=10.0, ge=0)  # by so much
    range_offset_m: float = 0.0  # every range is this much too long
    range_scale_ppm: float = 0.0
    range_wave_m: float = 0.0  # amplitude of the phase meter's cyclic error
    collimation_deg: float = 0.0  # mirror not square to its axis
    trunnion_deg: float = 0.0  # mirror's axis not level
    index_deg: float = 0.0  # zero of the elevation circle
    beam_mrad: float = Field(default=0.0, ge=0)  # full divergence: pulses mix at edges; 0: a line
    reach_m: float | None = Field(
        default=None, gt=0
    )  # where concrete faced squarely returns every other pulse
    people: int = Field(default=0, ge=0)  # about, elsewhere at each station
    cars: int = Field(default=0, ge=0)  # likewise
    sway_m: float = Field(default=0.0, ge=0)  # of leaves in the wind, between scans
