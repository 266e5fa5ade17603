"""Mission files that ground stations open: QGC WPL 110 (`.waypoints`) and QGroundControl (`.plan`).

Both carry degrees as decimal numbers; MAVLink carries degrees · 1e7 as integers. A round trip through either
keeps every position within 1e-7° and every parameter exactly.
"""

import json
import math
from pathlib import Path
from typing import Any

from pydantic import Field, JsonValue

from artifacts.dji_mission import write_dji
from artifacts.map_files import write_csv, write_kml
from schemas.box import Box
from schemas.contract import Contract, Vector2, Vector3
from schemas.flight_plan import FlightPlan
from schemas.mission import MissionItem, mission_items
from schemas.problem import BadInput

# Files hold decimal degrees and name the frames without INT; MISSION_ITEM_INT names those with it.
_INT_FRAME = {0: 5, 3: 6, 10: 11}
_FILE_FRAME = {number: name for name, number in _INT_FRAME.items()}
# Commands whose parameters 5 and 6 are a position (MAVLink common, and what ArduPilot stores as locations).
_WITH_POSITION = frozenset(
    {16, 17, 18, 19, 21, 22, 31, 33, 34, 36, 80, 81, 82, 84, 85, 94, 179, 188, 189, 191, 195, 201}
    | {5000, 5001, 5002, 5003, 5004, 5100}
)
_NAN_INT = 2**31 - 1  # MAVLink's NaN of an integer field
_MISSION_FRAME = 2  # parameters 5 and 6 are plain numbers


class Mission(Contract):
    """A mission as its file has it. `items` begin after home, which the vehicle keeps as item 0."""

    home: Vector3  # latitude, longitude (degrees), altitude above mean sea level (metres)
    items: tuple[MissionItem, ...]
    speed_m_s: float = 5.0  # .plan only, as are the fences and rally points, kept as they came
    cruise_speed_m_s: float = 15.0
    firmware: int = 3  # MAV_AUTOPILOT_ARDUPILOTMEGA
    vehicle: int = 2  # MAV_TYPE_QUADROTOR
    fences: dict[str, JsonValue] = Field(default={"circles": [], "polygons": [], "version": 2})
    rally_points: dict[str, JsonValue] = Field(default={"points": [], "version": 2})


def write_missions(plan: FlightPlan, stem: Path) -> None:
    """STEM.waypoints (Mission Planner), .plan (QGroundControl), .kmz (DJI), .kml and .csv of one flight."""
    write_waypoints(plan, stem.with_name(f"{stem.name}.waypoints"))
    write_plan(plan, stem.with_name(f"{stem.name}.plan"))
    write_dji(plan, stem.with_name(f"{stem.name}.kmz"))
    write_kml(plan, stem.with_name(f"{stem.name}.kml"))
    write_csv(plan, stem.with_name(f"{stem.name}.csv"))


def mission_of(plan: FlightPlan) -> Mission:
    """The mission of a plan of one flight, its fence and no-fly boxes, and home to rally to."""
    speed = plan.vehicle.speed_m_s
    fences: list[JsonValue] = []
    if plan.fence_m:
        fences.append({"inclusion": True, "polygon": _ring(plan, plan.fence_m), "version": 1})
    for box in _not_flown_over(plan):
        fences.append({"inclusion": False, "polygon": _ring(plan, _corners(box)), "version": 1})
    above_home = plan.waypoints[0].position_m if plan.waypoints else plan.home_m
    latitude, longitude, _ = plan.origin.to_geographic(above_home)
    rally = [round(latitude, 9), round(longitude, 9), round(above_home[2] - plan.home_m[2], 2)]
    return Mission(
        fences={"circles": [], "polygons": fences, "version": 2},
        rally_points={"points": [rally], "version": 2},
        home=plan.origin.to_geographic(plan.home_m),
        items=mission_items(plan)[1:],
        speed_m_s=speed,
        cruise_speed_m_s=speed,
    )


