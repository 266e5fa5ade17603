"""The result of an inspection."""

from schemas.contract import Contract
from schemas.crack import Crack
from schemas.problem import LeftOut


class SurfaceInspected(Contract):
    name: str
    area_m2: float | None  # of the surface, where known
    inspected_m2: float | None  # covered by photos, markers taken off
    gsd_mm_px: float | None
    photos: int
    cracks: int
    method: str


class CrackReport(Contract):
    inspection: str
    method: str
    surfaces: tuple[SurfaceInspected, ...]
    cracks: tuple[Crack, ...]
    not_inspected: tuple[LeftOut, ...]
