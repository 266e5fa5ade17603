"""A small flight in front of a wall, for tests."""

from schemas.camera import Camera
from schemas.flight_plan import FlightPlan, Waypoint
from schemas.geodesy import GeoOrigin
from schemas.vehicle import Vehicle

ORIGIN = GeoOrigin(latitude_deg=-35.363261, longitude_deg=149.165230, altitude_m=584.0)


def wall_plan(columns: int = 4, rows: int = 2, vehicle: Vehicle | None = None) -> FlightPlan:
    """Rows of shooting points 0.6 m apart, facing north, then one photo straight up ("soffit")."""
    home = (0.0, -10.0, 0.5)
    waypoints = [Waypoint(kind="intermediate", position_m=(0.0, -10.0, 4.0), yaw_deg=0.0)]
    for row in range(rows):
        order = range(columns) if row % 2 == 0 else reversed(range(columns))
        waypoints += [
            Waypoint(
                kind="shooting",
                position_m=(0.6 * column, -4.0, 3.0 + 0.5 * row),
                yaw_deg=0.0,
                surface="wall",
                photo=f"wall-{row}{column:02d}",
            )
            for column in order
        ]
    waypoints += [
        Waypoint(
            kind="shooting",
            position_m=(2.0, -6.0, 3.0),
            yaw_deg=120.0,
            pitch_deg=90.0,
            surface="soffit",
            photo="soffit-1",
        ),
        Waypoint(kind="intermediate", position_m=(0.0, -10.0, 4.0), yaw_deg=200.0),
    ]
    return FlightPlan(
        camera=Camera(width_px=1632, height_px=1224, focal_px=4000.0),
        vehicle=vehicle or Vehicle(position_bias_m=0.1, position_jitter_m=0.03),
        origin=ORIGIN,
        home_m=home,
        waypoints=tuple(waypoints),
        coverage=(),
        length_m=0.0,
        duration_s=0.0,
        overlap=0.5,
    )
