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
from tasks.stage import NotYetKnown


class WaitingForFlight(Exception):
    """Nothing more can be done before the flight is flown."""


class ExternalFlight(RunInput):
    """The form that a deployed run shows in the dashboard."""

    photos: str  # folder of the flight's photos, on the machine that runs the inspection
    log: str  # the flight's log: tlog, BIN, ulg or mcap


def photos_and_log(inspection: Inspection, base: Path) -> tuple[tuple[PhotoSet, ...], Path]:
    """The photos and the log of an external flight: from the inspection, else asked for."""
    if inspection.photos and inspection.flight_log is not None:
        return inspection.photos, existing(base, inspection.flight_log, "flight_log")
    if run.current().dry:
        raise NotYetKnown("fly")
    context = FlowRunContext.get()
    if context is None or context.flow_run is None or context.flow_run.deployment_id is None:
        raise WaitingForFlight
    return _asked_for(base)


def _asked_for(base: Path) -> tuple[tuple[PhotoSet, ...], Path]:
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
            log = existing(base, answer.log, "log")
            if not log.is_file():
                raise BadInput(answer.log, "is no file", "Name the log file itself")
            return (PhotoSet(folder=answer.photos),), log
        except BadInput as problem:
            reason = f"**That did not work.** {problem}"
        except ValidationError:  # the server takes a form that lacks an answer
            reason = "**That did not work.** Give both: the folder of photos and the log."
    raise BadInput("flight", "100 answers could not be used", "Start the run anew")
