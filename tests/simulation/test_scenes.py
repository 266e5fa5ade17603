import pytest

from schemas.inspection import Inspection, SimulationInput
from schemas.problem import BadInput
from tasks.simulation.scenes import build, ready_inspection
from tasks.simulation.task import demo_inspection, simulation_truth


@pytest.mark.parametrize("scene", ["bridge", "wall"])
def test_the_ready_inspections_are_complete(scene: str) -> None:
    inspection = demo_inspection(scene)
    assert inspection.simulation == SimulationInput(scene=scene)
    assert inspection.camera is not None
    assert inspection.camera.camera() == build(inspection.simulation).camera
    assert Inspection.model_validate_json(inspection.model_dump_json()) == inspection


def test_the_bridge_is_flown_and_three_of_its_surfaces_are_inspected() -> None:
    inspection = ready_inspection("bridge")
    assert inspection.flight == "simulated"
    assert inspection.plan.surfaces is not None and len(inspection.plan.surfaces) == 3
    assert inspection.origin == build(inspection.simulation).origin


def test_an_unknown_scene_is_refused() -> None:
    with pytest.raises(BadInput, match="demo:tunnel"):
        demo_inspection("tunnel")


@pytest.mark.usefixtures("own_store")
def test_the_truth_is_a_file_that_depends_on_scene_and_seed() -> None:
    one, again, other = (simulation_truth.bare(SimulationInput(scene="wall", seed=s)) for s in (1, 1, 2))
    assert one == again and one != other and one.suffix == ".json"
