"""`hairline fly` and `convert-log`: a flight and its archive, on plain files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from artifacts.run_folder import lay_out
from flows.command_line import app
from flows.console import err, plain
from flows.option_types import Positive
from flows.plain_files import (
    OutFolder,
    read_contract,
    refuse_unless_file,
    say,
    working,
)
from schemas.problem import BadInput

if TYPE_CHECKING:
    pass


@app.command
def fly(
    plan: Path,
    *,
    connection: str,
    out: OutFolder,
    mission: str = "1",
    flight: int = 1,
    timeout_s: Positive = 30.0,
) -> None:
    """Upload a plan to a vehicle over MAVLink, fly it, archive it: D/flight.mcap, D/track.json.

    Parameters
    ----------
    plan:
        The plan.json of `hairline plan`.
    connection:
        MAVLink URL: udpin:0.0.0.0:14550, tcp:127.0.0.1:5760, /dev/ttyUSB0.
    out:
        Folder to write to.
    mission:
        Id of this flight.
    flight:
        Which of the plan's flights, from 1: one battery each.
    timeout_s:
        A vehicle silent for this long is lost, seconds.
    """
    from flows.results import write_flight
    from schemas.flight_plan import FlightPlan
    from tasks.flight.task import FlightCutShort
    from tasks.flight.task import fly as fly_plan

    flights = read_contract(plan, FlightPlan).each_flight
    if not 1 <= flight <= len(flights):
        raise BadInput("--flight", f"there is no flight {flight}", f"The plan has {len(flights)}")
    planned = flights[flight - 1]
    with working(out):
        try:
            log = fly_plan.bare(planned, mission, connection, timeout_s)
        except FlightCutShort as cut:
            lay_out(out, {"flight.mcap": cut.archive}, copy=True)
            raise cut.kept_in(out / "flight.mcap") from None
        write_flight(out, log, copy=True)
    of = f"flight {flight} of {len(flights)}: " if len(flights) > 1 else ""
    say(f"{of}{len(log.shots)} photos in {log.duration_s / 60:.1f} min: {out / 'flight.mcap'}")
    if log.missed:
        said = f"; the vehicle said: {'; '.join(log.said)}" if log.said else ""
        text = f"Warning: {len(log.missed)} planned photos were not shot, first {log.missed[0]}{said}"
        err.print(f"[yellow]{plain(text)}[/yellow]")


@app.command(name="convert-log")
def convert_log(log: Path, *, out: Annotated[Path, Parameter(name="--out")]) -> None:
    """Convert a flight log (tlog, BIN, ulg) to MCAP.

    Parameters
    ----------
    log:
        MAVLink telemetry (tlog), ArduPilot dataflash (BIN) or PX4 (ulg) log.
    out:
        The MCAP file to write.
    """
    from tasks.flight.task import convert

    refuse_unless_file(log, "Convert one log at a time")
    if out.is_dir():
        raise BadInput(str(out), "is a folder", "Give --out the name of the MCAP file to write")
    if out.exists() and out.samefile(log):
        raise BadInput(str(out), "is the log itself, which is kept", "Give another --out")
    with working(out.resolve().parent):
        recording = convert(log, out)
    times_s = [fix.time_s for fix in recording.fixes]
    minutes = (max(times_s) - min(times_s)) / 60 if times_s else 0.0
    say(f"{minutes:.1f} min, {len(times_s):,} positions, {len(recording.triggers):,} photos: {out}")
    if not times_s:
        text = f"Warning: {log.name} holds no position: is it whole?"
        err.print(f"[yellow]{plain(text)}[/yellow]")