def _not_flown_over(plan: FlightPlan) -> list[Box]:
    """The no-fly boxes that no leg passes over or under: a ground station's fence has all heights."""
    import shapely

    path = shapely.LineString([plan.home_m[:2], *(w.position_m[:2] for w in plan.waypoints), plan.home_m[:2]])
    return [box for box in plan.no_fly_m if not path.intersects(shapely.Polygon(_corners(box)))]


def _corners(box: Box) -> tuple[Vector2, ...]:
    (west, south, _), (east, north, _) = box.low_m, box.high_m
    return ((west, south), (east, south), (east, north), (west, north))


def _ring(plan: FlightPlan, corners_m: tuple[Vector2, ...]) -> list[JsonValue]:
    places = (plan.origin.to_geographic((east, north, 0.0)) for east, north in corners_m)
    return [[round(latitude, 9), round(longitude, 9)] for latitude, longitude, _ in places]


def write_waypoints(mission: Mission | FlightPlan, path: Path) -> None:
    """QGC WPL 110: one line an item, tab-separated, home first."""
    mission = mission_of(mission) if isinstance(mission, FlightPlan) else mission
    latitude, longitude, altitude = mission.home
    lines = ["QGC WPL 110", _line(0, 1, 0, 16, (0.0, 0.0, 0.0, 0.0, latitude, longitude, altitude))]
    lines += [
        _line(i.seq, 0, _FILE_FRAME.get(i.frame, i.frame), i.command, _parameters(i)) for i in mission.items
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_waypoints(path: Path) -> Mission:
    rows = [line.split() for line in _text(path).splitlines()]
    if not rows or rows[0][:2] != ["QGC", "WPL"] or rows[0][2:] != ["110"]:
        raise BadInput(
            path.name, "its first line is not QGC WPL 110", "Export the mission as .waypoints again."
        )
    items: list[MissionItem] = []
    home: Vector3 | None = None
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        where = f"line {number}"
        if len(row) != 12:
            raise _unreadable(path, where, f"has {len(row)} columns, not 12")
        try:
            seq, frame, command, autocontinue = int(row[0]), int(row[2]), int(row[3]), int(float(row[11]))
            values = tuple(_number(float(text)) for text in row[4:11])
        except (ValueError, OverflowError) as error:
            raise _unreadable(path, where, "has a column that is no number") from error
        if home is None:
            home = _home(path, where, values[4:])
        else:
            items.append(_item(path, where, seq, frame, command, values, bool(autocontinue)))
    if home is None:
        raise BadInput(path.name, "it has no items", "Export the mission again.")
    return Mission(home=home, items=tuple(items))


def write_plan(mission: Mission | FlightPlan, path: Path) -> None:
    """QGroundControl's JSON; NaN is null."""
    mission = mission_of(mission) if isinstance(mission, FlightPlan) else mission
    content = {
        "fileType": "Plan",
        "geoFence": mission.fences,
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": mission.cruise_speed_m_s,
            "firmwareType": mission.firmware,
            "hoverSpeed": mission.speed_m_s,
            "items": [_simple_item(item) for item in mission.items],
            "plannedHomePosition": mission.home,
            "vehicleType": mission.vehicle,
            "version": 2,
        },
        "rallyPoints": mission.rally_points,
        "version": 1,
    }
    path.write_text(json.dumps(content, indent=4, allow_nan=False) + "\n", encoding="utf-8")


def read_plan(path: Path) -> Mission:
    try:
        content = json.loads(_text(path))
        mission = content["mission"]
        rows = [(row["type"], row) for row in mission["items"]]
        home = mission["plannedHomePosition"]
        rest = {
            "speed_m_s": mission["hoverSpeed"],
            "cruise_speed_m_s": mission["cruiseSpeed"],
            "firmware": mission["firmwareType"],
            "vehicle": mission["vehicleType"],
            "fences": content["geoFence"],
            "rally_points": content["rallyPoints"],
        }
        items = []
        for number, (kind, row) in enumerate(rows, start=1):
            where = f"item {number}"
            if kind != "SimpleItem":
                raise _unreadable(path, where, "is a pattern that only QGroundControl can expand")
            values = tuple(_number(v) for v in row["params"])
            seq = row.get("doJumpId", number)
            items.append(
                _item(path, where, seq, row["frame"], row["command"], values, row.get("autoContinue", True))
            )
        return Mission(home=_home(path, "plannedHomePosition", home), items=tuple(items), **rest)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadInput(
            path.name, f"it is no QGroundControl plan ({type(error).__name__}: {error})", "Save it again."
        ) from error


