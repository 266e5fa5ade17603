import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.mission import mission_items
from schemas.problem import BadInput
from tasks.flight.fly import Flight
from tasks.flight.link import Link, LinkLost
from tests.flight.wall_plan import wall_plan


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def udp_link(timeout_s: float = 3.0) -> Iterator[tuple[Link, socket.socket, tuple[str, int]]]:
    port = free_port()
    with (
        Link(f"udpin:127.0.0.1:{port}", timeout_s) as link,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle,
    ):
        yield link, vehicle, ("127.0.0.1", port)


def heartbeat(system: int, kind: int, autopilot: int, mode: int = 0, component: int = 1) -> bytes:
    mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    return bytes(mav.heartbeat_encode(kind, autopilot, 0, mode, 0).pack(mav))


COPTER = heartbeat(1, mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode=7)
STATION = heartbeat(255, mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID)
CAMERA = heartbeat(1, mavlink.MAV_TYPE_GENERIC, mavlink.MAV_AUTOPILOT_GENERIC, component=100)
OTHER = heartbeat(9, mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mode=8)


def test_listens_to_the_first_autopilot_only_whatever_else_arrives() -> None:
    with udp_link() as (link, vehicle, address):
        for data in (os.urandom(200), STATION, CAMERA, b"\xfd\x09", *[COPTER] * 30):
            vehicle.sendto(data, address)
        assert link.find_vehicle().custom_mode == 7
        assert link.target == (1, 1)
        for data in (OTHER, STATION, os.urandom(300), OTHER, *[COPTER] * 30):
            vehicle.sendto(data, address)
        message = link.receive(2.0)
        assert message is not None
        assert message.get_srcSystem() == 1


def test_another_autopilot_is_refused_and_what_it_can_fly_is_told() -> None:
    plan = wall_plan(1, 1)
    with udp_link() as (link, vehicle, address):
        vehicle.sendto(heartbeat(1, mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4), address)
        with pytest.raises(BadInput, match=r"no ArduCopter.*mission\.csv.*PX4 refuses mission\.plan"):
            Flight(link, plan, mission_items(plan)).prepare()


def test_a_vehicle_that_falls_silent_is_lost_though_others_talk() -> None:
    with udp_link(timeout_s=0.6) as (link, vehicle, address):
        vehicle.sendto(COPTER, address)
        link.find_vehicle()
        began = time.monotonic()
        with pytest.raises(LinkLost):
            while time.monotonic() - began < 5.0:
                vehicle.sendto(OTHER, address)
                link.receive(0.1)
        assert 0.5 < time.monotonic() - began < 2.5


def test_says_heartbeats_as_a_ground_station() -> None:
    with udp_link() as (link, vehicle, address):
        vehicle.settimeout(3.0)
        vehicle.sendto(COPTER, address)
        link.find_vehicle()
        link.receive(1.2)
        heard = mavlink.MAVLink(None).decode(bytearray(vehicle.recv(300)))
        assert (heard.get_type(), heard.type, heard.get_srcSystem()) == (
            "HEARTBEAT",
            mavlink.MAV_TYPE_GCS,
            255,
        )


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("tcp:127.0.0.1:1", "cannot be opened"),
        ("/dev/ttyNOWHERE,57600", "cannot be opened|needs pyserial"),
        ("tcp:127.0.0.1", "ends with no port"),
        ("udpin:0.0.0.0:99999", "ends with no port"),
        ("udpout:127.0.0.1:abc", "ends with no port"),
        ("flight.tlog", "is no MAVLink connection"),
        ("udpin:127.0.0.1:0", "no vehicle answered within 0.4 s"),
    ],
)
def test_says_what_to_check_where_nobody_is(url: str, words: str) -> None:
    began = time.monotonic()
    with pytest.raises(BadInput, match=words) as problem, Link(url, 0.4) as link:
        link.find_vehicle()
    assert problem.value.item == url
    assert problem.value.remedy
    assert time.monotonic() - began < 3.0
