"""Fly a mission on ArduCopter: prepare on the ground, arm, AUTO, follow until it has landed and disarmed."""

import math
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.flight_plan import FlightPlan
from schemas.mission import MissionItem
from schemas.problem import BadInput
from tasks.flight.link import REMEDY, Link, LinkLost
from tasks.flight.mavlink_messages import MessageReader, vehicle_name
from tasks.flight.place import Place
from tasks.flight.recording import Fix, Recorder, Recording, archive
from tasks.flight.upload import abandon_mission, upload_mission
from tasks.flight.way_home import WayHome

AUTO, GUIDED = 3, 4  # ArduCopter's modes
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
COPTERS = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_COAXIAL,
    mavlink.MAV_TYPE_HELICOPTER,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
    mavlink.MAV_TYPE_DODECAROTOR,
)
RATES_HZ = {
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 10.0,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 2.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
}
LEAST_OFF_M = 0.1  # nobody places a vehicle better
ARM_RETRY_S = 2.0
START_S = 20.0  # from an accepted start to a vehicle that says it is armed
AIRBORNE_M = 0.5


class FlightLost(Exception):
    """The flight is no longer followed. recording: what was received so far; left: what of its settings stays
    changed on the vehicle, in words; why: None where the link broke."""

    def __init__(self, recording: Recording, left: str | None, why: str | None = None) -> None:
        super().__init__(recording, left, why)
        self.recording, self.left, self.why = recording, left, why


