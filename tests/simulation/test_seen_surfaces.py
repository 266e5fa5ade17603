"""Truth for extraction, on scenes small enough to know it."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.simulation import arch
from tasks.simulation.bridge import bridge
from tasks.simulation.face import Face, Placement
from tasks.simulation.scene import Scene
from tasks.simulation.seen_surfaces import PIXEL_M, curved_parts, seen_surfaces

X, Y, Z = np.eye(3)
PLACE = Placement(yaw_deg=20.0)
STEP_DEG, GAP_M = 0.36, 0.2


def scene(*faces: Face, curved: tuple[str, ...] = ()) -> Scene:
    station = PLACE.point((0.0, -6.0, 1.6))
    return replace(bridge(1), faces=faces, stations_m=(station,), inspected=(), cracks={}, curved=curved)


def test_coplanar_faces_that_touch_are_one_surface_and_the_back_is_none() -> None:
    left, right = PLACE.face("left", (-2, 0, 0), X, Z, 2, 3), PLACE.face("right", (0, 0, 0), X, Z, 3, 3)
    back = PLACE.face("back", (3, 0.2, 0), -X, Z, 5, 3)
    (found,) = seen_surfaces(scene(left, right, back), STEP_DEG, GAP_M)
    assert found.name == "right"
    assert found.area_m2 == pytest.approx(15.0, rel=0.02)
    assert found.plane.normal == pytest.approx(tuple(left.normal))


def test_a_shadow_leaves_a_hole_and_a_gap_parts() -> None:
    wall = PLACE.face("wall", (-3, 0, 0), X, Z, 6, 3)
    screen = PLACE.face("screen", (-0.3, -3, 1.3), X, Z, 0.6, 0.6)
    found = seen_surfaces(scene(wall, screen), STEP_DEG, GAP_M)
    shaded = next(s for s in found if s.name == "wall")
    assert len(shaded.holes_m) == 1
    assert shaded.area_m2 == pytest.approx(18 - 1.2**2, rel=0.02)  # twice the screen: half way to the scanner
    apart = PLACE.face("apart", (3.3, 0, 0), X, Z, 2, 3)
    assert {s.name for s in seen_surfaces(scene(wall, apart), STEP_DEG, GAP_M)} == {"wall", "apart"}


def test_what_rays_meet_too_far_apart_or_is_too_narrow_is_not_seen() -> None:
    far = PLACE.face("far", (-3, 40, 0), X, Z, 6, 3)
    lath = PLACE.face("lath", (-3, 0, 0), X, Z, 6, 0.12)
    assert seen_surfaces(scene(far), STEP_DEG, GAP_M) == ()
    assert seen_surfaces(scene(lath), STEP_DEG, GAP_M)
    assert seen_surfaces(scene(lath), STEP_DEG, GAP_M, narrowest_m=0.2) == ()


def test_panes_count_where_asked_for() -> None:
    pane = PLACE.face("pane", (-1, 0, 0), X, Z, 2, 2, "glass")
    assert seen_surfaces(scene(pane), STEP_DEG, GAP_M) == ()
    assert len(seen_surfaces(scene(pane), STEP_DEG, GAP_M, glass=True)) == 1


def test_half_of_a_round_pier_is_seen_from_one_station() -> None:
    pier = arch.round_pier(PLACE, "pier0", 0.0, 0.0, 0.5, 3.0, 48)
    (part,) = curved_parts(scene(*pier, curved=("pier0",)), STEP_DEG, GAP_M)
    assert part.area_m2 == pytest.approx(np.pi * 0.5 * 3.0, rel=0.1)
    assert len(part.points_m) * PIXEL_M**2 == pytest.approx(part.area_m2)
    assert seen_surfaces(scene(*pier, curved=("pier0",)), STEP_DEG, GAP_M) == ()
