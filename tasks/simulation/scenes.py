"""The scenes by name, and the inspection that is ready for each."""

from collections.abc import Callable
from functools import lru_cache
from threading import Lock
from typing import Literal

from schemas.inspection import CameraInput, Inspection, SimulationInput
from schemas.settings import DetectSettings, PlanSettings
from schemas.vehicle import Vehicle
from tasks.simulation import arch, bridge, facade, wall
from tasks.simulation.scene import Scene

BRIDGE_SURFACES = ("wall-south-06", "soffit-02", "wall-east-01")
SCENES: dict[str, Callable[[int], Scene]] = {
    "bridge": bridge.bridge,
    "wall": wall.wall,
    "arch": arch.arch,
    "facade": facade.facade,
}
VEHICLE = Vehicle(radius_m=0.4, clearance_m=1.0, position_bias_m=0.1, position_jitter_m=0.03)  # RTK

_building = Lock()  # photos of several surfaces are taken at a time, of one scene


def build(simulation: SimulationInput) -> Scene:
    """The scene of a simulation. Kept, since its textures take seconds to make."""
    with _building:
        return _built(simulation)


@lru_cache(maxsize=1)
def _built(simulation: SimulationInput) -> Scene:
    return SCENES[simulation.scene](simulation.seed)


def ready_inspection(scene: Literal["bridge", "wall"]) -> Inspection:
    """The inspection that the demo runs. The bridge's surfaces are named as the extraction names them: an
    outer girder web, a soffit bay, a pier's face."""
    simulation = SimulationInput(scene=scene)
    if scene == "wall":
        camera = CameraInput.model_validate(wall.CAMERA.model_dump())
        # Our network takes the twisted wires that tie the panels for cracks: they are as dark and as jagged.
        detect = DetectSettings(method="ridge")
        return Inspection(name="demo-wall", simulation=simulation, camera=camera, detect=detect)
    return Inspection(
        name="demo",
        simulation=simulation,
        flight="simulated",
        camera=CameraInput.model_validate(bridge.CAMERA.model_dump()),
        vehicle=VEHICLE,
        origin=bridge.ORIGIN,
        plan=PlanSettings(gsd_mm_px=bridge.GSD_MM_PX, overlap=0.5, surfaces=BRIDGE_SURFACES),
    )
