"""From MAVLink messages to fixes and triggers, one message after the other, live or from a log."""

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tasks.flight.recording import Fix, Recording, Trigger

READ = (  # message ids; a log's other messages need not be decoded
    mavlink.MAVLINK_MSG_ID_HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_ATTITUDE,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
    mavlink.MAVLINK_MSG_ID_CAMERA_FEEDBACK,
    mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED,
    mavlink.MAVLINK_MSG_ID_STATUSTEXT,
)
EXPOSURES = ("CAMERA_FEEDBACK", "CAMERA_IMAGE_CAPTURED")
PERIPHERALS = range(100, 255)  # component ids of cameras, gimbals, radios; autopilots have 1
REBOOT_S = 5.0  # a clock this far back is a new boot


class MessageReader:
    """Reads the messages of one vehicle: the first autopilot that speaks, and the cameras it carries."""

    def __init__(self, source: tuple[int, int] | None = None) -> None:
        """source: system and component id, where known already."""
        self.recording = Recording()
        self.source = source
        self.clock_s = 0.0  # of the vehicle, running on over reboots as long as they took
        self.armed = False
        self.mode = 0
        self.mission_item = 0
        self._boot_s = 0.0
        self._last_s: float | None = None
        self._heard_s = 0.0
        self._yaw_deg: float | None = None
        self._shutter: tuple[str, int] | None = None  # type and component of the messages that tell exposures

    def read(self, message: Any, heard_s: float) -> Fix | Trigger | None:
        """The fix or trigger that this message completes. heard_s: when it came, by the listener's clock."""
        kind = message.get_type()
        speaker = (message.get_srcSystem(), message.get_srcComponent())
        if self.source is None and kind == "HEARTBEAT" and is_autopilot(message):
            self.source = speaker
        if self.source is None or speaker[0] != self.source[0]:
            return None
        if speaker == self.source and hasattr(message, "time_boot_ms"):  # a camera's clock is another
            self._set_clock(message.time_boot_ms / 1000.0, heard_s)
        if kind in EXPOSURES:
            return self._on_trigger((kind, speaker[1]), message)
        if speaker != self.source:
            return None
        if kind == "GLOBAL_POSITION_INT":
            return self._on_position(message)
        if kind == "ATTITUDE":
            self._yaw_deg = math.degrees(message.yaw) % 360.0
        elif kind == "HEARTBEAT":
            self._on_heartbeat(message)
        elif kind == "MISSION_CURRENT":
            self.mission_item = message.seq
        elif kind == "STATUSTEXT":
            self._on_text(message)
        return None

    def close(self) -> Recording:
        """The recording; a vehicle still armed at the end of the log counts as armed until there."""
        if self.armed:
            self._end_of_flight()
        return self.recording

    def _set_clock(self, boot_s: float, heard_s: float) -> None:
        if self._last_s is not None and boot_s < self._last_s - REBOOT_S:
            if self.armed:  # the link was lost before it disarmed
                self._end_of_flight()
                self.armed = False
            self._boot_s = self.clock_s + max(0.0, heard_s - self._heard_s) - boot_s
        self.clock_s = self._boot_s + boot_s
        if self._last_s is None and self.armed:  # armed before the first time was told
            self.recording.armed_s[-1] = (self.clock_s, self.clock_s)
        self._last_s, self._heard_s = boot_s, heard_s

    def _on_position(self, message: Any) -> Fix | None:
        if message.lat == 0 and message.lon == 0:  # no position yet
            return None
        heading = message.hdg / 100.0 if message.hdg != 65535 else 0.0
        fix = Fix(
            time_s=self.clock_s,
            latitude_deg=message.lat / 1e7,
            longitude_deg=message.lon / 1e7,
            altitude_m=message.alt / 1000.0,
            height_m=message.relative_alt / 1000.0,
            yaw_deg=heading if self._yaw_deg is None else self._yaw_deg,
        )
        return fix if self.recording.add(fix) else None

    def _on_heartbeat(self, message: Any) -> None:
        if not is_autopilot(message):
            return
        self.mode = message.custom_mode
        armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        if armed and not self.armed:
            self.recording.armed_s.append((self.clock_s, self.clock_s))
        elif self.armed and not armed:
            self._end_of_flight()
        self.armed = armed
        if self.recording.vehicle == Recording.vehicle:
            self.recording.vehicle = _kind_of_vehicle(message)

    def _on_text(self, message: Any) -> None:
        name = vehicle_name(message.text)
        if name is not None and vehicle_name(self.recording.vehicle) is None:
            self.recording.vehicle = name
        if message.severity > mavlink.MAV_SEVERITY_WARNING:
            return
        said = self.recording.said
        if message.chunk_seq and said:  # more than 50 characters come in pieces
            said[-1] = (said[-1][0], said[-1][1] + message.text)
        else:
            said.append((self.clock_s, message.text))

    def _end_of_flight(self) -> None:
        if self.recording.armed_s:
            self.recording.armed_s[-1] = (self.recording.armed_s[-1][0], self.clock_s)

    def _on_trigger(self, shutter: tuple[str, int], message: Any) -> Trigger | None:
        if self._shutter not in (None, shutter):  # the same exposure, told a second way
            return None
        if getattr(message, "capture_result", 1) == 0:  # nothing was taken
            return None
        if shutter[0] == "CAMERA_FEEDBACK":
            longitude, altitude, height, index = (
                message.lng,
                message.alt_msl,
                message.alt_rel,
                message.img_idx,
            )
            yaw, pitch = message.yaw, message.pitch
        else:
            longitude, index = message.lon, message.image_index
            altitude, height = message.alt / 1000.0, message.relative_alt / 1000.0
            yaw, pitch = yaw_and_pitch_deg(message.q)
        if message.lat == 0 and longitude == 0:  # a camera that does not know where it is
            return None
        self._shutter = shutter
        fix = Fix(self.clock_s, message.lat / 1e7, longitude / 1e7, altitude, height, yaw % 360.0)
        trigger = Trigger(fix, pitch, index)
        self.recording.triggers.append(trigger)
        return trigger


