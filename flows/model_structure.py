"""Scans become a registered model, the model becomes surfaces and obstacles (paper, sections 2.1, 2.2)."""

from dataclasses import dataclass
from pathlib import Path

from artifacts import store
from flows.inspection_file import existing
from flows.inspection_flow import inspection_flow
from flows.opening import opened
from schemas.inspection import Inspection, ScanInput
from schemas.problem import BadInput, LeftOut
from schemas.registered_model import RegisteredModel
from schemas.scan import Scan
from schemas.structure import Structure
from schemas.target import SeenTarget
from tasks.registration.task import ingest_scan, register
from tasks.simulation.task import simulate_scans
from tasks.surfaces.task import extract

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}


@dataclass(frozen=True)
class Modelled:
    model: RegisteredModel
    structure: Structure
    unreadable: tuple[LeftOut, ...] = ()

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        return (*self.unreadable, *self.structure.left_out)  # the structure passes on the model's


def has_scans(inspection: Inspection) -> bool:
    return bool(inspection.scans) or bool(inspection.simulation and inspection.simulation.scene != "wall")


def model(inspection: Inspection, base: Path) -> Modelled:
    """Register the scans and find what is flat and what is in the way."""
    scans, unreadable = usable_scans(inspection, base)
    registered = register(scans, inspection.registration, inspection.targets)
    return Modelled(registered, extract(registered, inspection.surfaces), unreadable)


def usable_scans(inspection: Inspection, base: Path) -> tuple[tuple[Scan, ...], tuple[LeftOut, ...]]:
    """The scans that can be read, and those that cannot with their reasons."""
    if inspection.simulation is not None and not inspection.scans:
        return simulate_scans(inspection.simulation), ()
    calls, problems = [], []
    for given in inspection.scans:
        try:
            calls.append(_ingest_call(given, base))
        except BadInput as problem:
            problems.append(problem)
    scans: list[Scan] = []
    for outcome in ingest_scan.each(calls):
        if isinstance(outcome, BadInput):
            problems.append(outcome)
        else:
            scans.extend(outcome)
    if not scans:
        raise problems[0] if problems else BadInput("scans", "none given", "List them under the key 'scans'")
    return tuple(scans), tuple(LeftOut.because("registration", problem) for problem in problems)


def _ingest_call(given: ScanInput, base: Path) -> tuple[object, ...]:
    path = existing(base, given.file, "scans")
    if not path.is_file():
        raise BadInput(given.file, "is not a file", "Name one scan file per entry of 'scans'")
    file, seen = store.current().put(path), seen_targets(given)
    return (file, path.name, METRES[given.unit], given.position_m, given.T_world_scan, seen)


def seen_targets(given: ScanInput) -> tuple[SeenTarget, ...]:
    return tuple(SeenTarget(name=name, position=place) for name, place in given.targets.items())


@inspection_flow("model-structure", __doc__)
def model_structure(inspection: str = "demo:bridge", out: str | None = None) -> None:
    """inspection: path of the YAML file (or demo:bridge); out: the run's folder."""
    with opened(inspection, out) as run:
        run.save_model(model(run.inspection, run.base))
