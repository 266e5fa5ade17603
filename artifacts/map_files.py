"""A plan to look at: KML (path, shooting points, views in any globe) and CSV (every waypoint in a table)."""

import csv
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from schemas.contract import Vector3
from schemas.flight_plan import FlightPlan

COLUMNS = (
    *("waypoint", "kind", "latitude_deg", "longitude_deg", "height_above_home_m"),
    *("east_m", "north_m", "up_m", "yaw_deg", "pitch_deg", "surface", "photo"),
)
# yaw_deg is clockwise from north; east_m and north_m lie along the axes of the plan's own frame.
GAZE_M = 1.0  # of the line drawn along each view


def write_kml(plan: FlightPlan, path: Path) -> None:
    """Heights are above mean sea level, as the plan's origin states them."""
    root = Element("kml", {"xmlns": "http://www.opengis.net/kml/2.2"})
    document = SubElement(root, "Document")
    SubElement(document, "name").text = f"Hairline, {len(plan.shooting_points)} photos"
    home = (plan.home_m, *(w.position_m for w in plan.waypoints), plan.home_m)
    _line(document, "path", plan, home)
    for waypoint in plan.shooting_points:
        gaze = waypoint.pose.R_world_camera[:, 2] * GAZE_M
        x, y, z = (float(a + b) for a, b in zip(waypoint.position_m, gaze, strict=True))
        placemark = SubElement(document, "Placemark")
        SubElement(placemark, "name").text = waypoint.photo
        yaw_deg = plan.origin.compass_deg(waypoint.yaw_deg)
        look = f"yaw {yaw_deg:.1f}°, pitch {waypoint.pitch_deg:.1f}°, {waypoint.surface}"
        SubElement(placemark, "description").text = look
        both = SubElement(placemark, "MultiGeometry")
        point = SubElement(both, "Point")
        SubElement(point, "altitudeMode").text = "absolute"
        SubElement(point, "coordinates").text = _coordinates(plan, waypoint.position_m)
        _add_line(both, plan, (waypoint.position_m, (x, y, z)))
    indent(root)
    path.write_bytes(b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n")


def _line(document: Element, name: str, plan: FlightPlan, places: tuple[Vector3, ...]) -> None:
    placemark = SubElement(document, "Placemark")
    SubElement(placemark, "name").text = name
    _add_line(placemark, plan, places)


def _add_line(parent: Element, plan: FlightPlan, places: tuple[Vector3, ...]) -> None:
    line = SubElement(parent, "LineString")
    SubElement(line, "altitudeMode").text = "absolute"
    SubElement(line, "coordinates").text = " ".join(_coordinates(plan, place) for place in places)


def _coordinates(plan: FlightPlan, place: Vector3) -> str:
    latitude, longitude, altitude = plan.origin.to_geographic(place)
    return f"{longitude:.9f},{latitude:.9f},{altitude:.3f}"


def write_csv(plan: FlightPlan, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(COLUMNS)
        for number, w in enumerate(plan.waypoints, start=1):
            latitude, longitude, _ = plan.origin.to_geographic(w.position_m)
            place = [f"{latitude:.9f}", f"{longitude:.9f}", f"{w.position_m[2] - plan.home_m[2]:.3f}"]
            local = [f"{x:.4f}" for x in w.position_m]
            angles = [f"{plan.origin.compass_deg(w.yaw_deg):.2f}", f"{w.pitch_deg:.2f}"]
            table.writerow([number, w.kind, *place, *local, *angles, w.surface or "", w.photo or ""])
