"""Surfaces become a flight plan, the plan a flight, the flight a log and photos (paper, section 2.3)."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from artifacts import store
from flows.battery_change import wait_for_battery
from flows.external_flight import photos_and_logs
from flows.given_photos import PhotoSource, given_photos, position_sigma_m
from flows.inspection_flow import inspection_flow
from flows.model_structure import has_scans, model
from flows.opening import opened
from schemas.flight_log import FlightLog, joined
from schemas.flight_plan import FlightPlan
from schemas.geodesy import GeoOrigin
from schemas.inspection import Inspection, SimulationInput
from schemas.problem import BadInput, LeftOut
from schemas.structure import Structure
from schemas.surface import Surface
from tasks import run
from tasks.flight.task import fly, import_log
from tasks.planning.task import plan_flight
from tasks.simulation.task import photograph, photograph_wall, start_vehicle

# Where a plan is anchored when the inspection gives no origin: the home of ArduPilot's own simulator, so
# that the mission can be rehearsed there but nobody takes it for a real place.
REHEARSAL_ORIGIN = GeoOrigin(latitude_deg=-35.363262, longitude_deg=149.165237, altitude_m=584.0)


@dataclass(frozen=True)
class Collected:
    plan: FlightPlan | None = None
    log: FlightLog | None = None
    photos: tuple[PhotoSource, ...] = ()
    missing: tuple[LeftOut, ...] = ()
    surfaces: tuple[Surface, ...] = ()

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        return (*(self.plan.left_out if self.plan else ()), *self.missing)


def plan(inspection: Inspection, structure: Structure) -> FlightPlan:
    """Shooting points over the surfaces to inspect, and a collision-free path through them."""
    if inspection.camera is None:
        raise BadInput(
            "camera", "a flight cannot be planned without one", "Give the key 'camera' its size and lens"
        )
    return plan_flight(
        structure,
        inspection.camera.camera(),
        inspection.vehicle,
        where_it_lies(inspection, structure),
        inspection.home_m,
        inspection.plan,
    )


def where_it_lies(inspection: Inspection, structure: Structure) -> GeoOrigin:
    """The origin: stated, from known points, from the scans' map grid, or else that of a rehearsal."""
    if inspection.anchors and inspection.origin is not None:
        raise BadInput("anchors", "the inspection has an origin too", "Give the one or the other")
    if inspection.anchors:
        return structure.anchored(inspection.anchors)
    if inspection.origin is not None:
        return structure.origin_as_stated(inspection.origin)
    return structure.geo_origin(inspection.utm_zone) or REHEARSAL_ORIGIN


def collect(
    inspection: Inspection,
    base: Path,
    structure: Structure | None,
    save_plan: Callable[[FlightPlan], None],
) -> Collected:
    """Plan and fly as the inspection says, then bring the photos together with where they were taken.

    The plan is saved before the flight: whoever flies needs its mission files."""
    if inspection.simulation is not None and inspection.simulation.scene == "wall":
        return _simulated_wall(inspection.simulation)
    surfaces = structure.surfaces if structure else ()
    to_plan = inspection.camera is not None or (inspection.flight is not None and not inspection.photos)
    planned = plan(inspection, structure) if structure is not None and to_plan else None
    if planned is not None:
        save_plan(planned)
    if inspection.flight is None or planned is None:
        given, unreadable = given_photos(inspection, base, None)
        unused = _unused(inspection, structure)
        return Collected(planned, None, tuple(given), (*unreadable, *unused), surfaces)
    if inspection.flight == "external":
        photo_sets, paths = photos_and_logs(inspection, base)
        inspection = inspection.model_copy(update={"photos": photo_sets})
        log = joined([import_log(store.current().put(path), path.name, planned) for path in paths])
        log = log.model_copy(update={"missed": _not_shot(planned, log)})
    else:
        log = _flown(inspection, planned)
    simulated = inspection.simulation is not None and inspection.flight == "simulated"
    photos, unreadable = (
        (_simulated_photos(inspection, planned, log), [])
        if simulated
        else given_photos(inspection, base, log)
    )
    return Collected(planned, log, tuple(photos), (*unreadable, *_missed(log)), surfaces)


