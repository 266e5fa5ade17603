"""Fly a plan on a vehicle, or understand the log of a flight that others flew."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import disk_usage
from typing import TYPE_CHECKING, Any

from artifacts import store
from artifacts.flight_log import MAVLINK, ORIGINAL, FlightArchive, about, messages
from artifacts.page import Page
from schemas.file import File
from schemas.flight_log import FlightLog, joined
from schemas.flight_plan import FlightPlan
from schemas.mission import MissionItem, mission_items
from schemas.problem import BadInput
from tasks.stage import note, progress, stage

if TYPE_CHECKING:
    from tasks.flight.fly import FlightLost
    from tasks.flight.read_log import Kind
    from tasks.flight.recording import Recording

ARCHIVE = "flight.mcap"
LEAST_FREE_BYTES = 200_000_000  # the demo's flight of six minutes takes 1 MB; other vehicles send more
ROOM = "Free some disk where results are kept, then fly the plan again; nothing of it is left on the vehicle"


class FlightCutShort(BadInput):
    """A flight that was not followed to its end. archive: what was received until then, kept at `kept`."""

    def __init__(self, connection: str, what: str, then: str, archive: File, kept: Path) -> None:
        remedy = f"{then}. What was received is kept in {kept}; with the vehicle's own log, continue as an"
        super().__init__(connection, what, f"{remedy} external flight")
        self.args = (connection, what, then, archive, kept)
        self.then, self.archive = then, archive

    def kept_in(self, path: Path) -> "FlightCutShort":
        return FlightCutShort(self.item, self.what, self.then, self.archive, path)


def flight_pages(inputs: Mapping[str, Any], log: FlightLog) -> Sequence[Page]:
    errors = [
        {"where": e.what, "rms m": round(e.rms_m, 3), "largest m": round(e.largest_m, 3)} for e in log.errors
    ]
    shots = [
        {
            "photo": s.photo,
            "surface": s.surface or "",
            "time s": s.time_s,
            "position m": ", ".join(f"{v:.2f}" for v in s.pose.position_m),
            "yaw deg": round(s.pose.yaw_deg, 1),
            "reported": "yes" if s.reported else "from the track",
        }
        for s in log.shots
    ]
    summary = (
        f"**{log.vehicle}**, {log.duration_s / 60:.1f} min, {len(log.shots)} shots, {len(log.missed)} missed"
        + "".join(f"\n- way home: {text}" for text in log.way_home)
        + "".join(f"\n- the vehicle said: {text}" for text in log.said)
        + "".join(f"\n- not shot: {photo}" for photo in log.missed)
    )
    return [
        Page(key="flight", description="The flight", markdown=summary),
        Page(key="flight-track-error", description="Planned against flown path", table=errors),
        Page(key="flight-shots", description="Where each photo was taken", table=shots),
    ]


@stage(unkeyed=("connection", "timeout_s"), pages=flight_pages, effects=True)
def fly(plan: FlightPlan, mission: str, connection: str, timeout_s: float) -> FlightLog:
    """Fly a plan on the vehicle at `connection` and archive the flight.

    mission: id of this flight; another id flies again. timeout_s: a vehicle silent for this long is lost.
    """
    items = mission_items(plan)
    with store.current().scratch() as folder:
        free = disk_usage(folder).free
        if free < LEAST_FREE_BYTES:
            what = f"there are {free / 1e6:.0f} MB of disk left to archive its flight, and it may need"
            raise BadInput(connection, f"{what} {LEAST_FREE_BYTES / 1e6:.0f} MB", ROOM)
        return _flown(plan, items, connection, timeout_s, folder)


def _flown(
    plan: FlightPlan, items: tuple[MissionItem, ...], connection: str, timeout_s: float, folder: Path
) -> FlightLog:
    from tasks.flight.fly import Flight, FlightLost
    from tasks.flight.link import Link
    from tasks.flight.telling import Teller

    with Link(connection, timeout_s) as link:
        flight = Flight(link, plan, items)
        vehicle = flight.prepare()
        for text in flight.way_home:
            note(text)
        path = folder / ARCHIVE
        recording = None
        try:
            archive = FlightArchive(path, _about(vehicle, "mavlink", plan))
        except OSError as problem:
            flight.stand_down()
            raise _unarchived(connection, problem) from None
        try:
            with archive as recorder, Teller(progress) as tell:
                recording = flight.execute(recorder, tell)
        except FlightLost as lost:
            raise _cut_short(connection, timeout_s, lost, store.current().put(path)) from None
        except OSError as problem:
            if recording is None:  # before it took off
                raise _unarchived(connection, problem) from None
            note(f"The end of the flight's archive could not be written ({problem.strerror}). {ROOM}")
        recording.vehicle = vehicle
        log = _flight_log(recording, store.current().put(path), plan, connection)
        return log.model_copy(update={"way_home": flight.way_home})


@stage(pages=flight_pages)
def import_log(log: File, name: str, plan: FlightPlan | None) -> FlightLog:
    """Understand the log of an external flight (tlog, BIN, ulg, or an archived mcap). Of a plan of several
    flights it may be the log of any, or of more than one."""
    from tasks.flight.read_log import kind_of_log

    path = store.current().path(log)
    kind = kind_of_log(path, name)
    with store.current().scratch() as folder:
        if kind == "mcap":
            return _flight_log(_read_archive(path, name, folder), log, plan, name)
        converted = folder / ARCHIVE
        recording = _converted(path, kind, name, converted)
        return _flight_log(recording, store.current().put(converted), plan, name)


def refuse_unless_log(path: Path, name: str) -> None:
    """BadInput where a file is no flight log; its first bytes tell."""
    from tasks.flight.read_log import kind_of_log

    kind_of_log(path, name)


def convert(log: Path, out: Path) -> "Recording":
    """Convert a flight log (tlog, BIN, ulg) to MCAP, whole; gives what it holds. BadInput where it is none or
    damaged."""
    from tasks.flight.read_log import kind_of_log

    kind = kind_of_log(log, log.name)
    if kind == "mcap":
        raise BadInput(log.name, "is an MCAP file already", "Use it as it is")
    unfinished = out.with_name(f".{out.name}.unfinished")
    try:
        recording = _converted(log, kind, log.name, unfinished)
        unfinished.replace(out)
        return recording
    finally:
        unfinished.unlink(missing_ok=True)


def _converted(path: Path, kind: "Kind", name: str, out: Path) -> "Recording":
    from tasks.flight.read_log import read_log

    with FlightArchive(out, {"log": kind}) as recorder:
        return read_log(path, kind, name, recorder)


def _read_archive(path: Path, name: str, folder: Path) -> "Recording":
    """What an archive holds: its frames, or the original log inside it."""
    from tasks.flight.read_log import read_log
    from tasks.flight.telemetry_log import read_frames

    stated = about(path, name)
    kind = stated.get("log")
    if kind in ("dataflash", "ulog"):
        original = folder / "original"
        with original.open("wb") as stream:
            stream.writelines(data for topic, _, data in messages(path) if topic == ORIGINAL)
        return read_log(original, "dataflash" if kind == "dataflash" else "ulog", name)
    recording = read_frames((time_ns, data) for topic, time_ns, data in messages(path) if topic == MAVLINK)
    recording.vehicle = stated.get("vehicle", recording.vehicle)
    return recording


def _flight_log(recording: "Recording", archive: File, plan: FlightPlan | None, name: str) -> FlightLog:
    from tasks.flight.battery_flights import compare_with_flights

    return joined(
        [
            FlightLog(
                archive=archive,
                vehicle=recording.vehicle,
                duration_s=found.duration_s,
                track=found.track,
                shots=found.shots,
                errors=found.errors,
                missed=found.missed,
                said=found.said,
            )
            for found in compare_with_flights(recording, plan, name)
        ]
    )


def _about(vehicle: str, kind: str, plan: FlightPlan) -> dict[str, str]:
    origin = plan.origin
    return {
        "log": kind,
        "vehicle": vehicle,
        "origin": f"{origin.latitude_deg} {origin.longitude_deg} {origin.altitude_m}",
    }


def _unarchived(connection: str, problem: OSError) -> BadInput:
    return BadInput(connection, f"its flight cannot be archived ({problem.strerror})", ROOM)


def _cut_short(connection: str, timeout_s: float, lost: "FlightLost", archive: File) -> FlightCutShort:
    fixes = lost.recording.fixes
    flown_s = fixes[-1].time_s - fixes[0].time_s if fixes else 0.0
    if lost.why is not None:
        what = f"{lost.why}, {flown_s:.0f} s after arming"
        then = "The vehicle flies its mission on by itself: to stop it, take over by radio or ground station"
    else:
        what = f"the vehicle was not heard for {timeout_s:g} s, {flown_s:.0f} s after arming"
        then = "It follows its own failsafe"
    if lost.left is not None:
        then = f"{then}. {lost.left}"
    return FlightCutShort(connection, what, then, archive, store.current().path(archive))
