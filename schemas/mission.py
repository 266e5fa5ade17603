"""A plan as MAVLink mission items, the form that vehicles and ground stations share."""

import math

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.contract import Contract, Vector3
from schemas.flight_plan import FlightPlan, Waypoint
from schemas.problem import BadInput

MOUNT_MODE_TARGETING = float(mavlink.MAV_MOUNT_MODE_MAVLINK_TARGETING)
MOST_ITEMS = 650  # ArduPilot answers MAV_MISSION_NO_SPACE to more
GROUND_SPEED = float(mavlink.SPEED_TYPE_GROUNDSPEED)
GIMBAL_RATE_DEG_S = 30.0  # slow end of what drone gimbals do
# The shortest hold that ArduPilot keeps. Without any ArduCopter does not stop at a waypoint but rounds the
# corner (ModeAuto::set_next_wp, SCurve), up to WPNAV_RADIUS off the planned path: 2 m as delivered.
STOP_S = 1.0
LEAST_M = 0.01  # a height of 0 is none to ArduCopter, which then keeps its own (ModeAuto::loc_from_cmd)


class MissionItem(Contract):
    """One MISSION_ITEM_INT. x, y are degrees · 1e7; z is metres above home in frame 6
    (MAV_FRAME_GLOBAL_RELATIVE_ALT_INT); `None` stands for a parameter that is not used (NaN)."""

    seq: int
    frame: int
    command: int
    param1: float | None = 0.0
    param2: float | None = 0.0
    param3: float | None = 0.0
    param4: float | None = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    photo: str | None = None  # of a camera trigger: the photo that it takes


def mission_items(plan: FlightPlan) -> tuple[MissionItem, ...]:
    """The mission of a plan of one flight: home, take-off, a stop above home, the speed, each waypoint,
    landing at home.

    Raises BadInput for a plan of several flights, and for more items than a vehicle takes.

    ArduPilot starts the commands that follow a waypoint when it leaves it, and turns the nose along the path
    on every new leg. So gimbal and yaw of a waypoint are commanded on the way to it, and a shooting point is
    a waypoint with a hold (longer where the turn takes longer than the leg), then CONDITION_YAW once more,
    which holds the trigger behind it back until the nose is within 2°. Every other waypoint has a hold too:
    where the vehicle does not stop, it leaves the path that is known to be free.
    """
    if len(plan.flights) > 1:
        raise BadInput("plan", f"it has {len(plan.flights)} flights", "Name the one to fly.")
    items: list[MissionItem] = []

    def add(
        command: int,
        position: Vector3 | None = None,
        x: int = 0,
        z: float = 0.0,
        photo: str | None = None,
        **params: float,
    ) -> None:
        y, frame = 0, mavlink.MAV_FRAME_MISSION
        if position is not None:
            latitude, longitude, _ = plan.origin.to_geographic(position)
            x, y = round(latitude * 1e7), round(longitude * 1e7)
            z = round(position[2] - plan.home_m[2], 2)  # ArduPilot keeps centimetres
            if command == mavlink.MAV_CMD_NAV_WAYPOINT and items and z == 0.0:
                z = LEAST_M
            frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
        items.append(
            MissionItem(seq=len(items), frame=frame, command=command, x=x, y=y, z=z, photo=photo, **params)
        )

    def face(yaw_deg: float) -> None:
        add(mavlink.MAV_CMD_CONDITION_YAW, param1=round(plan.origin.compass_deg(yaw_deg) % 360.0, 2) % 360.0)

    add(mavlink.MAV_CMD_NAV_WAYPOINT, plan.home_m)  # item 0 is home by ArduPilot's convention
    here, yaw_deg, pitch_deg = _above_home(plan), 0.0, 0.0
    add(mavlink.MAV_CMD_NAV_TAKEOFF, here)
    waypoints = plan.waypoints
    if waypoints and (waypoints[0].position_m != here or waypoints[0].kind == "shooting"):
        above = Waypoint(kind="intermediate", position_m=here, yaw_deg=waypoints[0].yaw_deg)
        waypoints = (above, *waypoints)
    facing = False  # whether a command on this leg already holds the nose at yaw_deg
    for number, waypoint in enumerate(waypoints):
        if number == 1:
            # Else the vehicle flies at its own WPNAV_SPEED, 10 m/s as delivered, which nothing was planned
            # for. Between take-off and a first waypoint Copter 4.1 to 4.4 forgets it (ArduPilot issue 21080).
            add(mavlink.MAV_CMD_DO_CHANGE_SPEED, param1=GROUND_SPEED, param2=plan.vehicle.speed_m_s)
        turn_s = abs((waypoint.yaw_deg - yaw_deg + 180.0) % 360.0 - 180.0) / plan.vehicle.yaw_rate_deg_s
        tilt_s = 0.0
        if waypoint.kind == "shooting" and waypoint.pitch_deg != pitch_deg:
            tilt_s = abs(waypoint.pitch_deg - pitch_deg) / GIMBAL_RATE_DEG_S
            pitch_deg = waypoint.pitch_deg
            add(mavlink.MAV_CMD_DO_MOUNT_CONTROL, param1=pitch_deg, z=MOUNT_MODE_TARGETING)
            facing = False  # up to 4.5 ArduCopter turns the nose to north where the gimbal does not pan
        if not facing or turn_s > 0.0:
            face(waypoint.yaw_deg)
        if waypoint.kind == "shooting":
            on_the_way_s = math.dist(here, waypoint.position_m) / plan.vehicle.speed_m_s
            wait_s = max(0.0, turn_s - on_the_way_s, tilt_s - on_the_way_s)
            hold_s = max(STOP_S, math.ceil(plan.vehicle.hold_s + wait_s))  # ArduPilot keeps whole seconds
            add(mavlink.MAV_CMD_NAV_WAYPOINT, waypoint.position_m, param1=hold_s)
            face(waypoint.yaw_deg)
            add(mavlink.MAV_CMD_DO_DIGICAM_CONTROL, photo=waypoint.photo, x=1)  # x is "shoot"
        else:
            add(mavlink.MAV_CMD_NAV_WAYPOINT, waypoint.position_m, param1=STOP_S)
        facing = waypoint.kind == "shooting"
        here, yaw_deg = waypoint.position_m, waypoint.yaw_deg
    add(mavlink.MAV_CMD_NAV_LAND, plan.home_m)
    if len(items) > MOST_ITEMS:
        raise BadInput(
            "plan",
            f"its mission has {len(items)} items, and a vehicle takes at most {MOST_ITEMS}",
            "Plan again: the flights are split so that each fits.",
        )
    return tuple(items)


def _above_home(plan: FlightPlan) -> Vector3:
    """Where take-off ends: at the first waypoint's height, at least 2 m up."""
    height_m = plan.waypoints[0].position_m[2] if plan.waypoints else plan.home_m[2]
    return (plan.home_m[0], plan.home_m[1], max(height_m, plan.home_m[2] + 2.0))
