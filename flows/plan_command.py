"""`hairline plan`: from surfaces to flights, or a table of what a camera could do, on plain files."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import yaml
from cyclopts import Parameter
from pydantic import ValidationError
from rich.table import Table

from flows.command_line import app
from flows.console import err
from flows.console import out as console
from flows.explain import explain
from flows.option_types import Gsd, Model, Positive, PositiveOrNone, bad_option
from flows.plain_files import Many, read_camera, read_contract, say, warn, working
from flows.structure_commands import enter_beside
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.utm import UTM_ZONE
from schemas.vehicle import Vehicle

if TYPE_CHECKING:
    from schemas.camera import Camera
    from schemas.flight_plan import FlightPlan
    from schemas.geodesy import GeoOrigin
    from schemas.structure import Structure

Six = tuple[float, float, float, float, float, float]
USUAL_GIMBAL_DEG = 35.0  # up: of a Mavic 3 Enterprise; a Matrice's cameras reach 30°


@app.command
def plan(
    surfaces: Path | None = None,
    *,
    camera: Path,
    out: Annotated[Path | None, Parameter(name="--out")] = None,
    gsd_mm_px: Gsd = None,
    smallest_crack_mm: float | None = None,
    overlap: float | None = None,
    inspect: Annotated[tuple[str, ...], Many] = (),
    clearance_m: float | None = None,
    radius_m: float | None = None,
    home_m: tuple[float, float, float] | None = None,
    origin: tuple[float, float, float] | None = None,
    utm_zone: str | None = None,
    anchor: list[Six] | None = None,
    free: list[Six] | None = None,
    close_ups: Path | None = None,
    what_if: Annotated[bool, Parameter(negative=())] = False,
    stand_off_m: PositiveOrNone = None,
    area_m2: Positive = 100.0,
) -> None:
    """Plan collision-free flights: D/plan.json and for each D/mission.waypoints, .plan, .kmz, .kml and .csv.

    Parameters
    ----------
    surfaces:
        The surfaces.json of `hairline surfaces`, its occupied.ply beside it.
    camera:
        YAML with width_px, height_px, and focal_px (or focal_mm and sensor_width_mm). An inspection file does
        too; its vehicle and plan then count where no option says otherwise.
    out:
        Folder to write to.
    gsd_mm_px:
        Ground sample distance, mm per pixel. Default: the smallest crack's width.
    smallest_crack_mm:
        Smallest crack to detect, mm. Default: 0.3.
    overlap:
        Of neighbouring photos, 0.1 to below 0.95, widened for the position error. Default: 0.6.
    inspect:
        Names of the surfaces to inspect. Default: all but the ground.
    clearance_m:
        Least distance between vehicle and anything else, metres. Default: 1.
    radius_m:
        Half the vehicle's largest diagonal, propellers included, metres. Default: 0.4.
    home_m:
        Take-off and landing place, east north up, metres. Default: a free place beside the structure.
    origin:
        Latitude, longitude (degrees) and altitude (metres) of the world's origin (WGS84).
    utm_zone:
        Instead of the origin, for scans in UTM: 32N, 56S… Not needed where LAS, LAZ or E57 files state it.
    anchor:
        Instead of the origin, twice: a point of the model, x y z in metres, and its latitude, longitude
        (degrees) and altitude (metres). The model may be turned from north.
    free:
        A box that you vouch for as free of obstacles though no scanner saw it: its low and high corner, east
        north up, metres. May be given several times.
    close_ups:
        The cracks.json of an earlier pass: plan close-ups of these cracks.
    what_if:
        No plan, a table: crack width, ground sample distance, stand-off, photos and batteries of this camera.
    stand_off_m:
        With --what-if: what is seen from this distance, metres.
    area_m2:
        With --what-if: area to photograph, square metres.
    """
    from flows.given_structure import read_structure

    structure = read_structure(surfaces) if surfaces is not None else None
    lens = read_camera(camera)
    vehicle, settings = _sections(
        camera,
        {"clearance_m": clearance_m, "radius_m": radius_m},
        {
            "gsd_mm_px": gsd_mm_px,
            "smallest_crack_mm": smallest_crack_mm,
            "overlap": overlap,
            "surfaces": inspect or None,
            "free_m": [{"low_m": box[:3], "high_m": box[3:]} for box in free] if free else None,
        },
    )
    if what_if:
        _what_if(lens, vehicle, settings, area_m2, stand_off_m)
        return
    if surfaces is None or structure is None or out is None:
        raise BadInput("plan", "needs surfaces.json and --out", "Give both, or --what-if for a table alone")
    where = _where(structure, origin, anchor, utm_zone)
    _plan(surfaces, structure, out, lens, vehicle, settings, home_m, where, close_ups)


def _plan(
    surfaces: Path,
    structure: "Structure",
    out: Path,
    camera: "Camera",
    vehicle: Vehicle,
    settings: PlanSettings,
    home_m: tuple[float, float, float] | None,
    origin: "GeoOrigin | None",
    close_ups: Path | None,
) -> None:
    from flows.collect_images import REHEARSAL_ORIGIN
    from flows.results import write_flight_plan
    from schemas.crack_report import CrackReport
    from tasks.planning.task import effort, plan_flight

    cracks = read_contract(close_ups, CrackReport).cracks if close_ups else ()
    where = origin or REHEARSAL_ORIGIN
    about = effort(structure, camera, vehicle, settings, cracks)
    gsd = settings.asked_gsd_mm_px
    kind = f"close-ups of {len(cracks)} cracks" if cracks else "photos"
    say(
        f"About {about.photos:,} {kind} at {gsd:g} mm/px, {about.hours:.1f} h of flight,"
        f" {about.batteries} batteries"
    )
    with working(out):
        enter_beside(surfaces, "occupied.ply", structure.occupied.sha256)
        planned = plan_flight.bare(structure, camera, vehicle, where, home_m, settings, cracks)
        write_flight_plan(out, planned, copy=True)
    photos, minutes = len(planned.shooting_points), planned.duration_s / 60
    many = f" in {len(planned.flights)} flights" if len(planned.flights) > 1 else ""
    say(f"{photos} photos, {planned.length_m:.0f} m, {minutes:.1f} min{many}: {out / 'plan.json'}")
    say(planned.way_home)
    warn(planned.left_out)
    if (doubt := looks_up(planned, vehicle)) is not None:
        err.print(f"[yellow]Warning: {doubt}[/yellow]")
    if origin is None:
        err.print(
            "[yellow]Warning: no --origin, --anchor or --utm-zone: the mission lies at ArduPilot's simulator,"
            " not at yours[/yellow]"
        )


def looks_up(planned: "FlightPlan", vehicle: Vehicle) -> str | None:
    """A doubt whether the gimbal can, where nobody stated its range."""
    steep = [w.pitch_deg for w in planned.shooting_points if w.pitch_deg > USUAL_GIMBAL_DEG]
    if not steep or "gimbal_pitch_max_deg" in vehicle.model_fields_set:
        return None
    seen = f"{len(steep)} photos look up by as much as {max(steep):.0f}°, which few gimbals do"
    return f"{seen}: state vehicle.gimbal_pitch_max_deg"


def _where(
    structure: "Structure",
    origin: tuple[float, float, float] | None,
    anchors: list[Six] | None,
    utm_zone: str | None,
) -> "GeoOrigin | None":
    from schemas.geodesy import GeoOrigin, KnownPoint

    if origin and anchors:
        raise BadInput("--anchor", "an origin is given too", "Give the one or the other")
    if utm_zone and (origin or anchors):
        raise BadInput("--utm-zone", "an origin or anchors are given too", "Give the one or the other")
    if utm_zone and not re.fullmatch(UTM_ZONE, utm_zone):
        raise BadInput("--utm-zone", f"{utm_zone!r} is no zone", "Write 32N, or 32S south of the equator")
    try:
        if anchors:
            found = structure.anchored(
                [
                    KnownPoint(model_m=a[:3], latitude_deg=a[3], longitude_deg=a[4], altitude_m=a[5])
                    for a in anchors
                ]
            )
            say(
                f"Origin {found.latitude_deg:.7f}°, {found.longitude_deg:.7f}°, model turned"
                f" {found.heading_deg:.2f}° from north; {found.residual_m:.2f} m left at the known points"
            )
            return found
        if origin:
            stated = GeoOrigin(latitude_deg=origin[0], longitude_deg=origin[1], altitude_m=origin[2])
            return structure.origin_as_stated(stated)
        return structure.geo_origin(utm_zone)
    except ValidationError as problem:
        raise explain("--anchor" if anchors else "--origin", problem, GeoOrigin) from None


def _what_if(
    camera: "Camera", vehicle: Vehicle, settings: PlanSettings, area_m2: float, stand_off_m: float | None
) -> None:
    from tasks.planning.task import what_if

    table = Table(title=f"{area_m2:g} m² at {settings.overlap:.0%} overlap", title_justify="left")
    for heading in (
        *("detects\nmm", "measures\nmm", "mm/px", "stand-\noff m", "sharp\n± m", "photos\nper m²"),
        *("photos", "hours", "batteries"),
    ):
        table.add_column(heading, justify="right")
    refused = ""
    rows = what_if(camera, vehicle, settings.overlap, area_m2, stand_off_m)
    for one, takes in rows:
        depth = f"{one.depth_of_field_m:.3f}" if one.depth_of_field_m is not None else "-"
        seen = [f"{one.detects_mm:.2f}", f"{one.measures_mm:.2f}", f"{one.gsd_mm_px:.3f}"]
        if one.refused:
            refused = refused or one.refused
            table.add_row(*seen, "not flown", depth, *["-"] * 4)
            continue
        counts = [
            f"{one.photos_per_m2:.2f}",
            f"{takes.photos:,}",
            f"{takes.hours:.1f}",
            f"{takes.batteries:,}",
        ]
        table.add_row(*seen, f"{one.planned_m:.2f}", depth, *counts)
    console.print(table)
    first = rows[0][0]
    say(
        f"Sharp to half a pixel at 1/{1 / camera.shutter_s:.0f} s: gimbal and nose slower than"
        f" {first.sharp_to_deg_s:.2f} °/s, and at {first.gsd_mm_px:g} mm/px slower than"
        f" {first.sharp_to_m_s:.2f} m/s: the vehicle stops for each photo"
    )
    if refused:
        say(f"Not flown: {refused}")


def _sections(path: Path, vehicle: dict[str, Any], asked: dict[str, Any]) -> tuple[Vehicle, PlanSettings]:
    """The file's vehicle and plan, where it has them, with the options that were given."""
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    content = content if isinstance(content, dict) else {}

    return (
        _section(path, content.get("vehicle"), Vehicle, vehicle),
        _section(path, content.get("plan"), PlanSettings, asked),
    )


def _section(path: Path, given: object, contract: type[Model], options: dict[str, Any]) -> Model:
    stated = {key: value for key, value in options.items() if value is not None}
    try:
        return contract.model_validate({**(given if isinstance(given, dict) else {}), **stated})
    except ValidationError as problem:
        if problem.errors()[0]["loc"][0] in stated:
            raise bad_option(problem) from None
        raise explain(str(path), problem, contract) from None
