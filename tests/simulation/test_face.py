import numpy as np
import pytest

from tasks.simulation.face import Face, Placement

PLACE = Placement(yaw_deg=20.0, offset_m=(3.0, -2.0, 1.0))
BOX = PLACE.box("box", (-1.0, -2.0, 0.0), (1.0, 2.0, 3.0))


def test_the_faces_of_a_box_look_outwards() -> None:
    middle = np.asarray(PLACE.point((0.0, 0.0, 1.5)))
    for face in BOX:
        outwards = face.corners_m.mean(axis=0) - middle
        assert face.normal @ outwards / np.linalg.norm(outwards) == pytest.approx(1.0)
        assert np.linalg.det(face.R_world_face) == pytest.approx(1.0)


def test_a_box_is_closed() -> None:
    """Each corner of the box belongs to three faces."""
    corners = np.round(np.vstack([f.corners_m for f in BOX]), 9)
    _, counts = np.unique(corners, axis=0, return_counts=True)
    assert list(counts) == [3] * 8


@pytest.mark.parametrize("face", BOX, ids=lambda f: f.name)
def test_its_surface_is_the_same_rectangle(face: Face) -> None:
    surface = face.surface()
    np.testing.assert_allclose(surface.to_world(surface.outline_m), face.corners_m, atol=1e-9)
    np.testing.assert_allclose(surface.plane.normal, face.normal, atol=1e-12)
    area = np.asarray(surface.outline_m)
    x, y = area.T
    assert (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2 == pytest.approx(surface.area_m2)


def test_points_come_back() -> None:
    uv = np.array([[0.2, 0.3], [1.7, 2.9]])
    for face in BOX:
        back = face.to_face(face.to_world(uv))
        np.testing.assert_allclose(back, np.column_stack([uv, np.zeros(2)]), atol=1e-12)
