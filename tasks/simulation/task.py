"""The simulator's stages: scans, photos, truth and score. Only flows and tests call them."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Literal

from artifacts import store
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.crack_report import CrackReport
from schemas.file import File, Folder
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection, SimulationInput
from schemas.mission import mission_items
from schemas.problem import BadInput
from schemas.scan import Scan
from schemas.simulation import Score, Truth, WallPhotos
from tasks.stage import progress, stage

if TYPE_CHECKING:
    from tasks.simulation.photography import Exposure

SHOWN = 6  # photos on the contact sheet


def demo_inspection(scene: str) -> Inspection:
    """The inspection of a built-in scene, ready to run."""
    from tasks.simulation.scenes import ready_inspection

    return ready_inspection(_scene(scene))


def scan_pages(inputs: Mapping[str, Any], scans: tuple[Scan, ...]) -> list[Page]:
    rows = [
        {
            "scan": scan.name,
            "megabytes": round(scan.file.size / 1e6, 1),
            "measured at m": ", ".join(f"{x:.2f}" for x in scan.station_position_m or ()),
        }
        for scan in scans
    ]
    return [Page(key="simulated-scans", table=rows)]


def photo_pages(inputs: Mapping[str, Any], photos: Folder | WallPhotos) -> list[Page]:
    from tasks.simulation.photography import contact_sheet

    folder = photos.photos if isinstance(photos, WallPhotos) else photos
    title = f"### {len(folder.entries)} photos"
    shown = folder.entries[:: max(len(folder.entries) // SHOWN, 1)][:SHOWN]
    if not shown:
        return [Page(key="photos", markdown=title)]
    picture = markdown_of(contact_sheet([store.current().path(e.file) for e in shown]), "some of the photos")
    return [Page(key="photos", markdown=f"{title}\n\n{picture}")]


def score_pages(inputs: Mapping[str, Any], result: Score) -> list[Page]:
    return [Page(key="score", markdown=f"```\n{score_table(result)}\n```")]


@stage(pages=scan_pages)
def simulate_scans(simulation: SimulationInput) -> tuple[Scan, ...]:
    """Laser scans of the scene, each in its scanner's frame, with the station's position as measured."""
    from tasks.simulation import scanner
    from tasks.simulation.scenes import build

    shelf = store.current()
    scans = []
    with shelf.scratch() as folder:
        for sweep in scanner.scan(build(simulation), progress, simulation.scanner):
            path = folder / f"{sweep.name}.ply"
            scanner.write_ply(sweep.points, path)
            scans.append(Scan(name=sweep.name, file=shelf.put(path), station_position_m=sweep.measured_m))
    return tuple(scans)


@stage(pages=photo_pages)
def photograph(simulation: SimulationInput, plan: FlightPlan, surface: str) -> Folder:
    """Photos NAME.jpg of one surface's shooting points, from where the vehicle truly was."""
    from tasks.simulation.photography import Exposure
    from tasks.simulation.trajectory import fly_mission

    flown = [
        fly_mission(mission_items(flight), plan.origin, plan.home_m, plan.vehicle, simulation.seed + number)
        for number, flight in enumerate(plan.each_flight)
    ]
    wanted = {point.photo for point in plan.shooting_points if point.surface == surface}
    exposures = [
        Exposure(shot.photo, shot.true_pose, shot.velocity_m_s, shot.time_s, shot.estimated_pose)
        for flight in flown
        for shot in flight.shots
        if shot.photo is not None and shot.photo in wanted
    ]
    return _taken(simulation, exposures)


@stage(pages=photo_pages)
def photograph_wall(simulation: SimulationInput) -> WallPhotos:
    """The paper's wall, photographed by hand from places measured to 5 cm and 1°."""
    from tasks.simulation.photography import Exposure
    from tasks.simulation.scenes import build
    from tasks.simulation.wall import WALL, wall_poses

    poses = wall_poses(simulation.seed)
    photos = _taken(simulation, [Exposure(name, true) for name, true, _ in poses])
    scene = build(simulation)
    return WallPhotos(
        photos=photos,
        poses=tuple((f"{name}.jpg", measured) for name, _, measured in poses),
        camera=scene.camera,
        surface=scene.face(WALL).surface(),
    )


def _taken(simulation: SimulationInput, exposures: "list[Exposure]") -> Folder:
    from tasks.simulation.photography import take
    from tasks.simulation.scenes import build

    shelf = store.current()
    with shelf.scratch() as folder:
        take(build(simulation), exposures, folder, progress)
        return shelf.put_folder(folder)


@stage()
def simulation_truth(simulation: SimulationInput) -> File:
    """truth.json: cracks, markers, surfaces and stations as they are (schemas.simulation.Truth)."""
    from tasks.simulation.scenes import build
    from tasks.simulation.truth import truth as truth_of

    shelf = store.current()
    with shelf.scratch() as folder:
        path = folder / "truth.json"
        path.write_text(truth_of(build(simulation)).model_dump_json(indent=1))
        return shelf.put(path)


@stage(pages=score_pages)
def score(report: CrackReport, truth: File) -> Score:
    """The report against the truth: cracks found, false cracks, errors of width and length."""
    from tasks.simulation.score import score as score_of

    return score_of(report, Truth.model_validate_json(store.current().path(truth).read_text()))


def score_table(result: Score) -> str:
    """A score as text for a terminal."""
    from tasks.simulation.score_table import score_table as table_of

    return table_of(result)


def start_vehicle(plan: FlightPlan, seed: int) -> AbstractContextManager[str]:
    """A simulated vehicle in a process of its own, for as long as the context lasts; its URL."""
    from tasks.simulation.vehicle import start_vehicle as start

    return start(plan, seed)


def _scene(name: str) -> Literal["bridge", "wall"]:
    if name == "bridge":
        return "bridge"
    if name == "wall":
        return "wall"
    raise BadInput(f"demo:{name}", "there is no such scene", "Ask for demo:bridge or demo:wall")
