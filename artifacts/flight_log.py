"""The flight's archive: an MCAP file that loses nothing, and that viewers draw.

/mavlink          every MAVLink frame of the vehicle, byte for byte (its messages' encoding: "mavlink")
/original         the blocks of a log of another kind, in order, byte for byte
/location, /pose  the vehicle: foxglove.LocationFix; foxglove.PoseInFrame in the world (ENU)
/camera/…         the same at each camera trigger

Times are the vehicle's own, never this machine's: the same simulated flight gives the same bytes. Chunks
end after a second of flight, so that a killed process loses no more than that.
"""

import math
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from artifacts.viewer_schemas import LocationFix, PoseInFrame, descriptor_set
from schemas.contract import Vector3
from schemas.problem import BadInput

MAVLINK, ORIGINAL = "/mavlink", "/original"
CHUNK_BYTES = 64 * 1024
CHUNK_NS = 1_000_000_000
BROKEN = (
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
)  # what the reader raises on a damaged file
LARGEST_RECORD_BYTES = 256 * 2**20  # a longer one is a broken length, not a flight


class FlightArchive:
    """Writes an archive. Leaving the `with` block finishes the file, after an exception too."""

    def __init__(self, path: Path, about: dict[str, str]) -> None:
        """about: what the reader must know before the first message (vehicle, origin, kind of log)."""
        self._stream = path.open("wb")
        self._writer = Writer(
            self._stream,
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library="hairline")
        self._writer.add_metadata("hairline", about)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._chunk_start_ns: int | None = None
        self._stream.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(*((OSError,) if error is not None else ())), self._stream:  # the first error is told
            self._writer.finish()  # type: ignore[no-untyped-call]

    def frame(self, time_ns: int, raw: bytes) -> None:
        self._add(MAVLINK, time_ns, raw, "mavlink")

    def original(self, time_ns: int, block: bytes) -> None:
        self._add(ORIGINAL, time_ns, block, "octet-stream")

    def location(
        self, time_ns: int, latitude_deg: float, longitude_deg: float, altitude_m: float, of: str = ""
    ) -> None:
        """of: "" for the vehicle, "/camera" for a trigger."""
        message = LocationFix(
            latitude=latitude_deg, longitude=longitude_deg, altitude=altitude_m, frame_id="earth"
        )
        self._add_typed(f"{of}/location", time_ns, message)

    def pose(
        self, time_ns: int, position_m: Vector3, yaw_deg: float, pitch_deg: float = 0.0, of: str = ""
    ) -> None:
        """Position in the world (ENU) and heading; the pose's x axis points where the nose (lens) does."""
        message = PoseInFrame(frame_id="world")
        where, turned = message.pose.position, message.pose.orientation
        where.x, where.y, where.z = position_m
        half_yaw, half_tilt = math.radians(90.0 - yaw_deg) / 2, -math.radians(pitch_deg) / 2
        turned.x = -math.sin(half_yaw) * math.sin(half_tilt)  # turn about z (up), then about y (left)
        turned.y = math.cos(half_yaw) * math.sin(half_tilt)
        turned.z = math.sin(half_yaw) * math.cos(half_tilt)
        turned.w = math.cos(half_yaw) * math.cos(half_tilt)
        self._add_typed(f"{of}/pose", time_ns, message)

    def _add_typed(self, topic: str, time_ns: int, message: Any) -> None:
        message.timestamp.seconds, message.timestamp.nanos = divmod(time_ns, 1_000_000_000)
        self._add(topic, time_ns, message.SerializeToString(deterministic=True), "protobuf", type(message))

    def _add(
        self, topic: str, time_ns: int, data: bytes, encoding: str, message_class: Any | None = None
    ) -> None:
        if topic not in self._channels:
            schema = 0
            if message_class is not None:
                name = message_class.DESCRIPTOR.full_name
                if name not in self._schemas:
                    self._schemas[name] = self._writer.register_schema(
                        name, "protobuf", descriptor_set(message_class)
                    )
                schema = self._schemas[name]
            self._channels[topic] = self._writer.register_channel(topic, encoding, schema)
        self._writer.add_message(self._channels[topic], log_time=time_ns, data=data, publish_time=time_ns)
        if self._chunk_start_ns is None:
            self._chunk_start_ns = time_ns
        elif abs(time_ns - self._chunk_start_ns) >= CHUNK_NS:
            self._writer.flush()  # type: ignore[no-untyped-call]
            self._chunk_start_ns = None


def about(path: Path, name: str) -> dict[str, str]:
    """What the archive says about itself. BadInput, naming `name`, where it is none of ours."""
    for record in _records(path):
        if isinstance(record, Metadata) and record.name == "hairline":
            return dict(record.metadata)
        if isinstance(record, Chunk):
            break
    raise BadInput(
        name,
        "is an MCAP file, but no flight that Hairline archived",
        "Give the vehicle's own log (tlog, BIN, ulg) or a flight.mcap",
    )


def messages(path: Path) -> Iterator[tuple[str, int, bytes]]:
    """Topic, time in nanoseconds and bytes of every message, in the order of writing. Of a truncated file
    what is whole is read; a chunk that fails its CRC is left out."""
    channels: dict[int, str] = {}
    for chunk in _records(path):
        if not isinstance(chunk, Chunk):
            continue
        try:
            records = breakup_chunk(chunk, validate_crc=True)
        except BROKEN:
            continue
        for record in records:
            if isinstance(record, Channel):
                channels[record.id] = record.topic
            elif isinstance(record, Message) and record.channel_id in channels:
                yield channels[record.channel_id], record.log_time, record.data


def _records(path: Path) -> Iterator[Any]:
    with path.open("rb") as stream:
        reader = StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_RECORD_BYTES)
        try:
            yield from reader.records
        except BROKEN:
            return
