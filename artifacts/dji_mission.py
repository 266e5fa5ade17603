"""DJI's mission format (WPML 1.0.2): a KMZ with `wpmz/template.kml` to edit and the executable
`wpmz/waylines.wpml`. https://developer.dji.com/doc/cloud-api-tutorial/en/api-reference/dji-wpml/overview.html

Written for a Mavic 3 Enterprise with its wide camera; DJI Pilot 2 asks for another aircraft when it opens it.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from schemas.flight_plan import FlightPlan, Waypoint

KML, WPML = "http://www.opengis.net/kml/2.2", "http://www.dji.com/wpmz/1.0.2"
AIRCRAFT, CAMERA = 77, 66  # Mavic 3 Enterprise and its camera, as DJI numbers them
LEAST_SECURITY_HEIGHT_M = 1.2  # that the format allows
STOPPED = "toPointAndStopWithDiscontinuityCurvature"  # straight legs, a stop at each waypoint


def write_dji(plan: FlightPlan, path: Path) -> None:
    """The KMZ of a plan of one flight. Heights count from the take-off place; the flight lands where its last
    waypoint is, above home, so that no return flies a way that was never checked."""
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, executable in (("wpmz/template.kml", False), ("wpmz/waylines.wpml", True)):
            root = _document(plan, executable)
            indent(root)
            content = b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="utf-8") + b"\n"
            archive.writestr(ZipInfo(name), content)  # its date is 1980: the same plan gives the same bytes


def _document(plan: FlightPlan, executable: bool) -> Element:
    root = Element("kml", {"xmlns": KML, "xmlns:wpml": WPML})
    document = SubElement(root, "Document")
    if not executable:
        _put(document, author="Hairline", createTime=0, updateTime=0)
    height = max(plan.waypoints[0].position_m[2] - plan.home_m[2], LEAST_SECURITY_HEIGHT_M)
    mission = _group(
        document,
        "missionConfig",
        flyToWaylineMode="safely",
        finishAction="autoLand",
        exitOnRCLost="goContinue",
        executeRCLostAction="hover",
        takeOffSecurityHeight=round(height, 2),
        globalTransitionalSpeed=plan.vehicle.speed_m_s,
    )
    _group(mission, "droneInfo", droneEnumValue=AIRCRAFT, droneSubEnumValue=0)
    _group(mission, "payloadInfo", payloadEnumValue=CAMERA, payloadSubEnumValue=0, payloadPositionIndex=0)
    folder = SubElement(document, "Folder")
    if executable:
        _put(folder, templateId=0, executeHeightMode="relativeToStartPoint", waylineId=0)
        _put(folder, distance=plan.length_m, duration=plan.duration_s)
    else:
        _put(folder, templateType="waypoint", templateId=0)
        _group(
            folder,
            "waylineCoordinateSysParam",
            coordinateMode="WGS84",
            heightMode="relativeToStartPoint",
            positioningType="GPS",
        )
    _put(folder, autoFlightSpeed=plan.vehicle.speed_m_s)
    if not executable:
        _put(
            folder, gimbalPitchMode="usePointSetting", globalWaypointTurnMode=STOPPED, globalUseStraightLine=1
        )
    for index, waypoint in enumerate(plan.waypoints):
        _placemark(folder, plan, index, waypoint, executable)
    return root


def _placemark(folder: Element, plan: FlightPlan, index: int, waypoint: Waypoint, executable: bool) -> None:
    latitude, longitude, _ = plan.origin.to_geographic(waypoint.position_m)
    height = round(waypoint.position_m[2] - plan.home_m[2], 3)
    placemark = SubElement(folder, "Placemark")
    SubElement(SubElement(placemark, "Point"), "coordinates").text = f"{longitude:.9f},{latitude:.9f}"
    _put(placemark, index=index)
    if executable:
        _put(placemark, executeHeight=height)
    else:
        _put(placemark, useGlobalHeight=0, ellipsoidHeight=height, height=height)
    _put(placemark, waypointSpeed=plan.vehicle.speed_m_s)
    heading = _heading_deg(plan.origin.compass_deg(waypoint.yaw_deg))
    _group(
        placemark,
        "waypointHeadingParam",
        waypointHeadingMode="smoothTransition",
        waypointHeadingAngle=heading,
        waypointHeadingPathMode="followBadArc",  # DJI's name for the shorter way
    )
    _group(placemark, "waypointTurnParam", waypointTurnMode=STOPPED, waypointTurnDampingDist=0)
    _put(placemark, useStraightLine=1)
    if waypoint.kind != "shooting":
        return
    group = _group(
        placemark,
        "actionGroup",
        actionGroupId=index,
        actionGroupStartIndex=index,
        actionGroupEndIndex=index,
        actionGroupMode="sequence",
    )
    _group(group, "actionTrigger", actionTriggerType="reachPoint")
    pitch: dict[str, str | float] = {
        "gimbalHeadingYawBase": "north",
        "gimbalRotateMode": "absoluteAngle",
        "gimbalPitchRotateEnable": 1,
        "gimbalPitchRotateAngle": round(waypoint.pitch_deg, 2),
        "gimbalRollRotateEnable": 0,
        "gimbalRollRotateAngle": 0,
        "gimbalYawRotateEnable": 0,
        "gimbalYawRotateAngle": 0,
        "gimbalRotateTimeEnable": 0,
        "gimbalRotateTime": 0,
        "payloadPositionIndex": 0,
    }
    actions: Iterable[tuple[str, dict[str, str | float]]] = (
        ("gimbalRotate", pitch),
        ("rotateYaw", {"aircraftHeading": heading, "aircraftPathMode": "clockwise"}),
        ("hover", {"hoverTime": math.ceil(plan.vehicle.hold_s)}),
        ("takePhoto", {"payloadPositionIndex": 0, "fileSuffix": waypoint.photo or ""}),
    )
    for number, (name, parameters) in enumerate(actions):
        action = _group(group, "action", actionId=number, actionActuatorFunc=name)
        _group(action, "actionActuatorFuncParam", **parameters)


def _heading_deg(yaw_deg: float) -> float:
    """In −180…180."""
    return round((yaw_deg + 180.0) % 360.0 - 180.0, 2)


def _group(parent: Element, name: str, **values: str | float) -> Element:
    group = SubElement(parent, f"wpml:{name}")
    _put(group, **values)
    return group


def _put(parent: Element, **values: str | float) -> None:
    for name, value in values.items():
        SubElement(parent, f"wpml:{name}").text = str(value)
