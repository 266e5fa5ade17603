"""The one owner of the link to a vehicle: pymavlink's connection must never be used from two threads."""

import os
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

os.environ.setdefault("MAVLINK20", "1")  # how pymavlink is told to speak MAVLink 2

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.problem import BadInput
from tasks.flight.mavlink_messages import is_autopilot

STATION, STATION_COMPONENT = 255, mavlink.MAV_COMP_ID_MISSIONPLANNER  # ArduPilot's SYSID_MYGCS
HEARTBEAT_S = 1.0
RECONNECT_S = 0.5
SCHEMES = ("udp:", "udpin:", "udpout:", "tcp:")
REMEDY = (
    "Check that the vehicle is powered, that its telemetry goes to this address and port, and that no other"
    " program holds the link"
)


class LinkLost(Exception):
    """The vehicle was not heard for the time that the caller grants."""


class Link:
    """A connection to one vehicle: the first autopilot heard. Other systems on the link are ignored.

    url: udpin:127.0.0.1:14550, tcp:127.0.0.1:5760, /dev/ttyUSB0 or /dev/ttyUSB0,57600 (baud).
    timeout_s: without a frame from the vehicle for this long the link is lost.
    """

    def __init__(self, url: str, timeout_s: float) -> None:
        self.url, self.timeout_s = url, timeout_s
        self.on_message: Callable[[Any], None] | None = None  # sees every message of the vehicle
        self.source: tuple[int, int] | None = None
        self._closed_by_peer = False
        self._heard = self._started = time.monotonic()
        self._beat = self._retry = 0.0
        self._connection = self._first_connection()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._connection.close()

    @property
    def mav(self) -> Any:
        """Encodes and sends messages."""
        return self._connection.mav

    @property
    def target(self) -> tuple[int, int]:
        assert self.source is not None
        return self.source

    def find_vehicle(self) -> Any:
        """Wait for the first heartbeat of an autopilot and return it. BadInput where none comes."""
        try:
            while True:
                message = self.receive(0.5)
                if message is not None and message.get_type() == "HEARTBEAT" and is_autopilot(message):
                    self.source = (message.get_srcSystem(), message.get_srcComponent())
                    return message
        except LinkLost:
            what = f"no vehicle answered within {self.timeout_s:g} s"
            raise BadInput(self.url, what, REMEDY) from None

    def receive(self, wait_s: float) -> Any | None:
        """The next message of the vehicle, or None after `wait_s`. LinkLost where it is silent too long."""
        until = time.monotonic() + wait_s
        while True:
            self._beat_heart()
            message = self._next()
            now = time.monotonic()
            if message is not None and self._ours(message):
                if self.source is not None:
                    self._heard = now
                if self.on_message is not None:
                    self.on_message(message)
                return message
            if now - self._heard > self.timeout_s:
                raise LinkLost
            if message is None:
                if now >= until:
                    return None
                self._connection.select(min(until - now, 0.1))

    def expect(
        self, kinds: tuple[str, ...], wait_s: float, fits: Callable[[Any], bool] = lambda message: True
    ) -> Any | None:
        """The next message of one of these types, or None after `wait_s`."""
        until = time.monotonic() + wait_s
        while (left := until - time.monotonic()) > 0:
            message = self.receive(left)
            if message is not None and message.get_type() in kinds and fits(message):
                return message
        return None

    def command(self, command: int, *params: float, attempts: int = 8, wait_s: float = 1.5) -> int | None:
        """Send COMMAND_LONG until it is acknowledged; the MAV_RESULT, or None where no answer came."""
        padded = (*params, *([0.0] * (7 - len(params))))
        for attempt in range(attempts):
            self.mav.command_long_send(*self.target, command, attempt, *padded)
            ack = self.expect(("COMMAND_ACK",), wait_s, lambda m: m.command == command)
            while ack is not None and ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
                ack = self.expect(("COMMAND_ACK",), 10 * wait_s, lambda m: m.command == command)
            if ack is not None:
                return int(ack.result)
        return None

    # -- the connection --------------------------------------------------------------------------------

    def _first_connection(self) -> Any:
        if not self.url.startswith((*SCHEMES, "/dev/", "COM")):
            raise BadInput(
                self.url,
                "is no MAVLink connection",
                "Write udpin:127.0.0.1:14550, tcp:127.0.0.1:5760 or a serial port such as /dev/ttyUSB0,57600",
            )
        self._check_port()
        while True:
            try:
                return self._open()
            except ImportError:  # pymavlink loads pyserial when it first needs it
                raise BadInput(self.url, "a serial port needs pyserial", "pip install pyserial") from None
            except (OSError, ValueError) as error:  # pyserial's SerialException is an OSError
                refused = isinstance(error, ConnectionRefusedError)
                if not refused or time.monotonic() - self._started > self.timeout_s:
                    raise BadInput(self.url, f"cannot be opened ({error})", REMEDY) from None
                time.sleep(min(RECONNECT_S, self.timeout_s))

    def _check_port(self) -> None:
        if not self.url.startswith(SCHEMES):
            return
        port = self.url.split(",")[0].rpartition(":")[2]
        if self.url.count(":") < 2 or not (port.isascii() and port.isdigit() and int(port) < 65536):
            what = "ends with no port, 0 to 65535"
            raise BadInput(self.url, what, "Write udpin:127.0.0.1:14550 or tcp:127.0.0.1:5760")

    def _open(self) -> Any:
        device, _, baud = self.url.partition(",")
        connection = mavutil.mavlink_connection(
            device,
            baud=int(baud or 115200),
            dialect="ardupilotmega",
            source_system=STATION,
            source_component=STATION_COMPONENT,
            robust_parsing=True,
            retries=1,
        )
        connection.handle_eof = connection.handle_disconnect = self._hung_up
        return connection

    def _hung_up(self) -> None:
        self._closed_by_peer = True

    def _next(self) -> Any | None:
        if self._closed_by_peer and not self._reconnected():
            return None
        try:
            return self._connection.recv_msg()
        except OSError:
            self._closed_by_peer = True
            return None

    def _reconnected(self) -> bool:
        if time.monotonic() - self._retry < RECONNECT_S:
            time.sleep(0.05)
            return False
        self._retry = time.monotonic()
        try:
            fresh = self._open()
        except OSError:
            return False
        self._connection.close()
        self._connection, self._closed_by_peer = fresh, False
        return True

    def _ours(self, message: Any) -> bool:
        if message.get_type() == "BAD_DATA":
            return False
        speaker = (message.get_srcSystem(), message.get_srcComponent())
        return self.source is None or speaker == self.source

    def _beat_heart(self) -> None:
        if time.monotonic() - self._beat >= HEARTBEAT_S and not self._closed_by_peer:
            self._beat = time.monotonic()
            self.mav.heartbeat_send(
                mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE
            )
