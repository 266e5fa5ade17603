"""`hairline register`, `surfaces` and `plan`: from scans to a flight plan, on plain files."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from flows.command_line import app
from flows.console import err
from flows.plain_files import (
    Many,
    OutFolder,
    one_by_one,
    read_camera,
    read_contract,
    say,
    warn,
    working,
)
from schemas.problem import BadInput

if TYPE_CHECKING:
    from schemas.scan import Scan


@app.command
def register(
    *scans: Path,
    out: OutFolder,
    unit: Literal["m", "cm", "mm", "ft", "in"] = "m",
    voxel_m: float = 0.02,
    tau_m: float = 0.10,
) -> None:
    """Register laser scans into one model: D/poses.json (T_world_scan, 4×4, metres), D/model.ply.

    Parameters
    ----------
    scans:
        Scan files: PLY, PCD, XYZ, CSV, PTS, PTX, E57, LAS, LAZ.
    out:
        Folder to write to.
    unit:
        Unit of the files' coordinates.
    voxel_m:
        Point spacing of the merged model, metres.
    tau_m:
        The paper's τ: points closer than this overlap, metres.
    """
    from flows.model_structure import METRES
    from flows.results import write_registration
    from schemas.scan import Scan
    from schemas.settings import RegistrationSettings
    from tasks.registration.task import register as register_scans

    with working(out):
        usable, left_out = one_by_one(list(scans), lambda path: ingested_scan(path, METRES[unit]))
        settings = RegistrationSettings(voxel_m=voxel_m, tau_m=tau_m)
        read: tuple[Scan, ...] = tuple(usable)
        model = register_scans.bare(read, settings)
        write_registration(out, model, copy=True)
    say(f"{len(model.stations)} scans registered, {model.points:,} points: {out / 'model.ply'}")
    warn([*left_out, *model.left_out])


def ingested_scan(path: Path, unit_m: float) -> "tuple[Scan, ...]":
    from artifacts import store
    from tasks.registration.task import ingest_scan

    if not path.is_file():
        raise BadInput(str(path), "no such file", "Correct the path")
    return ingest_scan.bare(store.current().put(path), path.name, unit_m, None, None)


@app.command
def surfaces(
    cloud: Path,
    *,
    out: OutFolder,
    unit: Literal["m", "cm", "mm", "ft", "in"] = "m",
    min_area_m2: float = 0.5,
    distance_m: float = 0.02,
    epsilon_m: float = 0.5,
) -> None:
    """Find flat surfaces and obstacles in a cloud: D/surfaces.json, D/occupied.ply.

    Parameters
    ----------
    cloud:
        The model.ply of `hairline register`, or any scan file.
    out:
        Folder to write to.
    unit:
        Unit of the file's coordinates.
    min_area_m2:
        Smaller patches are not surfaces, square metres.
    distance_m:
        RANSAC inlier distance, metres.
    epsilon_m:
        The paper's ε: obstacles are more than this apart, metres.
    """
    from flows.model_structure import METRES
    from flows.results import write_structure
    from schemas.settings import RegistrationSettings, SurfaceSettings
    from tasks.registration.task import register as register_scans
    from tasks.surfaces.task import extract

    with working(out):
        model = register_scans.bare(ingested_scan(cloud, METRES[unit]), RegistrationSettings())
        settings = SurfaceSettings(min_area_m2=min_area_m2, distance_m=distance_m, epsilon_m=epsilon_m)
        structure = extract.bare(model, settings)
        write_structure(out, structure, copy=True)
    say(f"{len(structure.surfaces)} surfaces, {len(structure.obstacles)} obstacles: {out / 'surfaces.json'}")
    warn(structure.left_out)


@app.command
def plan(
    surfaces: Path,
    *,
    camera: Path,
    out: OutFolder,
    gsd_mm_px: float | None = None,
    smallest_crack_mm: float = 0.3,
    overlap: float = 0.6,
    inspect: Annotated[tuple[str, ...], Many] = (),
    clearance_m: float = 1.0,
    radius_m: float = 0.4,
    home_m: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
) -> None:
    """Plan a collision-free flight: D/plan.json, D/mission.waypoints, D/mission.plan.

    Parameters
    ----------
    surfaces:
        The surfaces.json of `hairline surfaces`, its occupied.ply beside it.
    camera:
        YAML with width_px, height_px, and focal_px (or focal_mm and sensor_width_mm).
    out:
        Folder to write to.
    gsd_mm_px:
        Ground sample distance, mm per pixel. Default: the smallest crack's width.
    smallest_crack_mm:
        Smallest crack to detect, mm.
    overlap:
        Of neighbouring photos, 0.1 to 0.95, widened for the position error.
    inspect:
        Names of the surfaces to inspect. Default: all but the ground.
    clearance_m:
        Least distance between vehicle and anything else, metres.
    radius_m:
        Half the vehicle's largest diagonal, propellers included, metres.
    home_m:
        Take-off and landing place, east north up, metres. Default: a free place beside the structure.
    origin:
        Latitude, longitude (degrees) and altitude (metres) of the world's origin (WGS84).
    """
    from flows.collect_images import REHEARSAL_ORIGIN
    from flows.results import write_flight_plan
    from schemas.geodesy import GeoOrigin
    from schemas.settings import PlanSettings
    from schemas.structure import Structure
    from schemas.vehicle import Vehicle
    from tasks.planning.task import plan_flight

    structure = read_contract(surfaces, Structure)
    vehicle = Vehicle(clearance_m=clearance_m, radius_m=radius_m)
    lens = read_camera(camera)
    where = (
        GeoOrigin(latitude_deg=origin[0], longitude_deg=origin[1], altitude_m=origin[2])
        if origin
        else REHEARSAL_ORIGIN
    )
    settings = PlanSettings(
        gsd_mm_px=gsd_mm_px, smallest_crack_mm=smallest_crack_mm, overlap=overlap, surfaces=inspect or None
    )
    with working(out):
        enter_beside(surfaces, "occupied.ply", structure.occupied.sha256)
        planned = plan_flight.bare(structure, lens, vehicle, where, home_m, settings)
        write_flight_plan(out, planned)
    photos, minutes = len(planned.shooting_points), planned.duration_s / 60
    say(f"{photos} photos, {planned.length_m:.0f} m, {minutes:.1f} min: {out / 'plan.json'}")
    warn(planned.left_out)
    if origin is None:
        err.print(
            "[yellow]Warning: no --origin: the mission lies at ArduPilot's simulator, not at yours[/yellow]"
        )


def enter_beside(json_path: Path, name: str, sha256: str) -> None:
    """Put the file that a JSON refers to, and that lies beside it, into the store."""
    from artifacts import store

    path = json_path.parent / name
    if not path.is_file():
        raise BadInput(str(path), f"is missing beside {json_path.name}", "Keep the command's files together")
    if store.current().put(path).sha256 != sha256:
        raise BadInput(
            str(path),
            f"is not the file that {json_path.name} was written with",
            "Run `hairline surfaces` again",
        )
