"""The first page in sentences: what was inspected, what was found, how sure one can be."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from artifacts import precision
from artifacts.inspected_surface import Seen, crack_numbers
from artifacts.palette import SEVERITIES
from schemas.crack import Crack
from schemas.crack_report import CrackReport
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection
from schemas.structure import Structure

METHODS = {
    "hairline": "Hairline's own network, trained on photos and simulated surfaces; each crack with its score",
    "ridge": "Sauvola's local threshold, tied to the texture of the surface itself; no network",
    "onnx": "a network given by the user",
    "paper": "the published method step by step: peak detection, then Sauvola's local threshold",
    "global": "one grey-level threshold for the whole image",
}
TO_MEASURE = 3.0  # pixels across a crack for its width to be measured rather than bounded


@dataclass(frozen=True)
class Summary:
    inspection: Inspection
    report: CrackReport
    seen: Sequence[Seen]
    structure: Structure | None
    plan: FlightPlan | None
    log: FlightLog | None

    @property
    def is_rehearsal(self) -> bool:
        return self.inspection.simulation is not None or (
            self.log is not None and self.log.vehicle == "simulated"
        )

    @cached_property
    def inspected_m2(self) -> float | None:
        known = [s.inspected_m2 for s in self.report.surfaces if s.inspected_m2 is not None]
        return sum(known) if known else None

    @cached_property
    def photos(self) -> int:
        return sum(surface.photos for surface in self.report.surfaces)

    @cached_property
    def gsd(self) -> str:
        """Range of the ground sample distances, "0.48 to 1.00 mm/px"."""
        known = sorted(s.gsd_mm_px for s in self.report.surfaces if s.gsd_mm_px)
        if not known:
            return "unknown"
        low, high = f"{known[0]:.2f}", f"{known[-1]:.2f}"
        return f"{low} mm/px" if low == high else f"{low} to {high} mm/px"

    @cached_property
    def coarsest_mm_px(self) -> float | None:
        return max((s.gsd_mm_px for s in self.report.surfaces if s.gsd_mm_px), default=None)

    @property
    def method(self) -> str:
        return METHODS.get(self.report.method, self.report.method)

    @cached_property
    def counts(self) -> list[tuple[str, int]]:
        """(severity, number of cracks), worst first."""
        counted = Counter[str | None](crack.severity for crack in self.report.cracks)
        return [(severity, counted[severity]) for severity in SEVERITIES]

    @cached_property
    def without_severity(self) -> int:
        return sum(crack.severity is None for crack in self.report.cracks)

    @cached_property
    def widest(self) -> Crack | None:
        """By its measured width; a width of which only a bound is known comes after all measured ones."""
        return max(
            self.report.cracks,
            key=lambda c: (
                c.width_max_mm is not None,
                not c.width_is_upper_bound,
                c.width_max_mm or c.width_max_px,
            ),
            default=None,
        )

    @property
    def widest_width(self) -> str:
        return crack_numbers(self.widest)["width_max"] if self.widest else "–"

    @cached_property
    def total_length(self) -> str:
        known = [c.length_mm for c in self.report.cracks if c.length_mm is not None]
        return f"{sum(known) / 1000:.1f} m" if known else "–"

    @property
    def verdict(self) -> str:
        """One sentence that can be quoted alone."""
        count, surfaces = len(self.report.cracks), len(self.report.surfaces)
        where = _count(surfaces, "surface") if self.by_surface else _count(surfaces, "image")
        area = f"{precision.area_m2(self.inspected_m2)} m²" if self.inspected_m2 is not None else None
        if not surfaces:
            if self.plan is not None:
                return (
                    f"A flight of {_count(len(self.plan.shooting_points), 'photo')} is planned over "
                    f"{_count(len(self.plan.coverage), 'surface')}; nothing has been inspected yet."
                )
            return "Nothing has been inspected: there is no usable photo."
        if not count:
            return (
                f"No cracks found on {area} inspected ({where})." if area else f"No cracks found on {where}."
            )
        found = f"{_count(count, 'crack')} found on {area} inspected ({where})." if area else None
        return found or f"{_count(count, 'crack')} found on {where}; without a scale, sizes are in pixels."

    @property
    def by_surface(self) -> bool:
        """Whether surfaces were stitched; else each photo stands for itself."""
        return any(one.mosaic.surface is not None or len(one.mosaic.photos) > 1 for one in self.seen)

    @property
    def sources(self) -> list[str]:
        """What the inspection rests on, in words."""
        found = []
        if self.structure is not None:
            found.append("laser scans")
        if self.log is not None:
            found.append("a flight with its log")
        if self.photos:
            found.append(_count(self.photos, "photo"))
        return found

    @property
    def smallest_measured_mm(self) -> float | None:
        return TO_MEASURE * self.coarsest_mm_px if self.coarsest_mm_px else None


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