def is_autopilot(heartbeat: Any) -> bool:
    """Whether this heartbeat comes from a flying vehicle's autopilot, never a station, gimbal or camera."""
    if heartbeat.get_srcComponent() in PERIPHERALS:  # which not all call their autopilot invalid
        return False
    return heartbeat.autopilot != mavlink.MAV_AUTOPILOT_INVALID and heartbeat.type not in (
        mavlink.MAV_TYPE_GCS,
        mavlink.MAV_TYPE_GIMBAL,
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_TYPE_ANTENNA_TRACKER,
    )


def vehicle_name(text: str) -> str | None:
    """The autopilot's own name in its banner: "ArduCopter V4.6.0 (…)", "APM:Copter V3.3"."""
    first = text.strip()
    known = ("ArduCopter", "ArduPlane", "ArduRover", "ArduSub", "APM:")
    return first if first.startswith(known) else None


def _kind_of_vehicle(heartbeat: Any) -> str:
    autopilots, types = mavlink.enums["MAV_AUTOPILOT"], mavlink.enums["MAV_TYPE"]
    autopilot = autopilots[heartbeat.autopilot].name if heartbeat.autopilot in autopilots else "autopilot"
    kind = types[heartbeat.type].name if heartbeat.type in types else "vehicle"
    words = f"{autopilot.removeprefix('MAV_AUTOPILOT_')} {kind.removeprefix('MAV_TYPE_')}"
    return words.lower().replace("_", " ")


def yaw_and_pitch_deg(q: Any) -> tuple[float, float]:
    """Heading and elevation of the x axis of a body in NED, from its quaternion (w, x, y, z)."""
    w, x, y, z = q
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return math.degrees(yaw) % 360.0, math.degrees(pitch)
