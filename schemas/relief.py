"""How a surface stands out of its plane, as scans or photos measured it."""

from typing import Literal

from schemas.contract import Contract
from schemas.file import File


class Relief(Contract):
    """Heights w over the surface's plane, along its normal, on a grid of its (u, v); linear between."""

    surface: str
    heights: File  # .npy, (rows, columns) float32 metres; (r, c) lies at u = left_m + c·cell_m,
    left_m: float  # v = bottom_m + r·cell_m
    bottom_m: float
    cell_m: float
    rms_m: float  # of the heights: what is lost where the surface is taken for flat
    sigma_m: float  # 1σ of a height, where there are points
    sigmas: File | None = None  # of each height, as `heights`; None: sigma_m everywhere
    measured_by: Literal["scans", "photos"] = "scans"
