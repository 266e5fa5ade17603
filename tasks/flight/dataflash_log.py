"""ArduPilot's on-board logs (BIN, "dataflash")."""

from pathlib import Path
from typing import Any

from pymavlink import DFReader

from tasks.flight.mavlink_messages import vehicle_name
from tasks.flight.recording import Fix, Recording, Trigger

READ = ["POS", "GPS", "ATT", "CAM", "TRIG", "EV", "ARM", "MSG"]
FIRST = 0  # instance, of whatever a vehicle may have several
ARMED, DISARMED = 10, 11  # of EV


def read_dataflash_log(path: Path) -> Recording:
    """Positions from POS (the filter's), else from GPS; triggers from CAM, else from TRIG. Of several
    receivers or cameras the first."""
    log = DFReader.DFReader_binary(str(path))
    try:
        messages = []
        while (message := log.recv_match(type=READ)) is not None:
            if getattr(message, "I", FIRST) == FIRST:
                messages.append(message)
    finally:
        log.close()
    kinds = {message.get_type() for message in messages}
    positions, exposures = "POS" if "POS" in kinds else "GPS", "CAM" if "CAM" in kinds else "TRIG"
    recording = Recording()
    home_m: float | None = None
    armed_at: float | None = None
    time_s = yaw_deg = 0.0
    for message in messages:
        kind = message.get_type()
        time_s = message.TimeUS / 1e6
        if kind == "ATT":
            yaw_deg = message.Yaw % 360.0
        elif kind == positions and _has_fix(message):
            home_m = message.Alt if home_m is None else home_m
            height = getattr(message, "RelHomeAlt", message.Alt - home_m)
            recording.add(Fix(time_s, message.Lat, message.Lng, message.Alt, height, yaw_deg))
        elif kind == exposures and _has_fix(message):
            height = getattr(message, "RelAlt", message.Alt - (home_m or message.Alt))
            pitch_deg, heading_deg = _attitude_deg(message)
            fix = Fix(time_s, message.Lat, message.Lng, message.Alt, height, heading_deg % 360.0)
            recording.triggers.append(Trigger(fix, pitch_deg, getattr(message, "Img", None)))
        elif kind == "MSG":
            if vehicle_name(recording.vehicle) is None:
                recording.vehicle = vehicle_name(message.Message) or recording.vehicle
        elif kind in ("EV", "ARM"):
            armed = message.Id == ARMED if kind == "EV" else bool(message.ArmState)
            if armed and armed_at is None:
                armed_at = time_s
            elif armed_at is not None and (kind == "ARM" or message.Id == DISARMED) and not armed:
                recording.armed_s.append((armed_at, time_s))
                armed_at = None
    if armed_at is not None:
        recording.armed_s.append((armed_at, time_s))
    return recording


def _has_fix(message: Any) -> bool:
    return (message.Lat, message.Lng) != (0.0, 0.0) and getattr(message, "Status", 3) >= 3


def _attitude_deg(exposure: Any) -> tuple[float, float]:
    """Pitch and yaw, whose columns are Pitch and Yaw in older firmware."""
    if hasattr(exposure, "Yaw"):
        return exposure.Pitch, exposure.Yaw
    return exposure.P, exposure.Y
