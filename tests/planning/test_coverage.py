"""Coverage by ray casting against areas known by construction."""

from collections import Counter

import numpy as np
import pytest

from schemas.camera import CameraPose
from schemas.settings import PlanSettings
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import reasons, seen_by
from tasks.planning.sight import Scene
from tasks.planning.viewpoints import shooting_points
from tests.planning.structures import CAMERA, VEHICLE, box, rectangle, wall

WALL = rectangle("wall-01", (0.0, 0.0, 5.0), (0, -1, 0), 6.0, 4.0)
ALONE = Scene([WALL], np.empty((0, 3)))


def from_the_south(x: float, z: float, away: float = 4.0) -> CameraPose:
    return CameraPose(position_m=(x, -away, z), yaw_deg=0.0, pitch_deg=0.0)


def test_one_photo_covers_its_footprint() -> None:
    seen = seen_by(WALL, CAMERA, [from_the_south(0.0, 5.0)], 1.0, 45.0, ALONE)
    assert seen.covered * 24.0 == pytest.approx(1.632 * 1.224, rel=0.06)  # m², samples every 10 cm


def test_a_free_wall_is_covered_whole_from_exact_poses() -> None:
    world = wall()
    surface, scene = world.surfaces[1], Scene(world.surfaces, world.cloud)
    airspace = Airspace(world.cloud, VEHICLE.inflation_m, 0.5, 120.0)
    settings = PlanSettings(gsd_mm_px=1.0)
    found = shooting_points(surface, CAMERA, VEHICLE, 4.0, 0.5, settings, airspace, scene)
    seen = seen_by(surface, CAMERA, [v.pose for v in found.views], 1.0, 45.0, scene)
    assert seen.covered >= 0.995
    inner = np.abs(seen.uv_m).max(axis=1) < 1.0
    assert (seen.photos[inner] >= 2).mean() > 0.99
    assert reasons(seen, Counter()) == ()


def test_a_bias_of_two_sigma_leaves_no_border_unseen() -> None:
    world = wall()
    surface, scene = world.surfaces[1], Scene(world.surfaces, world.cloud)
    airspace = Airspace(world.cloud, VEHICLE.inflation_m, 0.5, 120.0)
    settings = PlanSettings(gsd_mm_px=1.0)
    found = shooting_points(surface, CAMERA, VEHICLE, 4.0, 0.5, settings, airspace, scene)
    rng = np.random.default_rng(0)
    for bias in np.array([(0.2, 0, 0.2), (-0.2, 0, 0.2), (0.2, 0, -0.2), (-0.2, 0, -0.2)]):
        flown = [np.array(v.pose.position_m) + bias + rng.normal(0, 0.03, 3) for v in found.views]
        poses = [
            v.pose.model_copy(update={"position_m": tuple(p)})
            for v, p in zip(found.views, flown, strict=True)
        ]
        assert seen_by(surface, CAMERA, poses, 1.0, 45.0, scene).covered >= 0.99


def test_what_hides_the_wall_is_taken_off_and_named() -> None:
    post = box((-0.3, -1.2, 2.0), (0.3, -1.0, 8.0))  # shades more than its own width
    scene = Scene([WALL], post)
    seen = seen_by(WALL, CAMERA, [from_the_south(0.0, 5.0)], 1.0, 45.0, scene)
    bare = seen_by(WALL, CAMERA, [from_the_south(0.0, 5.0)], 1.0, 45.0, ALONE)
    hidden = (bare.covered - seen.covered) * 24.0
    shade = 0.6 * 4.0 / 2.8 * 1.224  # of its front edges, 1.2 m off the wall and 2.8 m off the camera
    assert shade - 0.1 < hidden < (0.6 + 0.2) / 0.6 * shade + 0.1  # points stand for cubes 10 cm beyond them
    assert any("hidden" in r for r in reasons(seen, Counter()))


def test_too_far_and_too_oblique_do_not_count() -> None:
    far = seen_by(WALL, CAMERA, [from_the_south(0.0, 5.0, away=5.0)], 1.0, 45.0, ALONE)
    assert far.covered == 0.0
    assert far.coarse.any()
    steep = CameraPose(position_m=(-2.6, -1.5, 5.0), yaw_deg=60.0, pitch_deg=0.0)
    seen = seen_by(WALL, CAMERA, [steep], 1.5, 45.0, ALONE)
    assert seen.covered < 0.001
    assert seen.oblique.any()


@pytest.mark.parametrize("yaw", [0.0, 15.0, 40.0])
def test_the_ground_sample_distance_of_an_oblique_view(yaw: float) -> None:
    """At the image's middle a pixel covers distance / focal, stretched by 1 / cos(incidence)."""
    from tasks.planning.coverage import _view_of

    angle = np.radians(yaw)
    pose = CameraPose(position_m=(-4 * np.sin(angle), -4 * np.cos(angle), 5.0), yaw_deg=yaw, pitch_deg=0.0)
    cos_incidence, gsd = _view_of(WALL, CAMERA, pose, np.array([[0.0, 0.0, 5.0]]))
    assert cos_incidence[0] == pytest.approx(np.cos(angle))
    assert gsd[0] == pytest.approx(1.0 / np.cos(angle))
    # And by projecting: one pixel's step along the wall at the image's middle.
    step = 1e-4
    ahead = CAMERA.project([[0.0, 0.0, 5.0], [step, 0.0, 5.0]], pose)
    assert gsd[0] == pytest.approx(step * 1000 / np.linalg.norm(np.diff(ahead, axis=0)), rel=1e-3)


def test_strong_distortion_does_not_fold_far_points_into_the_photo() -> None:
    fisheye = CAMERA.model_copy(update={"focal_px": 1200.0, "k1": -0.12})
    wide = rectangle("wall-01", (0.0, 0.0, 5.0), (0, -1, 0), 60.0, 40.0)
    seen = seen_by(wide, fisheye, [from_the_south(0.0, 5.0)], 9.0, 79.0, Scene([wide], np.empty((0, 3))))
    reach = fisheye.undistort(np.array([[816 / 1200, 612 / 1200]]))[0] * 4.0
    assert np.abs(seen.uv_m[seen.photos > 0]).max(axis=0) == pytest.approx(reach, abs=0.5)
