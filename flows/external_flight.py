"""A flight that somebody else flies: the run waits for its photos and log (a form, or the command line)."""

from pathlib import Path

from prefect import suspend_flow_run
from prefect.context import FlowRunContext
from prefect.input import RunInput
from pydantic import ValidationError

from flows.inspection_file import existing
from schemas.inspection import Inspection, PhotoSet
from schemas.problem import BadInput
from tasks import run
from tasks.flight.task import refuse_unless_log
from tasks.stage import NotYetKnown

LOG_SUFFIXES = {".tlog", ".bin", ".ulg", ".mcap"}


class WaitingForFlight(Exception):
    """Nothing more can be done before the flight is flown."""


class ExternalFlight(RunInput):
    """The form that a deployed run shows in the dashboard."""

    photos: str  # folder of the flight's photos, on the machine that runs the inspection
    log: str  # the flight's log: tlog, BIN, ulg or mcap; of several flights their folder


def photos_and_logs(inspection: Inspection, base: Path) -> tuple[tuple[PhotoSet, ...], list[Path]]:
    """The photos and the logs of external flights: from the inspection, else asked for."""
    if inspection.photos and inspection.flight_log:
        return inspection.photos, given_logs(inspection, base)
    if run.current().dry:
        raise NotYetKnown("fly")
    if not deployed():
        raise WaitingForFlight
    return _asked_for(base)


def given_logs(inspection: Inspection, base: Path) -> list[Path]:
    """Those that the inspection names. BadInput where one is missing or none that can be read."""
    named = inspection.flight_log or ()
    named = (named,) if isinstance(named, str) else named
    return [log for name in named for log in _logs(base, name, "flight_log")]


def deployed() -> bool:
    """Whether this run is a deployment's, which the dashboard can have wait and go on."""
    context = FlowRunContext.get()
    return context is not None and context.flow_run is not None and context.flow_run.deployment_id is not None


def _logs(base: Path, name: str, key: str) -> list[Path]:
    """The log of that name, or those in the folder of that name."""
    path = existing(base, name, key)
    logs = [path]
    if path.is_dir():
        logs = sorted(p for p in path.iterdir() if p.suffix.lower() in LOG_SUFFIXES)
    if not logs:
        raise BadInput(name, "holds no log", f"Put {', '.join(sorted(LOG_SUFFIXES))} files there")
    for log in logs:
        refuse_unless_log(log, log.name)
    return logs


def _asked_for(base: Path) -> tuple[tuple[PhotoSet, ...], list[Path]]:
    """Suspend until the form is filled in; ask again, with the reason, while the answer is bad.

    Each question has its own key, since Prefect replays the answers already given when the run resumes."""
    reason = "Fly the mission files in the run's folder, then say where its photos and its log are."
    for attempt in range(100):
        try:
            answer = suspend_flow_run(
                wait_for_input=ExternalFlight.with_initial_data(description=reason),
                key=f"external-flight-{attempt}",
                timeout=30 * 24 * 3600,
            )
            existing(base, answer.photos, "photos")
            return (PhotoSet(folder=answer.photos),), _logs(base, answer.log, "log")
        except BadInput as problem:
            reason = f"**That did not work.** {problem}"
        except ValidationError:  # the server takes a form that lacks an answer
            reason = "**That did not work.** Give both: the folder of photos and the log."
    raise BadInput("flight", "100 answers could not be used", "Start the run anew")
