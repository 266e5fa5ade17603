"""The simulated vehicle: a process that speaks MAVLink on a TCP port of this machine.

    python -m tasks.simulation.vehicle --port 5760 --seed 1 --plan plan.json

It prints its connection URL, serves one ground station at a time and ends with the process that started it.
"""

import argparse
import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from schemas.contract import Contract, Vector3
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from schemas.vehicle import Vehicle
from tasks.simulation.autopilot import Autopilot, Faults, Vanished

START_S = 30.0  # a slow machine's time to import
HEARTBEAT_S = 1.0


class Airframe(Contract):
    """What the vehicle's process must know: where it stands and what it can do."""

    vehicle: Vehicle
    origin: GeoOrigin
    home_m: Vector3


@contextmanager
def start_vehicle(plan: FlightPlan, seed: int, faults: Faults | None = None) -> Iterator[str]:
    """A vehicle that stands at the plan's home; yields its connection URL. It always ends with the block."""
    faults = faults or Faults()
    airframe = Airframe(vehicle=plan.vehicle, origin=plan.origin, home_m=plan.home_m)
    command = [sys.executable, "-m", "tasks.simulation.vehicle", "--port", "0", "--seed", str(seed)]
    command += ["--airframe", airframe.model_dump_json(), "--loss", str(faults.loss)]
    command += ["--settling", str(faults.settling), "--home-off-m", str(faults.home_off_m)]
    command += ["--drift-m", str(faults.drift_m)]
    command += [f"--{name.replace('_', '-')}" for name in _SWITCHES if getattr(faults, name)]
    for moment in ("vanish_s", "failsafe_s"):
        if (at_s := getattr(faults, moment)) is not None:
            command += [f"--{moment.replace('_', '-')}", str(at_s)]
    command += [f"--param={name}={value}" for name, value in faults.parameters]
    root = str(Path(__file__).parents[2])
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path}
    )
    try:
        yield _url(process)
    finally:
        process.kill()
        process.wait()
        assert process.stdout is not None
        process.stdout.close()


def _url(process: subprocess.Popen[bytes]) -> str:
    assert process.stdout is not None
    ready, _, _ = select.select([process.stdout], [], [], START_S)
    url = process.stdout.readline().decode().strip() if ready else ""
    if not url:
        raise RuntimeError(f"the simulated vehicle did not start (exit code {process.poll()})")
    return url


def _setting(text: str) -> tuple[str, float]:
    name, value = text.split("=")
    return name, float(value)


_SWITCHES = ("silent", "refuse_arm", "lose_last_item", "in_metres")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--port", type=int, default=5760, help="TCP port on 127.0.0.1; 0: any free one")
    parser.add_argument("--seed", type=int, default=1)
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--plan", type=Path, help="a plan.json, for its vehicle and home")
    where.add_argument("--airframe", help="JSON with vehicle, origin, home_m")
    parser.add_argument("--loss", type=float, default=0.0, help="share of frames lost in either direction")
    parser.add_argument("--vanish-s", type=float, help="end the link at this time of the flight")
    parser.add_argument("--failsafe-s", type=float, help="the battery is low at this time of the flight")
    parser.add_argument("--settling", type=int, default=0, help="refuse as many changes of mode")
    parser.add_argument("--home-off-m", type=float, default=0.0, help="heights count from above the ground")
    parser.add_argument("--drift-m", type=float, default=0.0, help="it stands farther north after arming")
    parser.add_argument(
        "--param", action="append", default=[], type=_setting, help="NAME=VALUE, other than as delivered"
    )
    for switch in _SWITCHES:
        parser.add_argument(f"--{switch.replace('_', '-')}", action="store_true")
    options = parser.parse_args()
    if options.plan:
        plan = FlightPlan.model_validate_json(options.plan.read_text())
        airframe = Airframe(vehicle=plan.vehicle, origin=plan.origin, home_m=plan.home_m)
    else:
        airframe = Airframe.model_validate_json(options.airframe)
    faults = Faults(
        loss=options.loss,
        silent=options.silent,
        refuse_arm=options.refuse_arm,
        settling=options.settling,
        lose_last_item=options.lose_last_item,
        home_off_m=options.home_off_m,
        drift_m=options.drift_m,
        failsafe_s=options.failsafe_s,
        vanish_s=options.vanish_s,
        in_metres=options.in_metres,
        parameters=tuple(options.param),
    )
    with socket.create_server(("127.0.0.1", options.port)) as server:
        print(f"tcp:127.0.0.1:{server.getsockname()[1]}", flush=True)
        serve(server, airframe, options.seed, faults)


def serve(server: socket.socket, airframe: Airframe, seed: int, faults: Faults) -> None:
    """Fly for one ground station after the other, until the parent process is gone."""
    parent = os.getppid()
    station: list[socket.socket] = []

    def send(frame: bytes) -> None:
        if station:
            station[0].sendall(frame)

    autopilot = Autopilot(airframe.vehicle, airframe.origin, airframe.home_m, seed, faults, send)
    beat = 0.0
    while os.getppid() == parent:
        readable, _, _ = select.select(station or [server], [], [], 0.2)
        try:
            if readable and not station:
                station.append(server.accept()[0])
                station[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            elif readable:
                data = station[0].recv(65536)
                if not data:
                    raise ConnectionResetError
                autopilot.receive(data)
            if time.monotonic() - beat >= HEARTBEAT_S and not autopilot.armed:
                beat = time.monotonic()
                autopilot.on_ground()
        except Vanished:
            return
        except OSError:  # the station hung up
            station.pop().close()


if __name__ == "__main__":
    main()
