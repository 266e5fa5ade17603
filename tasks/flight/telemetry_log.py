"""Telemetry logs (tlog): MAVLink frames, each behind eight bytes of the station's time."""

import mmap
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tasks.flight.mavlink_messages import READ, MessageReader
from tasks.flight.place import Place
from tasks.flight.recording import Recorder, Recording, archive

STAMP = struct.Struct(">Q")  # microseconds since 1970
EARLIEST_US, LATEST_US = 946_684_800_000_000, 4_102_444_800_000_000  # the years 2000 to 2100
MAVLINK_1, MAVLINK_2 = 0xFE, 0xFD


def frames(path: Path) -> Iterator[tuple[int, bytes]]:
    """Time in nanoseconds and bytes of each frame, also of those no dialect knows. Bytes between frames
    (a radio's noise, a truncated end) are passed over."""
    if path.stat().st_size < STAMP.size:
        return
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        decoder = Decoder()
        at, end = 0, _frame_end(data, 0)
        while at + STAMP.size < len(data):
            following = None if end is None else _frame_end(data, end)
            if end is not None:
                raw = data[at + STAMP.size : end]
                if following is not None or end == len(data) or decoder.decode(raw) is not None:
                    yield STAMP.unpack_from(data, at)[0] * 1000, raw
                    at, end = end, following
                    continue
            at += 1
            end = _frame_end(data, at)


def _frame_end(data: mmap.mmap, at: int) -> int | None:
    """Where the frame ends whose time stamp begins at `at`, by its own length."""
    if at + STAMP.size + 3 > len(data):
        return None
    if not EARLIEST_US < STAMP.unpack_from(data, at)[0] < LATEST_US:
        return None
    magic, length, flags = data[at + STAMP.size : at + STAMP.size + 3]
    if magic == MAVLINK_1:
        end = at + STAMP.size + 8 + length
    elif magic == MAVLINK_2:
        end = at + STAMP.size + 12 + length + (13 if flags & 1 else 0)  # a signature
    else:
        return None
    return end if end <= len(data) else None


def message_id(raw: bytes) -> int:
    """The id in a frame's header, of either MAVLink version."""
    return raw[5] if raw[0] == MAVLINK_1 else int.from_bytes(raw[7:10], "little")


class Decoder:
    """Frames to messages; what this dialect does not know or fails its checksum is None."""

    def __init__(self) -> None:
        self._mav = mavlink.MAVLink(None)

    def decode(self, raw: bytes) -> Any | None:
        try:
            return self._mav.decode(bytearray(raw))
        except (mavlink.MAVError, struct.error, UnicodeDecodeError, ValueError):
            return None


def read_frames(timed_frames: Iterator[tuple[int, bytes]], recorder: Recorder | None = None) -> Recording:
    """The recording of a stream of frames, archived on the way where a recorder is given."""
    reader, decoder = MessageReader(), Decoder()
    place: Place | None = None
    for time_ns, raw in timed_frames:
        if recorder is not None:
            recorder.frame(time_ns, raw)
        message = decoder.decode(raw) if message_id(raw) in READ else None
        read = reader.read(message, time_ns / 1e9) if message is not None else None
        if recorder is not None and read is not None and reader.recording.fixes:
            place = place or Place.of_log(reader.recording)
            archive(recorder, time_ns, read, place.world_pose)
    return reader.close()


def read_telemetry_log(path: Path, recorder: Recorder | None = None) -> Recording:
    return read_frames(frames(path), recorder)
