import numpy as np
import pytest

from tasks.simulation.light import light_map
from tasks.simulation.wall import CAMERA, PANEL_M, SIZE_M, WALL, wall, wall_poses


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_two_cracks_and_eighteen_patterns_as_in_the_paper(seed: int) -> None:
    scene = wall(seed)
    cracks = scene.cracks[WALL]
    assert [c.id for c in cracks] == ["middle", "bottom-right"]
    panels = [np.floor(c.uv_m / PANEL_M).astype(int) for c in cracks]
    assert (panels[0] == (1, 1)).all() and (panels[1] == (2, 0)).all()
    assert len(scene.markers) == 18
    centres = np.array([m.centre_uv_m for m in scene.markers]) + np.asarray(SIZE_M) / 2
    assert len(np.unique(np.floor(centres / PANEL_M), axis=0)) == 9
    for crack in cracks:
        apart = np.linalg.norm(crack.uv_m[:, None] - centres[None], axis=2)
        assert apart.min() > 0.1  # markers hide no crack


def test_a_part_is_in_hard_sun_and_a_part_in_shade() -> None:
    scene = wall(1)
    light = light_map(scene.face(WALL), scene.arrays, scene.daylight, 0.05).irradiance
    shade, sun = np.percentile(light, [10, 90])
    assert 0.25 < shade / sun < 0.45
    shaded = light < (shade + sun) / 2
    assert 0.15 < shaded.mean() < 0.5
    middle = (slice(13, 22), slice(19, 35))  # around the crack in the middle
    assert not shaded[middle].any()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_photos_cover_the_wall_and_are_measured_to_5_cm_and_1_degree(seed: int) -> None:
    poses = wall_poses(seed)
    assert len(poses) == 25 and len({name for name, _, _ in poses}) == 25
    face = wall(seed).face(WALL)
    u, v = np.meshgrid(np.arange(0.025, SIZE_M[0], 0.05), np.arange(0.025, SIZE_M[1], 0.05))
    points = face.to_world(np.column_stack([u.ravel(), v.ravel()]))
    seen = np.zeros(len(points), bool)
    for _, true, _ in poses:
        x, y = CAMERA.project(points, true).T
        seen |= (x > 0) & (x < CAMERA.width_px) & (y > 0) & (y < CAMERA.height_px)
    assert seen.mean() > 0.97
    shift = np.array([np.subtract(m.position_m, t.position_m) for _, t, m in poses])
    assert shift.std() == pytest.approx(0.05, rel=0.3)
    turn = np.array([(m.yaw_deg - t.yaw_deg, m.pitch_deg - t.pitch_deg) for _, t, m in poses])
    assert turn.std() == pytest.approx(1.0, rel=0.4)
