"""Flight logs of any kind: which it is, and what it holds."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from schemas.problem import BadInput
from tasks.flight.dataflash_log import read_dataflash_log
from tasks.flight.place import Place
from tasks.flight.recording import Fix, Recorder, Recording, Trigger, archive
from tasks.flight.telemetry_log import frames, read_telemetry_log
from tasks.flight.ulog_log import read_ulog

Kind = Literal["mcap", "tlog", "dataflash", "ulog"]
BLOCK_BYTES = 32 * 1024
MAGIC: dict[bytes, Kind] = {b"\x89MCAP0\r\n": "mcap", b"ULog\x01\x12\x35": "ulog", b"\xa3\x95": "dataflash"}
GIVE = "Give a telemetry log (tlog), an ArduPilot log (BIN), a PX4 log (ulg) or an archived flight.mcap"


def kind_of_log(path: Path, name: str) -> Kind:
    """By the file's first bytes, whatever its name says. BadInput where it is no flight log."""
    try:
        with path.open("rb") as stream:
            start = stream.read(8)
    except OSError as error:
        raise BadInput(name, f"cannot be read ({error.strerror})", GIVE) from None
    if not start:
        raise BadInput(name, "the file is empty", GIVE)
    for magic, kind in MAGIC.items():
        if start.startswith(magic):
            return kind
    if next(frames(path), None) is not None:
        return "tlog"
    raise BadInput(name, "is no flight log that Hairline knows", GIVE)


def read_log(path: Path, kind: Kind, name: str, recorder: Recorder | None = None) -> Recording:
    """The recording of a tlog, BIN or ulg; with a recorder everything in it is archived too."""
    if kind == "tlog":
        return read_telemetry_log(path, recorder)
    readers: dict[Kind, Callable[[Path], Recording]] = {"dataflash": read_dataflash_log, "ulog": read_ulog}
    try:
        recording = readers[kind](path)
    except Exception as error:  # the libraries raise whatever a broken file makes them stumble over
        raise BadInput(
            name, f"the log is damaged ({type(error).__name__}: {error})", "Copy it from the vehicle again"
        ) from None
    if recorder is not None:
        _archive_all(path, recording, recorder)
    return recording


def _archive_all(path: Path, recording: Recording, recorder: Recorder) -> None:
    """Fixes and triggers by their time, and the log's own bytes before them."""
    start_ns = round(recording.fixes[0].time_s * 1e6) * 1000 if recording.fixes else 0
    with path.open("rb") as stream:
        while block := stream.read(BLOCK_BYTES):
            recorder.original(start_ns, block)
    if not recording.fixes:
        return
    place = Place.of_log(recording)
    events: list[tuple[float, Fix | Trigger]] = [(fix.time_s, fix) for fix in recording.fixes]
    events += [(trigger.fix.time_s, trigger) for trigger in recording.triggers]
    for time_s, read in sorted(events, key=lambda event: event[0]):
        archive(recorder, round(time_s * 1e6) * 1000, read, place.world_pose)
