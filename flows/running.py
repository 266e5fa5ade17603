"""Running flows from the command line, with a Prefect server where one answers, else without."""

import contextlib
import shlex
from collections.abc import Iterator
from pathlib import Path

from flows.command_line import EXIT_WAITING_FOR_FLIGHT
from flows.console import StageLines, out, plain
from flows.own_server import answers, own_server
from schemas.crack_report import CrackReport

SERVER = "http://127.0.0.1:4200/api"


@contextlib.contextmanager
def server() -> Iterator[None]:
    """Prefect talks to the configured server, or to that of `hairline serve`, or where none answers to one of
    its own."""
    from prefect.settings import PREFECT_API_URL, temporary_settings

    from flows.dead_runs import mark_dead_runs

    configured = PREFECT_API_URL.value()
    with contextlib.ExitStack() as opened:
        url = next(filter(answers, filter(None, (configured, SERVER))), None)
        if url is None:
            if configured:
                out.print(f"No Prefect server answers at {configured}; going on without a dashboard.")
            url = opened.enter_context(own_server())
        opened.enter_context(temporary_settings({PREFECT_API_URL: url}))
        mark_dead_runs()
        yield


@contextlib.contextmanager
def listening(dry: bool = False) -> Iterator[None]:
    from tasks import run

    with StageLines() as lines, run.running(run.Run(listener=lines, dry=dry, lay_out=not dry)):
        yield


class NotAllCached(Exception):
    """Some stage has to run."""


def run_flow(
    inspection: str,
    out: str | None,
    redo: tuple[str, ...] = (),
    photos: str | None = None,
    logs: tuple[str, ...] = (),
) -> CrackReport | None:
    """From the cache alone where every result is there, which takes no Prefect run; else as a flow run."""
    from flows.inspect_bridge import inspect_bridge
    from tasks import run
    from tasks.stage import NotYetKnown

    events: list[run.Event] = []

    def all_cached(event: run.Event) -> None:
        if event.outcome == "will run":
            raise NotAllCached
        events.append(event)

    try:
        with run.running(run.Run(listener=all_cached, dry=True)):
            report = inspect_bridge.fn(inspection, out, redo, photos, logs)
    except (NotAllCached, NotYetKnown):
        with server(), listening():
            return inspect_bridge(inspection, out, redo, photos, logs)
    with StageLines() as lines:
        for event in events:
            lines(event)
    return report


def run_inspection(
    inspection: str, folder: Path | None, redo: tuple[str, ...], photos: Path | None, logs: tuple[Path, ...]
) -> int:
    from flows.battery_change import WaitingForBattery
    from flows.external_flight import WaitingForFlight
    from flows.inspection_file import read_inspection

    name = read_inspection(Path(inspection)).name  # a mistake in it is told before anything starts
    where = folder or Path("runs") / name
    out.print(f"Inspecting {plain(name)}")
    try:
        report = run_flow(inspection, _text(folder), redo, _text(photos), tuple(str(log) for log in logs))
    except WaitingForFlight:
        out.print(f"The plan is ready: {plain(str(where / 'plan'))}. Fly it, then:")
        out.print(f"  hairline run {shlex.quote(inspection)} --photos DIR --log FILE [FILE …]", markup=False)
        return EXIT_WAITING_FOR_FLIGHT
    except WaitingForBattery as waiting:
        out.print(f"{waiting} Change the battery, stand clear, then run again:")
        out.print(f"  hairline run {shlex.quote(inspection)}", markup=False)
        out.print(f"The vehicle takes off at once then, with battery {waiting.flown + 1}.")
        return EXIT_WAITING_FOR_FLIGHT
    say_results(report, where)
    return 0


def run_demo(scene: str, folder: Path | None) -> int:
    from flows.opening import opened
    from tasks.simulation.task import score, score_table, simulation_truth

    out.print(f"Inspecting the simulated {scene}")
    demo = f"demo:{scene}"
    report = run_flow(demo, _text(folder))
    with opened(demo, _text(folder)) as run:
        if report is not None and run.inspection.simulation is not None:
            truth = simulation_truth.bare(run.inspection.simulation)
            out.print("\nAgainst the simulator's truth, which the inspection never reads:")
            out.print(score_table(score.bare(report, truth)))
    say_results(report, run.folder)
    return 0


def dry_run(inspection: str, folder: Path | None, redo: tuple[str, ...]) -> int:
    """Say of each stage whether it is cached or will run; execute none."""
    from flows.external_flight import WaitingForFlight
    from flows.inspect_bridge import inspect_bridge
    from tasks.stage import NotYetKnown

    later = False
    with listening(dry=True):
        try:
            inspect_bridge.fn(inspection, _text(folder), redo)
        except NotYetKnown:
            later = True
        except WaitingForFlight:
            out.print("  then it waits for the external flight")
    if later:
        out.print("  → every stage after these will run: its inputs are not known yet")
    return 0


def say_results(report: CrackReport | None, folder: Path) -> None:
    """Where the results are; the last line is a warning where something was not inspected."""
    if report is None:
        made = "plan" if (folder / "plan").is_dir() else "surfaces"
        out.print(f"\nThe {made}: {plain(str(folder / made))}")
        return
    widths = [crack.width_max_mm for crack in report.cracks if crack.width_max_mm is not None]
    widest = f", the widest {max(widths):.1f} mm" if widths else ""
    out.print(
        f"\n{len(report.cracks)} cracks{widest}. Report: {plain(str(folder / 'report' / 'index.html'))}"
    )
    if report.not_inspected:
        first = report.not_inspected[0]
        more = (
            f" (and {len(report.not_inspected) - 1} more, listed in the report)"
            if (len(report.not_inspected) > 1)
            else ""
        )
        text = f"Warning: not inspected: {first.item}: {first.what}{more}"
        out.print(f"[yellow]{plain(text)}[/yellow]")


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
