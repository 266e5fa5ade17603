"""Telemetry logs as ground stations keep them: over a change of battery, and with a camera that speaks."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tasks.flight.battery_flights import flights_in
from tasks.flight.telemetry_log import read_telemetry_log

AUTOPILOT, CAMERA = 1, mavlink.MAV_COMP_ID_CAMERA
START_US = 1_700_000_000_000_000
Said = tuple[float, int, Any]  # seconds of the station's clock, component, message


def flight(start_s: float, disarms: bool, told_by: int = AUTOPILOT) -> Iterator[Said]:
    """30 s from a boot: armed from 2 s on, to 28 s or, where the link is lost before, the end; a position ten
    times a second, an exposure every 4 s. The vehicle's clock is told before its heartbeat."""
    for tenth in range(300):
        now_s, boot_ms = start_s + tenth / 10, 10_000 + tenth * 100
        north = round(500_000_000 + start_s * 10 + tenth)
        position = (north, 80_000_000, 200_000, 5000)
        yield now_s, AUTOPILOT, mavlink.MAVLink_global_position_int_message(boot_ms, *position, 0, 0, 0, 9000)
        if tenth % 10 == 0:
            armed = tenth >= 20 and not (disarms and tenth >= 280)
            mode = mavlink.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
            yield now_s, AUTOPILOT, mavlink.MAVLink_heartbeat_message(2, 3, mode, 3, 4, 3)
            yield now_s, CAMERA, mavlink.MAVLink_heartbeat_message(30, 8, 0, 0, 4, 3)
        if tenth % 40 == 30 and told_by == CAMERA:  # its clock is another
            q = [0.70710678, 0.0, 0.0, 0.70710678]
            taken = mavlink.MAVLink_camera_image_captured_message(7, 0, 0, *position, q, tenth // 40, 1, b"")
            yield now_s, CAMERA, taken
        elif tenth % 40 == 30:
            place = (north, 80_000_000, 200.0, 5.0, 0.0, 0.0, 90.0)
            yield (
                now_s,
                AUTOPILOT,
                mavlink.MAVLink_camera_feedback_message(0, 1, 0, tenth // 40, *place, 0, 0),
            )


def written(path: Path, *parts: Iterator[Said]) -> Path:
    senders = {component: mavlink.MAVLink(None, 1, component) for component in (AUTOPILOT, CAMERA)}
    with path.open("wb") as stream:
        for part in parts:
            for now_s, component, message in part:
                stream.write(struct.pack(">Q", START_US + round(now_s * 1e6)))
                stream.write(message.pack(senders[component]))
    return path


@pytest.mark.parametrize("disarms", [True, False])
def test_a_battery_changed_within_one_log_makes_two_flights(disarms: bool, tmp_path: Path) -> None:
    """Two minutes lie between them by the station's clock, though the vehicle's began anew."""
    path = written(tmp_path / "day.tlog", flight(0.0, disarms), flight(150.0, True))
    recording = read_telemetry_log(path)
    ends = (38.0, 188.0) if disarms else (39.9, 188.0)
    assert [end for _, end in recording.armed_s] == pytest.approx(ends, abs=1e-3)
    first, second = flights_in(recording)
    assert [start for start, _ in first.armed_s + second.armed_s] == pytest.approx((12.0, 162.0), abs=1e-3)
    assert (len(first.fixes), len(second.fixes)) == (261 if disarms else 280, 261)
    assert (len(first.triggers), len(second.triggers)) == (7, 7)
    assert second.fixes[0].latitude_deg == pytest.approx(50.000152, abs=1e-9)


def test_exposures_told_by_the_camera_count(tmp_path: Path) -> None:
    recording = read_telemetry_log(written(tmp_path / "camera.tlog", flight(0.0, True, CAMERA)))
    assert [t.fix.time_s for t in recording.triggers] == pytest.approx([13.0 + 4 * k for k in range(7)])
    assert [t.index for t in recording.triggers] == list(range(7))
    assert recording.triggers[0].fix.yaw_deg == pytest.approx(90.0)
    assert recording.triggers[0].fix.latitude_deg == pytest.approx(50.000003)


def test_an_exposure_told_by_autopilot_and_camera_counts_once(tmp_path: Path) -> None:
    both = sorted((*flight(0.0, True), *flight(0.0, True, CAMERA)), key=lambda said: said[0])
    assert len(read_telemetry_log(written(tmp_path / "both.tlog", iter(both))).triggers) == 7
