"""ArduPilot's on-board logs of older and newer firmware, written here byte by byte."""

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from tasks.flight.dataflash_log import read_dataflash_log

HEAD = b"\xa3\x95"
CODES = {
    "Q": "Q",
    "I": "I",
    "H": "H",
    "L": "i",
    "e": "i",
    "c": "h",
    "C": "H",
    "B": "B",
    "n": "4s",
    "Z": "64s",
}
FORMATS = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "GPS": (151, "QBLLe", "TimeUS,Status,Lat,Lng,Alt"),
    "EV": (152, "QB", "TimeUS,Id"),
}
SECOND = {
    "GPS": (151, "QBBLLe", "TimeUS,I,Status,Lat,Lng,Alt"),
    "CAM": (153, "QBIHLLeeeccC", "TimeUS,I,GPSTime,GPSWeek,Lat,Lng,Alt,RelAlt,GPSAlt,R,P,Y"),
}
CAMERA = "TimeUS,GPSTime,GPSWeek,Lat,Lng,Alt,RelAlt,GPSAlt"


def layout(kinds: str) -> struct.Struct:
    return struct.Struct("<" + "".join(CODES[kind] for kind in kinds))


def begun(formats: dict[str, tuple[int, str, str]]) -> tuple[bytes, Callable[..., bytes]]:
    """A log's head, and what writes its messages."""
    log = b""
    for name, (number, kinds, columns) in formats.items():
        length = 89 if name == "FMT" else 3 + layout(kinds).size
        named = (name.encode(), kinds.encode(), columns.encode())
        log += HEAD + struct.pack("<BBB4s16s64s", 128, number, length, *named)

    def tell(name: str, *values: int) -> bytes:
        number, kinds, _ = formats[name]
        return HEAD + bytes([number]) + layout(kinds).pack(*values)

    return log, tell


def written(path: Path, attitude: str) -> Path:
    """A second of flight with one exposure; `attitude`: the names of its last three columns."""
    formats = FORMATS | {"CAM": (153, "QIHLLeeeccC", f"{CAMERA},{attitude}")}
    log, tell = begun(formats)
    log += tell("EV", 1_000_000, 10)
    for time_us in range(1_000_000, 2_000_000, 100_000):
        log += tell("GPS", time_us, 3, 500_000_000, 80_000_000, 12_000)
    log += tell("CAM", 1_500_000, 0, 2100, 500_000_000, 80_000_000, 12_450, 450, 12_400, 100, -1250, 27_010)
    log += tell("EV", 2_000_000, 11)
    path.write_bytes(log)
    return path


@pytest.mark.parametrize("attitude", ["R,P,Y", "Roll,Pitch,Yaw"])
def test_exposures_of_older_and_newer_firmware(attitude: str, tmp_path: Path) -> None:
    recording = read_dataflash_log(written(tmp_path / "flight.BIN", attitude))
    (trigger,) = recording.triggers
    assert trigger.fix.time_s == 1.5
    assert (trigger.pitch_deg, trigger.fix.yaw_deg) == (-12.5, 270.1)
    assert (trigger.fix.altitude_m, trigger.fix.height_m) == (124.5, 4.5)
    assert len(recording.fixes) == 10
    assert recording.armed_s == [(1.0, 2.0)]


def test_of_several_receivers_and_cameras_the_first_is_read(tmp_path: Path) -> None:
    log, tell = begun(FORMATS | SECOND)
    log += tell("EV", 1_000_000, 10)
    for time_us in range(1_000_000, 2_000_000, 100_000):
        for instance in (0, 1):
            log += tell("GPS", time_us, instance, 3, 500_000_000 + 90 * instance, 80_000_000, 12_000)
    for instance in (0, 1):
        place = (500_000_000, 80_000_000, 12_450, 450, 12_400)
        log += tell("CAM", 1_500_000 + instance, instance, 0, 2100, *place, 100, -1250, 27_010)
    (tmp_path / "two.BIN").write_bytes(log + tell("EV", 2_000_000, 11))
    recording = read_dataflash_log(tmp_path / "two.BIN")
    assert len(recording.triggers) == 1
    assert len(recording.fixes) == 10 and {fix.latitude_deg for fix in recording.fixes} == {50.0}
