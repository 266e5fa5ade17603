import numpy as np
import pytest

from tasks.simulation.bridge import INSPECTED, SOFFIT, WEB, bridge
from tasks.simulation.scene import Scene


@pytest.fixture(params=[1, 2, 3, 4, 5])
def scene(request: pytest.FixtureRequest) -> Scene:
    return bridge(request.param)


def test_cracks_lie_within_their_faces(scene: Scene) -> None:
    for name in INSPECTED:
        face = scene.face(name)
        for crack in scene.cracks[name]:
            assert crack.uv_m.min() > 0.02, crack.id
            assert (crack.uv_m < np.array([face.width_m, face.height_m]) - 0.02).all(), crack.id


def test_cracks_that_are_no_branches_keep_apart(scene: Scene) -> None:
    for cracks in scene.cracks.values():
        for one in cracks:
            for other in cracks:
                if one.id[:2] != other.id[:2]:
                    apart = np.linalg.norm(one.uv_m[::5, None] - other.uv_m[None, ::5], axis=2)
                    assert apart.min() > 0.05, (one.id, other.id)


def test_there_are_wide_and_thin_cracks_on_every_surface(scene: Scene) -> None:
    for cracks in scene.cracks.values():
        medians = [float(np.median((c.left_m + c.right_m)[c.left_m > 5e-4])) * 1e3 for c in cracks]
        assert max(medians) > 3.2  # px of 1 mm
        assert min(medians) < 2.6


def test_the_sizes_are_those_of_the_demo() -> None:
    scene = bridge(1)
    web, soffit = scene.face(WEB), scene.face(SOFFIT)
    assert (web.width_m, web.height_m) == pytest.approx((12.2, 0.95))
    assert soffit.corners_m[:, 2].min() >= 6.5
    assert web.normal[1] < -0.99 and soffit.normal[2] == pytest.approx(-1.0)


def test_nothing_stands_between_the_camera_and_the_surfaces() -> None:
    from tasks.simulation.raycast import cast

    scene = bridge(1)
    for name in INSPECTED:
        face = scene.face(name)
        middle = face.to_world([(face.width_m / 2, face.height_m / 2)])[0]
        index, distance = cast(middle + 4.0 * face.normal, [-face.normal], scene.arrays)
        assert scene.faces[index[0]].name == name
        assert distance[0] == pytest.approx(4.0)
