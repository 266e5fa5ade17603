"""The arch bridge and the building's front: solid where they should be, and scanned all over."""

from collections.abc import Callable

import numpy as np
import pytest

from schemas.inspection import SimulationInput
from tasks.simulation import arch, facade
from tasks.simulation.raycast import cast
from tasks.simulation.scanner import scan
from tasks.simulation.scene import Scene
from tasks.simulation.scenes import build


@pytest.mark.parametrize("made", [arch.arch, facade.facade])
def test_no_scanner_stands_inside_and_each_sees_the_structure(made: Callable[[int], Scene]) -> None:
    scene = made(1)
    first = next(scan(scene, lambda _: None))
    assert len(first.points) > 100_000
    for station in scene.stations_m:
        index, distance = cast(station, [[0.0, 0.0, -1.0]], scene.arrays)
        assert scene.faces[index[0]].material == "ground"
        assert 1.5 < distance[0] < 1.8


@pytest.mark.parametrize("name", ["arch", "facade"])
def test_what_a_scanner_meets_faces_it(name: str) -> None:
    """No face is seen from behind, so no wall has a gap wider than the saw teeth along the arch."""
    scene = build(SimulationInput.model_validate({"scene": name}))
    normals = np.array([f.normal for f in scene.faces])
    leaf = np.array([f.material == "leaf" for f in scene.faces])
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for station in scene.stations_m:
        index, _ = cast(station, directions, scene.arrays)
        met = (index >= 0) & ~leaf[index]
        towards = np.einsum("ni,ni->n", normals[index[met]], directions[met])
        assert (towards > 0).mean() < 5e-4


def test_the_barrel_is_an_arc_to_a_millimetre() -> None:
    scene = arch.arch(1)
    facets = [f for f in scene.faces if f.name.startswith("barrel-")]
    middles = np.array([f.to_world([(f.width_m / 2, f.height_m / 2)])[0] for f in facets])
    local = (middles - arch.PLACE.offset_m) @ arch.PLACE.R
    radius = np.hypot(local[:, 0], local[:, 2] - arch.CENTRE_M)
    np.testing.assert_allclose(radius, arch.RADIUS_M, atol=1e-3)
    assert local[:, 2].max() == pytest.approx(arch.SPRING_M + arch.RISE_M, abs=1e-3)
    inward = np.array([f.normal for f in facets]) @ arch.PLACE.R
    towards_axis = -np.column_stack([local[:, 0], local[:, 2] - arch.CENTRE_M])
    assert (np.einsum("ni,ni->n", inward[:, ::2], towards_axis) > 0).all()


def test_windows_lie_behind_the_front() -> None:
    scene = facade.facade(1)
    panes = [f for f in scene.faces if f.material == "glass"]
    assert len(panes) == len(facade.WINDOW_X_M) * len(facade.WINDOW_Z_M)
    fronts = [f for f in scene.faces if f.name.startswith(("front-", "middle-"))]
    wall_m2 = sum(f.width_m * f.height_m for f in fronts if f.normal @ panes[0].normal > 0.99)
    gone_m2 = sum(f.width_m * f.height_m for f in panes)
    whole_m2 = 2 * facade.HALF_M * (facade.TOP_M - facade.PLINTH_M)
    assert wall_m2 + gone_m2 == pytest.approx(whole_m2, rel=1e-9)
