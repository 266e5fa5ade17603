"""Opening a run: its inspection, its folder, its store, and where its results are laid out for people."""

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import TypeAdapter

from artifacts import store
from artifacts.run_folder import remove_stale
from artifacts.whole_file import whole
from flows import results
from flows.inspection_file import read_inspection
from flows.output_folder import make_output_folder, told_when_full
from flows.run_claim import claimed, refuse_another_s
from schemas.crack_report import CrackReport
from schemas.file import Folder
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection
from schemas.problem import BadInput
from tasks import run
from tasks.simulation.task import demo_inspection
from tasks.stage import STAGES

TOKENS = TypeAdapter(dict[str, str])  # stage → token, as .redo.json holds them

if TYPE_CHECKING:
    from flows.collect_images import Collected
    from flows.detect_cracks import Detected
    from flows.model_structure import Modelled


@dataclass(frozen=True)
class OpenRun:
    inspection: Inspection
    base: Path  # folder that the inspection's paths are relative to
    folder: Path  # runs/<inspection>

    def save_model(self, modelled: "Modelled") -> None:
        if run.current().lay_out:
            results.lay_out_model(self.folder, modelled.model, modelled.structure)

    def save_plan(self, plan: FlightPlan) -> None:
        if run.current().lay_out:
            results.write_flight_plan(self.folder / "plan", plan)

    def save_collected(self, collected: "Collected") -> None:
        if run.current().lay_out:
            results.lay_out_flight(self.folder, collected.log)

    def save_detected(self, detected: "Detected") -> None:
        if run.current().lay_out:
            names = [one.mosaic.name for one in detected.inspected]
            for stage in ("mosaics", "detection"):
                remove_stale(self.folder / stage, names)
            for one in detected.inspected:
                results.lay_out_mosaic(self.folder, one.mosaic, one.patterns, one.detection)

    def save_report(self, report: CrackReport, pages: Folder) -> None:
        if run.current().lay_out:
            results.lay_out_report(self.folder, pages)


@contextmanager
def opened(inspection: str, out: str | None = None, redo: tuple[str, ...] = ()) -> Iterator[OpenRun]:
    """Open the run of an inspection file, or of demo:bridge or demo:wall.

    Listener and dryness are those of the run that is current, so that the command line can set them."""
    if inspection.startswith("demo:"):
        settings, base = demo_inspection(inspection.removeprefix("demo:")), Path.cwd()
    else:
        path = Path(inspection)
        settings, base = read_inspection(path), path.resolve().parent
    folder = Path(out or f"runs/{settings.name}").resolve()
    make_output_folder(folder)
    refuse_another_s(folder, inspection)
    caller = run.current()
    claim = claimed(folder, inspection) if caller.lay_out else nullcontext()
    with _store_beside(folder), told_when_full(folder, store.current().root), claim:
        tokens = _redo_tokens(folder, redo, keep=not caller.dry)
        with run.running(replace(caller, folder=folder, redo=tokens, last={})):
            yield OpenRun(settings, base, folder)
        if not caller.dry:
            (folder / ".redo.json").unlink(missing_ok=True)


@contextmanager
def _store_beside(folder: Path) -> Iterator[None]:
    """HAIRLINE_STORE where it is set; else runs/.store for the runs beside it, which share results; a run
    that stands elsewhere has its own."""
    if "HAIRLINE_STORE" in os.environ:
        yield
        return
    shared = folder.parent / ".store"
    own = shared if folder.parent.name == "runs" or shared.is_dir() else folder / ".store"
    os.environ["HAIRLINE_STORE"] = str(own)
    try:
        yield
    finally:
        del os.environ["HAIRLINE_STORE"]


def _redo_tokens(folder: Path, redo: tuple[str, ...], keep: bool) -> dict[str, str]:
    """A token for each stage to redo, kept in the run's folder until the run has finished: through a kill
    and a resume each redo happens once."""
    if "fly" in redo:
        raise BadInput(
            "--redo fly", "a flight is not repeated by a redo", "Give the inspection a new 'mission' id"
        )
    for stage in redo:
        if stage.replace("-", "_") not in STAGES:
            stages = ", ".join(sorted(STAGES))
            raise BadInput(f"--redo {stage}", "there is no such stage", f"The stages are {stages}")
    path = folder / ".redo.json"
    try:
        tokens = TOKENS.validate_json(path.read_bytes())
    except (OSError, ValueError):  # none, or damaged
        tokens = {}
    tokens |= {
        stage.replace("-", "_"): uuid.uuid4().hex for stage in redo if stage.replace("-", "_") not in tokens
    }
    if tokens and keep:
        with whole(path) as temporary:
            temporary.write_bytes(TOKENS.dump_json(tokens))
    return tokens
