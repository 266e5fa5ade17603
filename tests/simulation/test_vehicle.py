import os
import socket
import time
from itertools import pairwise

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.mission import mission_items
from tasks.simulation.autopilot import Autopilot, Faults
from tasks.simulation.trajectory import fly_mission
from tasks.simulation.vehicle import start_vehicle
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan(3, 1)
ITEMS = mission_items(PLAN)


class Station:
    """The other end, without a socket: frames in, messages out."""

    def __init__(self, seed: int = 1, faults: Faults | None = None) -> None:
        self.heard: list[mavlink.MAVLink_message] = []
        decoder = mavlink.MAVLink(None)
        self.mav = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self.vehicle = Autopilot(
            PLAN.vehicle,
            PLAN.origin,
            PLAN.home_m,
            seed,
            faults or Faults(),
            lambda frame: self.heard.append(decoder.decode(bytearray(frame))),
        )

    def say(self, message: mavlink.MAVLink_message) -> list[mavlink.MAVLink_message]:
        self.heard.clear()
        self.vehicle.receive(message.pack(self.mav))
        return list(self.heard)

    def command(self, command: int, *params: float) -> list[mavlink.MAVLink_message]:
        padded = [*params, *[0.0] * (7 - len(params))]
        return self.say(self.mav.command_long_encode(1, 1, command, 0, *padded))

    def upload(self) -> list[mavlink.MAVLink_message]:
        answers = self.say(self.mav.mission_count_encode(1, 1, len(ITEMS)))
        for item in ITEMS:
            assert (answers[-1].get_type(), answers[-1].seq) == ("MISSION_REQUEST", item.seq)
            params = (item.param1, item.param2, item.param3, item.param4)
            answers = self.say(
                self.mav.mission_item_int_encode(
                    1, 1, item.seq, item.frame, item.command, 0, 1, *params, item.x, item.y, item.z
                )
            )
        return answers

    def fly(self) -> list[mavlink.MAVLink_message]:
        self.upload()
        self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        return self.command(mavlink.MAV_CMD_MISSION_START)


def of_type(messages: list[mavlink.MAVLink_message], kind: str) -> list[mavlink.MAVLink_message]:
    return [m for m in messages if m.get_type() == kind]


def test_takes_a_mission_as_ardupilot_does() -> None:
    station = Station()
    assert station.upload()[-1].type == mavlink.MAV_MISSION_ACCEPTED
    again = station.mav.mission_item_int_encode(1, 1, 3, 6, 16, 0, 1, 0, 0, 0, 0, 0, 0, 5.0)
    assert station.say(again)[0].type == mavlink.MAV_MISSION_ERROR
    waypoint = next(i for i in ITEMS if i.command == 16 and i.seq > 0)
    told = station.say(station.mav.mission_request_int_encode(1, 1, waypoint.seq))[0]
    assert (told.frame, told.x, told.y) == (3, waypoint.x, waypoint.y)


@pytest.mark.parametrize(
    ("frame", "command", "x", "result"),
    [
        (6, 16, 950_000_000, mavlink.MAV_MISSION_INVALID_PARAM5_X),
        (1, 16, 0, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        (6, 9999, 0, mavlink.MAV_MISSION_UNSUPPORTED),
    ],
)
def test_refuses_items_with_ardupilots_codes_and_keeps_a_mixture_of_missions(
    frame: int, command: int, x: int, result: int
) -> None:
    station = Station()
    station.upload()
    station.say(station.mav.mission_count_encode(1, 1, 5))
    good = station.mav.mission_item_int_encode(1, 1, 0, 6, 16, 0, 1, 0, 0, 0, 0, 0, 0, 0.0)
    assert of_type(station.say(good), "MISSION_REQUEST")
    bad = station.mav.mission_item_int_encode(1, 1, 1, frame, command, 0, 1, 0, 0, 0, 0, x, 0, 0.0)
    assert station.say(bad)[0].type == result
    assert station.say(station.mav.mission_request_list_encode(1, 1))[0].count == 5
    told = station.say(station.mav.mission_request_int_encode(1, 1, 4))[0]
    assert told.command == ITEMS[4].command  # of the mission before


def test_neither_clears_nor_tells_a_mission_while_it_receives_one() -> None:
    station = Station()
    station.say(station.mav.mission_count_encode(1, 1, 5))
    assert station.say(station.mav.mission_clear_all_encode(1, 1))[0].type == mavlink.MAV_MISSION_ERROR
    listed = station.say(station.mav.mission_request_list_encode(1, 1))[0]
    assert listed.type == mavlink.MAV_MISSION_DENIED


def test_tells_the_flight_that_it_flies() -> None:
    told = Station(seed=4).fly()
    true = fly_mission(ITEMS, PLAN.origin, PLAN.home_m, PLAN.vehicle, seed=4)
    shots = of_type(told, "CAMERA_FEEDBACK")
    assert [s.img_idx for s in shots] == list(range(len(true.shots)))
    for shot, flown in zip(shots, true.shots, strict=True):
        at = PLAN.origin.to_enu(shot.lat / 1e7, shot.lng / 1e7, shot.alt_msl)
        assert at == pytest.approx(flown.estimated_pose.position_m, abs=0.012)
    assert [m.seq for m in of_type(told, "MISSION_ITEM_REACHED")] == [seq for seq, _ in true.reached]
    times = [m.time_boot_ms for m in of_type(told, "GLOBAL_POSITION_INT")]
    assert all(b - a == 100 for a, b in pairwise(times))
    armed = [bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED) for m in of_type(told, "HEARTBEAT")]
    assert armed == [True] * (len(armed) - 1) + [False]
    for kind in ("LOCAL_POSITION_NED", "ATTITUDE", "MISSION_CURRENT"):
        assert of_type(told, kind)


def test_the_same_seed_tells_the_same_bytes() -> None:
    one, two = (b"".join(m.get_msgbuf() for m in Station(seed=2).fly()) for _ in range(2))
    assert one == two


def test_does_not_start_without_arming_or_mission() -> None:
    station = Station()
    station.upload()
    assert station.command(mavlink.MAV_CMD_MISSION_START)[0].result == mavlink.MAV_RESULT_DENIED
    empty = Station()
    empty.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    assert empty.command(mavlink.MAV_CMD_MISSION_START)[0].result == mavlink.MAV_RESULT_DENIED


def test_loss_drops_its_share_of_frames() -> None:
    station = Station(faults=Faults(loss=0.3))
    station.vehicle.armed = True
    told = 0
    for _ in range(2000):
        station.heard.clear()
        station.vehicle.heartbeat()
        told += len(station.heard)
    assert told / 2000 == pytest.approx(0.7, abs=0.03)


def test_survives_noise() -> None:
    station = Station()
    station.vehicle.receive(os.urandom(5000))
    station.vehicle.receive(b"\0" * 600)
    assert station.upload()[-1].type == mavlink.MAV_MISSION_ACCEPTED


def test_the_process_serves_and_ends_with_its_block() -> None:
    with start_vehicle(PLAN, 1) as url:
        connection = mavutil.mavlink_connection(url, dialect="ardupilotmega")
        heartbeat = connection.recv_match(type="HEARTBEAT", blocking=True, timeout=5)
        connection.close()
        assert heartbeat.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        _, host, port = url.split(":")
    time.sleep(0.05)
    with pytest.raises(ConnectionRefusedError), socket.create_connection((host, int(port)), timeout=2):
        pass
