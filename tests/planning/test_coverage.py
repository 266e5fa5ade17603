"""Coverage by ray casting against areas known by construction."""

import numpy as np
import pytest

from schemas.camera import Camera, CameraPose
from schemas.settings import PlanSettings
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import BIAS_S, drawn, position_errors, reasons, seen_by
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
    assert reasons(seen, {}, np.ones(len(seen.uv_m), dtype=bool)) == ()


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
    all_of_it = np.ones(len(seen.uv_m), dtype=bool)
    assert (
        reasons(seen, {"hidden behind something": hidden}, all_of_it)[0]
        == f"{hidden:.2f} m² hidden behind something"
    )


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
    angle = np.radians(yaw)
    pose = CameraPose(position_m=(-4 * np.sin(angle), -4 * np.cos(angle), 5.0), yaw_deg=yaw, pitch_deg=0.0)
    seen = seen_by(WALL, CAMERA, [pose], 1.0, 79.0, ALONE)
    middle = np.argmin(np.linalg.norm(seen.uv_m, axis=1))
    u, v = seen.uv_m[middle]
    # By projecting: a pixel's steps along and up the wall.
    step = 1e-4
    places = WALL.to_world([(u, v), (u + step, v), (u, v + step)])
    pixels = CAMERA.project(places, pose)
    largest = step * 1000 / np.linalg.norm(pixels[1:] - pixels[0], axis=1).min()
    assert seen.best_mm_px[middle] == pytest.approx(largest, rel=2e-3)
    assert seen.best_mm_px[middle] == pytest.approx(1.0 / np.cos(angle), rel=0.02)


def test_the_position_error_walks_and_jitters_as_stated() -> None:
    vehicle = VEHICLE.model_copy(update={"position_bias_m": 0.5, "position_jitter_m": 0.2})
    rng = np.random.default_rng(0)
    times = np.array([0.0, 1.0, BIAS_S, BIAS_S + 1e6])
    errors = np.array([position_errors(times, vehicle, rng) for _ in range(4000)])
    assert errors.std(axis=0) == pytest.approx(np.full((4, 3), np.hypot(0.5, 0.2)), rel=0.06)
    together = [(errors[:, 0] * errors[:, k]).mean() / 0.5**2 for k in (1, 2, 3)]
    assert together == pytest.approx([np.exp(-1 / BIAS_S), np.exp(-1), 0.0], abs=0.06)


def test_a_grid_of_photos_is_lost_where_the_error_takes_it() -> None:
    """One photo that shows just half of a strip: seen once in as many draws as the error leaves it there."""
    strip = rectangle("wall-01", (0.0, 0.0, 5.0), (0, -1, 0), 0.1, 0.1)
    half_m = 1.632 / 2 * (3.5 / 4.0)
    vehicle = VEHICLE.model_copy(update={"position_bias_m": 0.1, "position_jitter_m": 0.0})
    poses = [from_the_south(half_m - 0.05, 5.0, 3.5)] * 2  # the strip is 5 cm inside its left edge
    errs = drawn(
        strip, CAMERA, poses, np.array([0.0, 0.0]), vehicle, 1.0, 45.0, Scene([strip], np.empty((0, 3))),
        np.ones(len(seen_by(strip, CAMERA, poses, 1.0, 45.0, ALONE).uv_m), dtype=bool), draws=2000,
    )  # fmt: skip
    lost = (errs.twice < 0.5).mean()
    assert lost == pytest.approx(0.3085, abs=0.04)  # P(bias east > σ / 2)
    assert np.array_equal(errs.once, errs.twice)  # a bias that is shared takes both


def test_a_width_can_be_measured_where_its_pixels_are_small_enough_in_95_of_100_flights() -> None:
    vehicle = VEHICLE.model_copy(update={"position_bias_m": 0.2, "position_jitter_m": 0.0})
    seen = seen_by(WALL, CAMERA, [from_the_south(0.0, 5.0)], 1.0, 45.0, ALONE)
    errs = drawn(
        WALL, CAMERA, [from_the_south(0.0, 5.0)], np.zeros(1), vehicle, 1.0, 45.0, ALONE,
        seen.photos > 0, draws=2000,
    )  # fmt: skip
    middle = np.argmin(np.linalg.norm(seen.uv_m, axis=1))
    assert errs.mm_px[middle] == pytest.approx((4.0 + 1.645 * 0.2) / 4.0, abs=0.01)
    assert np.isinf(errs.mm_px[np.abs(seen.uv_m[:, 0]) > 2.0]).all()


def test_strong_distortion_does_not_fold_far_points_into_the_photo() -> None:
    fisheye = CAMERA.model_copy(update={"focal_px": 1200.0, "k1": -0.12})
    wide = rectangle("wall-01", (0.0, 0.0, 5.0), (0, -1, 0), 60.0, 40.0)
    seen = seen_by(wide, fisheye, [from_the_south(0.0, 5.0)], 9.0, 79.0, Scene([wide], np.empty((0, 3))))
    reach = fisheye.undistort(np.array([[816 / 1200, 612 / 1200]]))[0] * 4.0
    assert np.abs(seen.uv_m[seen.photos > 0]).max(axis=0) == pytest.approx(reach, abs=0.5)


def test_a_fisheye_shows_what_its_rays_meet_at_the_size_of_its_own_pixels() -> None:
    fisheye = Camera(width_px=1632, height_px=1224, focal_px=800.0, lens="fisheye", k1=-0.02, k2=0.003)
    wide = rectangle("wall-01", (0.0, 0.0, 5.0), (0, -1, 0), 16.0, 12.0)
    pose = from_the_south(0.0, 5.0)
    seen = seen_by(wide, fisheye, [pose], 100.0, 79.0, Scene([wide], np.empty((0, 3))))
    points = wide.to_world(np.column_stack([seen.uv_m, np.zeros(len(seen.uv_m))]))
    px = fisheye.project(points, pose)
    inside = ((px >= -0.5) & (px <= np.array([1631.5, 1223.5]))).all(axis=1)
    assert 0.3 < inside.mean() < 1.0
    np.testing.assert_array_equal(seen.photos > 0, inside)
    step = 1e-3  # m, along both axes of the wall: the inverse of the pixels' change is a pixel's size
    along = [
        (fisheye.project(points + step * np.asarray(axis), pose) - px) / step for axis in (wide.u, wide.v)
    ]
    sizes = 1000 / np.linalg.svd(np.stack(along, axis=2), compute_uv=False)[:, -1]
    np.testing.assert_allclose(seen.best_mm_px[inside], sizes[inside], rtol=2e-3)
