"""The MAVLink side of the simulated vehicle: commands and telemetry as ArduCopter has them.

On the ground it lives in real time. Once a mission starts its time is virtual: the whole flight is computed
from mission and seed and told as fast as the link takes it, every message with the vehicle's own time.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin, turned
from schemas.vehicle import Vehicle
from tasks.simulation.mission_memory import MissionMemory
from tasks.simulation.parameter_memory import ParameterMemory
from tasks.simulation.trajectory import STEP_S, Flown, fly_mission

SYSTEM, COMPONENT = 1, mavlink.MAV_COMP_ID_AUTOPILOT1
STABILIZE, AUTO, GUIDED, RTL = 0, 3, 4, 6  # ArduCopter's modes
BANNER = "ArduCopter simulated by Hairline"
YAW_WRONG = "Arm: AHRS: EKF3 Yaw inconsistent 34 deg. Wait or reboot"
TELEMETRY_S = 0.1
BOOT_MS = 30_000  # vehicle's clock when it arms


@dataclass(frozen=True)
class Faults:
    """What can go wrong, each with a switch."""

    loss: float = 0.0  # share of frames lost in either direction
    silent: bool = False  # takes the connection and says nothing
    refuse_arm: bool = False
    settling: int = 0  # so often it refuses to leave its mode: its position is not good enough yet
    lose_last_item: bool = False  # of an uploaded mission
    home_off_m: float = 0.0  # its own home, from which it counts heights, lies as far above the ground
    drift_m: float = 0.0  # as far north of where it stood does it stand after arming
    failsafe_s: float | None = None  # the battery is low at this time of the flight: it goes home
    vanish_s: float | None = None  # the link ends at this time of the flight
    in_metres: bool = False  # its parameters are called as from ArduCopter 4.7 on
    parameters: tuple[tuple[str, float], ...] = ()  # other than as delivered


class Vanished(Exception):
    """The fault `vanish_s`: hang up."""


class Autopilot:
    """send: takes the bytes of one frame."""

    def __init__(
        self,
        vehicle: Vehicle,
        origin: GeoOrigin,
        home_m: Vector3,
        seed: int,
        faults: Faults,
        send: Callable[[bytes], None],
    ) -> None:
        self.vehicle, self.origin, self.home_m, self.seed, self.faults = vehicle, origin, home_m, seed, faults
        self.mav = mavlink.MAVLink(None, srcSystem=SYSTEM, srcComponent=COMPONENT)
        self.mav.robust_parsing = True
        self._send_bytes = send
        self._loss = np.random.default_rng([seed, 0x6C6F7373])
        self.memory = MissionMemory(self.mav, self.send, origin, home_m, faults.lose_last_item)
        self.parameters = ParameterMemory(self.mav, self.send, faults.in_metres, faults.parameters)
        self.armed, self.mode = False, STABILIZE
        self._refused_modes = 0

    # -- link ------------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        for message in self.mav.parse_buffer(data) or []:
            if message.get_type() == "BAD_DATA" or self._lost():
                continue
            name = f"on_{message.get_type().lower()}"
            memories = (self.memory, self.parameters, self)
            handler = next((getattr(one, name) for one in memories if hasattr(one, name)), None)
            if handler is not None and getattr(message, "target_system", SYSTEM) == SYSTEM:
                handler(message)

    def send(self, message: Any) -> None:
        frame = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        if not self._lost():
            self._send_bytes(frame)

    def _lost(self) -> bool:
        return self.faults.silent or (self.faults.loss > 0 and float(self._loss.random()) < self.faults.loss)

    def heartbeat(self) -> None:
        mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self.armed:
            mode |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        state = mavlink.MAV_STATE_ACTIVE if self.armed else mavlink.MAV_STATE_STANDBY
        self.send(
            self.mav.heartbeat_encode(
                mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, self.mode, state
            )
        )

    def on_ground(self) -> None:
        """What it tells every second while it waits; it also asks again for a mission item, or gives up."""
        self.heartbeat()
        self.memory.go_on()
        self._stand()

    def _stand(self) -> None:
        east, north, up = self.home_m
        drifted_m = self.faults.drift_m if self.armed else 0.0
        self._position(0.0, (east, north + drifted_m, up), 0.0, (0.0, 0.0, 0.0))

    def _say(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> None:
        """In pieces where it is long, as GCS::send_textv does."""
        pieces = [text[i : i + 50].encode() for i in range(0, len(text), 50)]
        for number, piece in enumerate(pieces):
            self.send(self.mav.statustext_encode(severity, piece, int(len(pieces) > 1), number))

    # -- commands --------------------------------------------------------------------------------------

    def on_command_long(self, message: Any) -> None:
        accepted, denied = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
        result = accepted
        if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            result = self._arm() if message.param1 == 1.0 else self._disarm()
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            result = self._change_mode(int(message.param2))
        elif message.command == mavlink.MAV_CMD_MISSION_START:
            result = accepted if self.armed and len(self.memory.items) > 1 else denied
        elif message.command == mavlink.MAV_CMD_DO_SEND_BANNER:
            self._say(BANNER)
        elif message.command != mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            result = mavlink.MAV_RESULT_UNSUPPORTED
        self.send(self.mav.command_ack_encode(message.command, result))
        if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM and self.armed:
            self._stand()
        if message.command == mavlink.MAV_CMD_MISSION_START and result == accepted:
            self._enter(AUTO)
            self._fly()

    def _change_mode(self, mode: int) -> int:
        if self._refused_modes < self.faults.settling:
            self._refused_modes += 1
            self._say("Mode change to GUIDED failed: requires position", mavlink.MAV_SEVERITY_WARNING)
            return int(mavlink.MAV_RESULT_FAILED)
        self._enter(mode)
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _enter(self, mode: int) -> None:
        """In AUTO the mission runs, on the ground too, and after its end until the mode is left."""
        self.mode, self.memory.running = mode, mode == AUTO

    def _arm(self) -> int:
        if self.faults.refuse_arm:
            self._say("PreArm: Compass not calibrated", mavlink.MAV_SEVERITY_CRITICAL)
            self._say(YAW_WRONG, mavlink.MAV_SEVERITY_CRITICAL)
            return int(mavlink.MAV_RESULT_FAILED)
        if not self.armed:
            self.armed = True
            self.mav.seq = 0  # so that the flight's frames do not depend on what was said before
        return int(mavlink.MAV_RESULT_ACCEPTED)

    def _disarm(self) -> int:
        self.armed = False
        return int(mavlink.MAV_RESULT_ACCEPTED)

    # -- flight ----------------------------------------------------------------------------------------

    def _fly(self) -> None:
        flown = fly_mission(tuple(self.memory.items), self.origin, self.home_m, self.vehicle, self.seed)
        for time_s, tell in sorted(self._events(flown), key=lambda event: event[0]):  # stable
            if self.faults.vanish_s is not None and time_s >= self.faults.vanish_s:
                raise Vanished
            if self.faults.failsafe_s is not None and time_s >= self.faults.failsafe_s:
                self._enter(RTL)  # whose way home is not told
                self._say("Battery 1 is low 13.20V used 2500 mAh", mavlink.MAV_SEVERITY_WARNING)
                self.heartbeat()
                break
            tell()
        self.armed = False
        self.heartbeat()

    def _events(self, flown: Flown) -> Iterator[tuple[float, Callable[[], None]]]:
        """What it tells during the flight, each with its time, in no order."""
        velocity = np.gradient(flown.estimated_m, STEP_S, axis=0)
        every = round(TELEMETRY_S / STEP_S)
        for step in range(0, len(flown.time_s), every):
            time_s = float(flown.time_s[step])
            if step % (every * 10) == 0:
                yield time_s, self.heartbeat
            yield time_s, self._tell_position(flown, velocity, step)
        for seq, time_s in flown.reached:
            yield time_s, self._tell_reached(seq)
        for index, shot in enumerate(flown.shots):
            pose = shot.estimated_pose
            yield shot.time_s, self._tell_shot(shot.time_s, index, pose.position_m, pose.yaw_deg)

    def _tell_position(self, flown: Flown, velocity: Any, step: int) -> Callable[[], None]:
        def tell() -> None:
            x, y, z = (float(v) for v in flown.estimated_m[step])
            vx, vy, vz = (float(v) for v in velocity[step])
            self._position(
                float(flown.time_s[step]), (x, y, z), float(flown.estimated_yaw_deg[step]), (vx, vy, vz)
            )

        return tell

    def _tell_reached(self, seq: int) -> Callable[[], None]:
        def tell() -> None:
            self.send(self.mav.mission_item_reached_encode(seq))
            self.send(self.mav.mission_current_encode(min(seq + 1, len(self.memory.items) - 1)))

        return tell

    def _tell_shot(self, time_s: float, index: int, at_m: Vector3, yaw_deg: float) -> Callable[[], None]:
        def tell() -> None:
            latitude, longitude, altitude = self.origin.to_geographic(at_m)
            self.send(
                self.mav.camera_feedback_encode(
                    time_usec=self._clock_ms(time_s) * 1000,
                    target_system=SYSTEM,
                    cam_idx=0,
                    img_idx=index,
                    lat=round(latitude * 1e7),
                    lng=round(longitude * 1e7),
                    alt_msl=altitude,
                    alt_rel=at_m[2] - self.home_m[2],
                    roll=0.0,
                    pitch=0.0,
                    yaw=self.origin.compass_deg(yaw_deg),
                    foc_len=0.0,
                    flags=mavlink.CAMERA_FEEDBACK_PHOTO,
                )
            )

        return tell

    def _position(self, time_s: float, at_m: Vector3, yaw_deg: float, velocity_m_s: Vector3) -> None:
        clock = self._clock_ms(time_s)
        latitude, longitude, altitude = self.origin.to_geographic(at_m)
        east, north, up = (at - home for at, home in zip(at_m, self.home_m, strict=True))
        ve, vn, vu = velocity_m_s
        east, north = turned(east, north, self.origin.heading_deg)
        ve, vn = turned(ve, vn, self.origin.heading_deg)
        heading = self.origin.compass_deg(yaw_deg) % 360.0
        self.send(
            self.mav.attitude_encode(clock, 0.0, 0.0, math.radians((heading + 180) % 360 - 180), 0, 0, 0)
        )
        self.send(self.mav.local_position_ned_encode(clock, north, east, -up, vn, ve, -vu))
        self.send(
            self.mav.global_position_int_encode(
                clock,
                round(latitude * 1e7),
                round(longitude * 1e7),
                round(altitude * 1000),
                round((up - self.faults.home_off_m) * 1000),
                round(vn * 100),
                round(ve * 100),
                round(-vu * 100),
                round(heading * 100) % 36000,
            )
        )

    @staticmethod
    def _clock_ms(time_s: float) -> int:
        return BOOT_MS + round(time_s * 1000)