def _unused(inspection: Inspection, structure: Structure | None) -> tuple[LeftOut, ...]:
    """What the inspection gives of a flight although none can be planned: told, not passed over."""
    if inspection.flight is None:
        lacking, why = "flight", "nothing says whose flight it is of"
    else:
        lacking = "scans" if structure is None else "camera"
        why = f"no plan was made, since the key '{lacking}' is missing"
    given = [key for key in ("flight", "flight_log") if getattr(inspection, key) is not None]
    return tuple(
        LeftOut(item=key, stage="flight", what=f"not used: {why}", remedy=f"Give the key '{lacking}'")
        for key in given
    )


def _flown(inspection: Inspection, planned: FlightPlan) -> FlightLog:
    """Each flight of the plan in turn. A vehicle flies one of them a run, since its battery is changed then;
    a rehearsal flies all."""
    connection = inspection.connection if inspection.flight == "vehicle" else None
    if inspection.flight == "vehicle" and connection is None:
        raise BadInput("connection", "missing for 'flight: vehicle'", "Give it, as udpin:0.0.0.0:14550")
    legs = planned.each_flight
    flown = [fly.is_cached(leg, _mission(inspection, n), "", 30.0) for n, leg in enumerate(legs)]
    if run.current().dry or all(flown):
        return joined([fly(leg, _mission(inspection, n), "", 30.0) for n, leg in enumerate(legs)])
    seed = inspection.simulation.seed if inspection.simulation else 1
    logs = []
    for n, leg in enumerate(legs):
        if connection is None:
            with start_vehicle(leg, seed + n) as simulated:
                logs.append(fly(leg, _mission(inspection, n), simulated, 30.0))
            continue
        logs.append(fly(leg, _mission(inspection, n), connection, 30.0))
        if not flown[n] and n + 1 < len(legs):
            wait_for_battery(n + 1, len(legs))
    return joined(logs)


def _mission(inspection: Inspection, number: int) -> str:
    """The id that a flight of the plan is flown once under."""
    return inspection.mission if number == 0 else f"{inspection.mission} flight {number + 1}"


def _not_shot(planned: FlightPlan, log: FlightLog) -> tuple[str, ...]:
    """Also of flights that were not flown, or whose log is not there."""
    shot = {shot.photo for shot in log.shots}
    return tuple(w.photo for w in planned.shooting_points if w.photo is not None and w.photo not in shot)


def _missed(log: FlightLog) -> tuple[LeftOut, ...]:
    said = f"; the vehicle said: {'; '.join(log.said)}" if log.said else ""
    return tuple(
        LeftOut(item=photo, stage="flight", what=f"planned but not shot{said}", remedy="Fly a new mission id")
        for photo in log.missed
    )


def _simulated_photos(inspection: Inspection, planned: FlightPlan, log: FlightLog) -> list[PhotoSource]:
    assert inspection.simulation is not None
    shots = {shot.photo: shot for shot in log.shots}
    surfaces = sorted({point.surface for point in planned.shooting_points if point.surface})
    folders = photograph.each([(inspection.simulation, planned, surface) for surface in surfaces])
    return [
        PhotoSource(
            file=entry.file,
            name=entry.name,
            surface=surface,
            camera=planned.camera,
            pose=shot.pose if shot else None,
            position_sigma_m=position_sigma_m(inspection),
            velocity_m_s=shot.velocity_m_s if shot else None,
        )
        for surface, folder in zip(surfaces, folders, strict=True)
        if not isinstance(folder, BadInput)
        for entry in folder.entries
        for shot in [shots.get(Path(entry.name).stem)]
    ]


def _simulated_wall(simulation: SimulationInput) -> Collected:
    """The paper's wall needs no scan and no flight: it is photographed from known places."""
    taken = photograph_wall(simulation)
    poses = dict(taken.poses)
    photos = tuple(
        PhotoSource(
            file=entry.file,
            name=entry.name,
            surface=taken.surface.name,
            camera=taken.camera,
            pose=poses[entry.name],
            position_sigma_m=0.05,
        )
        for entry in taken.photos.entries
    )
    return Collected(photos=photos, surfaces=(taken.surface,))


@inspection_flow("collect-images", __doc__)
def collect_images(inspection: str = "demo:bridge", out: str | None = None) -> None:
    """inspection: path of the YAML file (or demo:bridge); out: the run's folder."""
    with opened(inspection, out) as open_run:
        structure = None
        if has_scans(open_run.inspection):
            modelled = model(open_run.inspection, open_run.base)
            open_run.save_model(modelled)
            structure = modelled.structure
        collected = collect(open_run.inspection, open_run.base, structure, open_run.save_plan)
        open_run.save_collected(collected)