def _line(seq: int, current: int, frame: int, command: int, values: tuple[float | None, ...]) -> str:
    numbers = [("nan" if v is None else repr(float(v))) for v in values]
    for k in (4, 5):
        value = values[k]
        numbers[k] = "nan" if value is None else f"{value:.8f}"
    return "\t".join([str(seq), str(current), str(frame), str(command), *numbers, "1"])


def _simple_item(item: MissionItem) -> dict[str, Any]:
    frame = _FILE_FRAME.get(item.frame, item.frame)
    row = {
        "autoContinue": True,
        "command": item.command,
        "doJumpId": item.seq,
        "frame": frame,
        "params": list(_parameters(item)),
        "type": "SimpleItem",
    }
    if item.command in _WITH_POSITION and frame in (0, 3):
        row |= {"AMSLAltAboveTerrain": None, "Altitude": item.z, "AltitudeMode": 1 if frame == 3 else 2}
    return row


def _has_degrees(command: int, frame: int) -> bool:
    return command in _WITH_POSITION and frame != _MISSION_FRAME


def _parameters(item: MissionItem) -> tuple[float | None, ...]:
    """The seven parameters as files have them; None is NaN."""
    scale = 1e7 if _has_degrees(item.command, item.frame) else 1.0
    x, y = (None if value == _NAN_INT else value / scale for value in (item.x, item.y))
    return (item.param1, item.param2, item.param3, item.param4, x, y, item.z)


def _item(
    path: Path,
    where: str,
    seq: int,
    frame: int,
    command: int,
    values: tuple[float | None, ...],
    autocontinue: bool,
) -> MissionItem:
    if len(values) != 7:
        raise _unreadable(path, where, f"has {len(values)} parameters, not 7")
    if not autocontinue:
        raise _unreadable(path, where, "waits for the pilot to go on (autocontinue 0), which is not flown")
    *params, x, y, z = values
    degrees = _has_degrees(command, frame)
    if degrees and (abs(x or 0.0) > 90 or abs(y or 0.0) > 180):
        raise _unreadable(path, where, f"lies at {x}°, {y}°, which is no place on Earth")
    scale = 1e7 if degrees else 1.0
    whole = [_NAN_INT if value is None else round(value * scale) for value in (x, y)]
    if not degrees and any(v is not None and v != w for v, w in zip((x, y), whole, strict=True)):
        raise _unreadable(path, where, "has a fraction in parameter 5 or 6, which MAVLink sends as integers")
    if z is None:
        raise _unreadable(path, where, "has no altitude")
    return MissionItem(
        seq=seq,
        frame=_INT_FRAME.get(frame, frame),
        command=command,
        **{f"param{k}": value for k, value in enumerate(params, start=1)},
        x=whole[0],
        y=whole[1],
        z=z,
    )


def _home(path: Path, where: str, values: Any) -> Vector3:
    latitude, longitude, altitude = values
    if latitude is None or longitude is None or abs(latitude) > 90 or abs(longitude) > 180:
        raise _unreadable(path, where, "is no home position on Earth")
    return float(latitude), float(longitude), float(altitude or 0.0)


def _number(value: Any) -> float | None:
    """A number, or None for NaN however it is written."""
    if value is None or math.isnan(value):
        return None
    if math.isinf(value):
        raise ValueError("infinity")
    return float(value)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(path.name, "it cannot be read as text", "Check the path and the file.") from error


def _unreadable(path: Path, where: str, what: str) -> BadInput:
    return BadInput(path.name, f"{where} {what}", "Correct it in the ground station and save it again.")