class Flight:
    """One flight over one link. `prepare` on the ground, then `execute` with a recorder."""

    def __init__(self, link: Link, plan: FlightPlan, items: tuple[MissionItem, ...]) -> None:
        self.link, self.plan, self.items = link, plan, items
        self.place = Place.of_plan(plan)
        self.reader = MessageReader()
        # Around the climb from home the plan keeps everything away by the vehicle's radius, its position
        # error and the clearance: a vehicle no farther off than the clearance meets nothing.
        self.off_home_m = max(plan.vehicle.clearance_m, LEAST_OFF_M)
        self._recorder: Recorder | None = None
        self._next_recorder: Recorder | None = None
        self._way_home: WayHome | None = None
        link.on_message = self._on_message

    # -- on the ground ---------------------------------------------------------------------------------

    def prepare(self) -> str:
        """Find the vehicle, check it, upload the mission, set its way home; its name. Raises BadInput."""
        try:
            return self._prepared()
        except LinkLost:
            what = f"the vehicle was not heard for {self.link.timeout_s:g} s, before it was armed"
            raise BadInput(self.link.url, what, REMEDY) from None

    def _prepared(self) -> str:
        heartbeat = self.link.find_vehicle()
        self.reader.source = self.link.source
        self._check_kind(heartbeat)
        self._ask_name()
        for message, rate_hz in RATES_HZ.items():
            self.link.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message, 1e6 / rate_hz, attempts=4)
        self._check_place()
        if heartbeat.custom_mode == AUTO:  # where it stays after a flight, and no mission can be cleared
            self._set_mode(GUIDED)
        upload_mission(self.link, self.items)
        self._way_home = WayHome(self.link, self.plan)
        return self.reader.recording.vehicle

    @property
    def way_home(self) -> tuple[str, ...]:
        """What was changed of a failsafe's way home, and what is to be known of it."""
        return tuple(self._way_home.told) if self._way_home else ()

    def _check_kind(self, heartbeat: Any) -> None:
        if heartbeat.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA or heartbeat.type not in COPTERS:
            raise BadInput(
                self.link.url,
                "the vehicle that answers is no ArduCopter, and the mission is made for one",
                "Connect an ArduCopter, or fly the waypoints of mission.csv or mission.kml with the vehicle's"
                " own ground station and bring its log (PX4 refuses mission.plan: it lacks CONDITION_YAW)",
            )
        if heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED:
            raise BadInput(
                self.link.url, "the vehicle is armed already", "Land and disarm it, then fly the plan again"
            )

    def _ask_name(self) -> None:
        for _ in range(3):
            self.link.command(mavlink.MAV_CMD_DO_SEND_BANNER, attempts=4)
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                if vehicle_name(self.reader.recording.vehicle) is not None:
                    return
                self.link.receive(0.1)

    def _check_place(self) -> None:
        fixes = self.reader.recording.fixes
        until = time.monotonic() + 2 * self.link.timeout_s  # a vehicle just switched on looks for satellites
        while not fixes and time.monotonic() < until:
            self.link.receive(0.2)
        if not fixes:
            raise BadInput(
                self.link.url,
                "the vehicle does not know where it is",
                "Wait until it has a GPS position, then fly the plan again",
            )
        self._check_stand(fixes[-1])

    def _check_stand(self, fix: Fix) -> None:
        x, y, _ = self.place.world_m(fix)
        off_m = math.hypot(x - self.plan.home_m[0], y - self.plan.home_m[1])
        if off_m > self.off_home_m:
            latitude, longitude, altitude = self.plan.origin.to_geographic(self.plan.home_m)
            raise BadInput(
                self.link.url,
                f"the vehicle stands {off_m:.1f} m from the plan's home, and no farther than"
                f" {self.off_home_m:g} m from it is the way up known to be free",
                f"Carry it to {latitude:.7f}, {longitude:.7f}, or plan again with another home_m or origin"
                f" (start ArduPilot's simulator with --home {latitude:.7f},{longitude:.7f},{altitude:.0f},0)",
            )

    # -- in the air ------------------------------------------------------------------------------------

    def execute(self, recorder: Recorder, on_progress: Callable[[float], None]) -> Recording:
        """Arm, fly, follow to disarming; everything from the arming on goes to the recorder.

        Raises BadInput where the flight does not begin (the mission is cleared then), FlightLost where the
        link breaks in the air, the disk is full, or Ctrl-C: the vehicle flies on by itself.
        """
        try:
            self._arm(recorder)
            self._check_armed()
            self._start()
        except LinkLost:
            raise self._lost() from None
        except BaseException:
            self.stand_down()
            raise
        try:
            self._follow(on_progress)
        except LinkLost:
            raise self._lost() from None
        except KeyboardInterrupt:
            raise self._lost("following the flight was interrupted") from None
        except OSError as problem:
            raise self._lost(f"its flight cannot be archived any more ({problem.strerror})") from None
        landed = not self.reader.armed and bool(self.reader.recording.armed_s)
        recording = self.reader.close()
        self._recorder = None
        if max((fix.height_m for fix in recording.fixes), default=0.0) < AIRBORNE_M:
            self.stand_down()
            raise self._problem("the vehicle armed but did not take off")
        if landed:
            self._give_back()
        return recording

    def _arm(self, recorder: Recorder) -> None:
        """Into GUIDED, in which it arms without a radio's throttle, and armed. Just after power-up both are
        refused until the filters have settled."""
        until = time.monotonic() + 2 * self.link.timeout_s
        self.reader.recording.said.clear()
        self._next_recorder = recorder
        while True:
            refusal = "the vehicle does not change to GUIDED"
            if self._set_mode(GUIDED):
                refusal = "the vehicle refuses to arm"
                if self.link.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == ACCEPTED:
                    return
            if time.monotonic() + ARM_RETRY_S > until:
                raise self._problem(refusal)
            self.link.expect((), ARM_RETRY_S)

    def _set_mode(self, mode: int) -> bool:
        custom = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        return bool(self.link.command(mavlink.MAV_CMD_DO_SET_MODE, custom, mode) == ACCEPTED)

    def _check_armed(self) -> None:
        """Place again, which satellite receivers just switched on know badly; and height: on arming an
        ArduCopter sets its home where it stands, unless somebody has set another."""
        fixes = self.reader.recording.fixes
        until = time.monotonic() + self.link.timeout_s
        while not fixes and time.monotonic() < until:
            self.link.receive(0.2)
        if not fixes:
            raise self._problem("the vehicle does not tell its height")
        self._check_stand(fixes[-1])
        height_m = fixes[-1].height_m
        if abs(height_m) > self.off_home_m:
            raise BadInput(
                self.link.url,
                f"on the ground the vehicle counts its height as {height_m:.1f} m: its whole flight would be"
                f" off by as much, and {self.off_home_m:g} m are allowed",
                "Restart it at the plan's home, or set its home there, then fly the plan again",
            )
        fixes.clear()  # those of before the flight

    def _start(self) -> None:
        if not self._set_mode(AUTO):
            raise self._problem("the vehicle does not change to AUTO")
        result = self.link.command(mavlink.MAV_CMD_MISSION_START)
        if result != ACCEPTED and not self.reader.recording.armed_s:
            raise self._problem("the vehicle does not start the mission")

    def _follow(self, on_progress: Callable[[float], None]) -> None:
        began = time.monotonic()
        told = -1
        while self.reader.armed or not self.reader.recording.armed_s:
            self.link.receive(1.0)
            if self.reader.mission_item != told:
                told = self.reader.mission_item
                on_progress(min(1.0, told / len(self.items)))
            if not self.reader.recording.armed_s and time.monotonic() - began > START_S:
                return

    def stand_down(self) -> None:
        """On the ground, after a failure: motors off, its own way home, no mission left. In the air the first
        is not obeyed, and the plan's way home is needed. Nothing more is archived: the disk may be full."""
        self._recorder = self._next_recorder = None
        try:
            if self.link.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, attempts=3) == ACCEPTED:
                self._set_mode(GUIDED)  # in AUTO no mission can be cleared
                self._give_back()
        except LinkLost:
            return
        abandon_mission(self.link)

    def _lost(self, why: str | None = None) -> FlightLost:
        left = self._way_home.left if self._way_home else None
        return FlightLost(self.reader.close(), left, why)

    def _give_back(self) -> None:
        if self._way_home is not None:
            with suppress(LinkLost):
                self._way_home.give_back()

    def _problem(self, what: str) -> BadInput:
        said = "; ".join(dict.fromkeys(text.strip() for _, text in self.reader.recording.said[-5:]))
        return BadInput(
            self.link.url,
            f"{what}; it says: {said}" if said else what,
            "Make the vehicle ready (its ground station shows the same messages), then fly the plan again",
        )

    # -- what is heard ---------------------------------------------------------------------------------

    def _on_message(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "COMMAND_ACK" and self._recorder is None and _armed(message):
            self._recorder = self._next_recorder
            self.reader.recording.fixes.clear()
            self.reader.recording.said.clear()
        read = self.reader.read(message, time.monotonic())
        if self._recorder is not None:
            time_ns = round(self.reader.clock_s * 1000) * 1_000_000
            self._recorder.frame(time_ns, bytes(message.get_msgbuf()))
            archive(self._recorder, time_ns, read, self.place.world_pose)


def _armed(ack: Any) -> bool:
    return bool(ack.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM and ack.result == ACCEPTED)
