"""The mission of the simulated vehicle: received, kept and told as ArduPilot does (MissionItemProtocol).

While it receives a mission it neither clears nor tells one, and gives up UPLOAD_S after the last item. What
came until then stays, and behind it the items of the mission before that were not replaced.
"""

import math
import time
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin
from schemas.mission import MissionItem
from tasks.simulation.trajectory import DO, NAVIGATION

CAPACITY = 700  # mission items
UPLOAD_S = 8.0  # MissionItemProtocol's upload_timeout_ms


class MissionMemory:
    """send: takes messages; on_mission_…: the handlers of what a station sends. lose_last_item: the fault."""

    def __init__(
        self,
        mav: mavlink.MAVLink,
        send: Callable[[Any], None],
        origin: GeoOrigin,
        home_m: Vector3,
        lose_last_item: bool,
    ) -> None:
        self.mav, self.send, self.origin, self.home_m = mav, send, origin, home_m
        self.lose_last_item = lose_last_item
        self.items: list[MissionItem] = []
        self.expected = self.received = 0  # items of the upload in progress; expected 0: none
        self._heard_s = 0.0  # when the upload went on last
        self.running = False  # the mission, and then it is not cleared

    def go_on(self) -> None:
        """Ask again for a mission item, or give up."""
        if self.expected and time.monotonic() - self._heard_s > UPLOAD_S:
            self.expected = 0
            self._ack(mavlink.MAV_MISSION_OPERATION_CANCELLED)
        elif self.expected:
            self.ask()

    def on_mission_count(self, message: Any) -> None:
        if message.count > CAPACITY:
            self._ack(mavlink.MAV_MISSION_NO_SPACE)
            return
        del self.items[message.count :]  # the others stay until they are replaced
        self.expected, self.received, self._heard_s = message.count, 0, time.monotonic()
        self.ask()

    def ask(self) -> None:
        self.send(self.mav.mission_request_encode(255, mavlink.MAV_COMP_ID_MISSIONPLANNER, self.received))

    def on_mission_item_int(self, message: Any) -> None:
        if not self.expected:
            self._ack(mavlink.MAV_MISSION_ERROR)
        elif message.seq != self.received:
            self._ack(mavlink.MAV_MISSION_INVALID_SEQUENCE)
        else:
            refusal = _refusal(message)
            if refusal is not None:
                self.expected = 0  # what came so far stays
                self._ack(refusal)
                return
            self.items[message.seq : message.seq + 1] = [_stored(message)]
            self.received, self._heard_s = self.received + 1, time.monotonic()
            if self.received < self.expected:
                self.ask()
            else:
                self.expected = 0
                if self.lose_last_item:
                    self.items.pop()
                self._ack(mavlink.MAV_MISSION_ACCEPTED)

    def on_mission_clear_all(self, message: Any) -> None:
        if self.expected or self.running:  # handle_mission_clear_all; AP_Mission::clear
            self._ack(mavlink.MAV_MISSION_ERROR)
            return
        self.items.clear()
        self._ack(mavlink.MAV_MISSION_ACCEPTED)

    def on_mission_request_list(self, message: Any) -> None:
        if self.expected:
            self._ack(mavlink.MAV_MISSION_DENIED)
            return
        self.send(self.mav.mission_count_encode(255, mavlink.MAV_COMP_ID_MISSIONPLANNER, len(self.items)))

    def on_mission_request_int(self, message: Any) -> None:
        if message.seq >= len(self.items):
            self._ack(mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return
        item = self.items[message.seq]
        x, y, z = item.x, item.y, item.z
        if item.seq == 0:
            latitude, longitude, z = self.origin.to_geographic(self.home_m)
            x, y = round(latitude * 1e7), round(longitude * 1e7)
        params = (item.param1, item.param2, item.param3, item.param4)
        self.send(
            self.mav.mission_item_int_encode(
                255,
                mavlink.MAV_COMP_ID_MISSIONPLANNER,
                item.seq,
                item.frame,
                item.command,
                0,
                1,
                *params,
                x,
                y,
                z,
            )
        )

    def _ack(self, result: int) -> None:
        self.send(self.mav.mission_ack_encode(255, mavlink.MAV_COMP_ID_MISSIONPLANNER, result))


def _refusal(message: Any) -> int | None:
    """Why ArduPilot would not take this item."""
    if message.command not in NAVIGATION + DO:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    if message.command in NAVIGATION:
        if message.frame not in (
            mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
            mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        ):
            return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
        if abs(message.x) > 900_000_000:
            return int(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    return None


def _stored(message: Any) -> MissionItem:
    """What ArduPilot keeps of an item: whole seconds of hold, centimetres, frame 3 or 0, no mount mode."""
    navigates = message.command in NAVIGATION
    mount = message.command == mavlink.MAV_CMD_DO_MOUNT_CONTROL
    waypoint = message.command == mavlink.MAV_CMD_NAV_WAYPOINT
    return MissionItem(
        seq=message.seq,
        frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT if navigates else mavlink.MAV_FRAME_GLOBAL,
        command=message.command,
        param1=float(int(message.param1)) if waypoint else _finite(message.param1),
        param2=0.0 if waypoint else _finite(message.param2),
        param3=_finite(message.param3),
        param4=0.0 if waypoint else _finite(message.param4),
        x=message.x,
        y=message.y,
        z=round(message.z, 2) if navigates else (0.0 if mount else message.z),
    )


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0
