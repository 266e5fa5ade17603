"""Rows of `make bench-planning` on mission files: what another importer makes of them."""

import tempfile
from pathlib import Path
from typing import Any

from artifacts.mission_files import write_missions
from schemas.mission import mission_items
from tasks.simulation.vehicle import start_vehicle
from tests.benchmarks.planning_scenes import small_plan
from tests.benchmarks.table import Row, absent, row


def rows() -> list[Row]:
    """What mavsdk's own importer makes of our files, item by item. It wants a vehicle: the simulated one."""
    try:
        from mavsdk import ComponentType, Configuration, Mavsdk
        from mavsdk.plugins.mission_raw import MissionRaw
    except ImportError as problem:
        return [absent("mission import", "mavsdk", problem)]
    plan = small_plan()
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    with tempfile.TemporaryDirectory() as folder, start_vehicle(plan, 1) as url:
        write_missions(plan, Path(folder) / "mission")
        station.add_any_connection(url.replace("tcp:", "tcpout://"))
        raw = MissionRaw(station.first_autopilot(20.0))
        imported = (
            raw.import_mission_planner_mission(f"{folder}/mission.waypoints").mission_items,
            raw.import_qgroundcontrol_mission(f"{folder}/mission.plan").mission_items,
        )
    mine = mission_items(plan)[1:]
    table = []
    for name, found in zip((".waypoints", ".plan"), imported, strict=True):
        homes, theirs = found[: -len(mine)], found[-len(mine) :]  # mavsdk puts a home before the file's own
        differences = sum(one.command != 16 for one in homes) + sum(map(differs, mine, theirs))
        what = f"items of {name} that are read otherwise"
        table.append(row(what, differences, "1", "≤ 0", f"{len(mine)} items", None, "mavsdk"))
    return table


def differs(mine: Any, theirs: Any) -> bool:
    """Commands, numbers and places; a frame by its number in files, 3 for 6."""
    frames = {6: (3, 6), 2: (0, 2)}
    numbers = zip(
        (mine.param1, mine.param2, mine.param3, mine.param4, mine.z),
        (theirs.param1, theirs.param2, theirs.param3, theirs.param4, theirs.z),
        strict=True,
    )
    return (
        mine.command != theirs.command
        or theirs.frame not in frames[mine.frame]
        or abs(mine.x - theirs.x) > 1
        or abs(mine.y - theirs.y) > 1
        or any(abs((a or 0.0) - b) > 1e-4 for a, b in numbers)
    )
