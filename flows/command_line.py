"""The `hairline` command."""

import os
import shlex
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal

import cyclopts
from cyclopts import Parameter

from flows.console import err, out, plain
from schemas.problem import BadInput

app = cyclopts.App(
    name="hairline",
    help="Crack inspection of bridges and buildings by drone: laser scans and photos in, a crack report in "
    "millimetres out. Every path may be relative; lengths are metres and millimetres as their names say.",
    version="0.1.0",
    usage="Usage: hairline COMMAND [OPTIONS]",
    suppress_keyboard_interrupt=False,  # main() says what is kept
)
Out = Annotated[Path | None, Parameter(name="--out")]

KEPT = "finished stages are kept"

EXIT_UNUSABLE_INPUT = 2
EXIT_WAITING_FOR_FLIGHT = 3


@app.command
def demo(*, scene: Literal["bridge", "wall"] = "bridge", out: Out = None) -> int:
    """Inspect a simulated structure from raw data to the report, and score the result against its truth.

    Parameters
    ----------
    scene:
        bridge: laser scans, plan, rehearsed flight, photos, cracks. wall: the paper's wooden wall.
    out:
        The run's folder. Default: runs/demo (runs/demo-wall).
    """
    from flows.running import run_demo

    return run_demo(scene, out)


@app.command
def run(
    inspection: Path,
    *,
    out: Out = None,
    redo: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (),
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    photos: Path | None = None,
    log: Annotated[tuple[Path, ...], Parameter(consume_multiple=True)] = (),
) -> int:
    """Run an inspection: every stage that its inputs allow, finished ones from the cache.

    Exit codes: 0 finished, 2 unusable input, 3 waiting for an external flight or a vehicle's next battery.

    Parameters
    ----------
    inspection:
        The YAML file; `hairline init FOLDER` writes one.
    out:
        The run's folder. Default: runs/NAME.
    redo:
        Stages to run again although they are cached, e.g. --redo stitch detect.
    dry_run:
        Only say for each stage whether it is cached or will run, and why.
    photos:
        Folder of an external flight's photos.
    log:
        Log of an external flight (tlog, BIN, ulg, mcap); of several flights all of them, or their folder.
    """
    from flows.running import dry_run as only_look
    from flows.running import run_inspection

    if dry_run:
        return only_look(str(inspection), out, redo)
    return run_inspection(str(inspection), out, redo, photos, log)


@app.command
def init(folder: Path, *, name: str | None = None) -> int:
    """Write FOLDER/inspection.yaml from the scans, photos and logs found there, each setting explained.

    Parameters
    ----------
    folder:
        Holds scans (ply, pcd, xyz, csv, pts, ptx, e57, las, laz), folders of photos, flight logs.
    name:
        The inspection's name. Default: the folder's.
    """
    from flows.init_inspection import init_inspection

    path = init_inspection(folder, name)
    out.print(plain(f"Wrote {path}. Check it, then: hairline run {shlex.quote(str(path))}"))
    return 0


@app.command
def serve(*, port: int = 4200, report_port: int = 4201) -> int:
    """Serve the dashboard, the deployments and the reports until interrupted.

    Starts a Prefect server if none answers, serves the deployments model-structure, collect-images,
    detect-cracks and inspect-bridge, and hosts runs/ so that the dashboard can link to reports.

    Parameters
    ----------
    port:
        TCP port of the Prefect server, on this machine only.
    report_port:
        TCP port of the report host, on this machine only.
    """
    from flows.serving import serve_everything

    return serve_everything(port, report_port)


def add_commands() -> None:
    """Each module adds its commands to the app as it is imported."""
    import flows.calibrate_command
    import flows.evaluate_command
    import flows.flight_commands
    import flows.photo_commands
    import flows.plan_command
    import flows.structure_commands
    import flows.watch_command  # noqa: F401


def main() -> None:
    """Entry point: one clear message for what a user can mend, never a bare traceback."""
    os.environ.setdefault("PREFECT_LOGGING_LEVEL", "CRITICAL")
    os.environ.setdefault("PREFECT_SERVER_LOGGING_LEVEL", "CRITICAL")  # it logs tracebacks when it is stopped
    os.environ.setdefault("PREFECT_SERVER_ANALYTICS_ENABLED", "false")
    os.environ.setdefault("DO_NOT_TRACK", "1")
    add_commands()

    try:
        result: Any = app(exit_on_error=False)
        code = result if isinstance(result, int) else 0
    except BadInput as problem:
        _say("Error", str(problem))
        code = EXIT_UNUSABLE_INPUT
    except cyclopts.CycloptsError:  # cyclopts has said what is wrong with the words of the command
        code = EXIT_UNUSABLE_INPUT
    except KeyboardInterrupt:
        goes_on = f"{KEPT}; the same command goes on from there."
        _say("Interrupted", goes_on if _keeps_stages() else "the command was stopped.")
        code = 130
    except Exception as problem:
        _say("Unexpected error", _for_a_bug_report(problem))
        code = 1
    sys.stdout.flush()
    sys.exit(code)


def _keeps_stages() -> bool:
    """Whether the command is one that goes on where it stopped; the others start anew."""
    return sys.argv[1:2] in (["run"], ["demo"])


def _say(kind: str, text: str) -> None:
    err.print(f"[bold red]{kind}:[/bold red] {plain(text)}")


def _for_a_bug_report(problem: Exception) -> str:
    path = Path("hairline-error.txt").resolve()
    where = f"{path} has the details"
    try:
        path.write_text("".join(traceback.format_exception(problem)), encoding="utf-8")
    except OSError:
        where = "its details could not be written here"
        with suppress(OSError):
            path.unlink()  # what of it a full disk took
    first_line = str(problem).splitlines()[0] if str(problem) else ""
    kept = f"; {KEPT}" if _keeps_stages() else ""
    return f"{type(problem).__name__}: {first_line} ({where}{kept})"
