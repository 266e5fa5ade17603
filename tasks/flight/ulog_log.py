"""PX4's on-board logs (ulg)."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pyulog import ULog

from tasks.flight.mavlink_messages import yaw_and_pitch_deg
from tasks.flight.recording import Fix, Recording, Trigger

Array = npt.NDArray[np.float64]

READ = [
    "vehicle_global_position",
    "vehicle_gps_position",
    "vehicle_attitude",
    "camera_capture",
    "home_position",
    "vehicle_status",
]
ARMED = 2  # of vehicle_status.arming_state


def read_ulog(path: Path) -> Recording:
    """Positions from the filter, else from the receiver; triggers from camera_capture."""
    with path.open("rb") as stream:  # pyulog leaves its own open where the log is damaged
        log = ULog(stream, READ)
    topics = {d.name: d.data for d in reversed(log.data_list)}  # of several instances the first
    info = log.msg_info_dict
    recording = Recording(
        vehicle=f"{info.get('sys_name', 'PX4')} on {info.get('ver_hw', 'unknown hardware')}"
    )
    position = _positions(topics)
    if position is None:
        return recording
    time_s, latitude, longitude, altitude = position
    yaw = _yaw_deg(topics, time_s)
    height = altitude - _ground_m(topics, time_s, float(altitude[0]))
    for values in zip(time_s, latitude, longitude, altitude, height, yaw, strict=True):
        recording.add(Fix(*(float(v) for v in values)))
    recording.armed_s = _armed(topics)
    captures = topics.get("camera_capture")
    if captures is not None:
        turned = np.column_stack([captures[f"q[{i}]"] for i in range(4)])
        ground_m = _ground_m(topics, captures["timestamp"] / 1e6, float(altitude[0]))
        for i, stamp in enumerate(captures["timestamp"]):
            heading, pitch = yaw_and_pitch_deg(turned[i])
            alt = float(captures["alt"][i])
            fix = Fix(
                float(stamp) / 1e6,
                float(captures["lat"][i]),
                float(captures["lon"][i]),
                alt,
                alt - float(ground_m[i]),
                heading,
            )
            recording.triggers.append(Trigger(fix, pitch, int(captures["seq"][i])))
    return recording


def _positions(topics: dict[str, Any]) -> tuple[Array, Array, Array, Array] | None:
    """Time (s), latitude, longitude (deg), altitude (m) of every valid position."""
    if "vehicle_global_position" in topics:
        data = topics["vehicle_global_position"]
        columns = [data["timestamp"] / 1e6, data["lat"], data["lon"], data["alt"]]
        valid = np.isfinite(np.column_stack(columns)).all(axis=1)
    elif "vehicle_gps_position" in topics:
        data = topics["vehicle_gps_position"]
        if "latitude_deg" in data:  # PX4 1.14 and later
            columns = [
                data["timestamp"] / 1e6,
                data["latitude_deg"],
                data["longitude_deg"],
                data["altitude_msl_m"],
            ]
        else:
            columns = [data["timestamp"] / 1e6, data["lat"] / 1e7, data["lon"] / 1e7, data["alt"] / 1e3]
        valid = data["fix_type"] >= 3
    else:
        return None
    if not valid.any():
        return None
    time_s, latitude, longitude, altitude = (np.asarray(c, dtype=np.float64)[valid] for c in columns)
    return time_s, latitude, longitude, altitude


def _ground_m(topics: dict[str, Any], time_s: Array, start_m: float) -> Array:
    """Home's altitude at each moment. PX4 sets home anew on the ground, after landing too, wherever its
    estimate has drifted (HomePosition::update); until then heights counted from the home before."""
    home = topics.get("home_position")
    known = np.isfinite(home["alt"]) & (home["valid_alt"] > 0) if home is not None else np.array([], bool)
    if home is None or not known.any():
        return np.full(len(time_s), start_m)
    before = np.searchsorted(home["timestamp"][known] / 1e6, time_s, side="right") - 1
    return np.asarray(home["alt"][known], dtype=np.float64)[np.maximum(before, 0)]


def _yaw_deg(topics: dict[str, Any], time_s: Array) -> Array:
    data = topics.get("vehicle_attitude")
    if data is None:
        return np.zeros(len(time_s))
    turned = np.column_stack([data[f"q[{i}]"] for i in range(4)])
    heading = np.unwrap(np.radians([yaw_and_pitch_deg(q)[0] for q in turned]))
    return np.asarray(np.degrees(np.interp(time_s, data["timestamp"] / 1e6, heading)) % 360.0)


def _armed(topics: dict[str, Any]) -> list[tuple[float, float]]:
    data = topics.get("vehicle_status")
    if data is None:
        return []
    windows: list[tuple[float, float]] = []
    running = False
    for stamp, state in zip(data["timestamp"] / 1e6, data["arming_state"], strict=True):
        if state == ARMED:
            windows = (
                [*windows[:-1], (windows[-1][0], float(stamp))]
                if running
                else [*windows, (float(stamp),) * 2]
            )
        elif running:
            windows[-1] = (windows[-1][0], float(stamp))
        running = state == ARMED
    return windows
