"""Views of the plane, the bundle's derivatives, the skyline solver and the map of a photo on the canvas."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.camera import Camera
from schemas.problem import BadInput
from tasks.stitching.bundle import State, build_bundle, linearise, residuals
from tasks.stitching.canvas import Canvas, lay_out
from tasks.stitching.prior import Prior
from tasks.stitching.rays import points
from tasks.stitching.relief import HeightMap
from tasks.stitching.seams import photo_map
from tasks.stitching.skyline import solve_positive
from tasks.stitching.tracks import Observations
from tasks.stitching.view import FACING, Array, View, rotation, rotation_vector, shrunk

CAMERA = Camera(width_px=800, height_px=600, focal_px=1000.0, k1=-0.08, k2=0.02, p1=1e-3, p2=-5e-4, k3=0.01)
FISHEYE = Camera(
    width_px=800, height_px=600, focal_px=600.0, lens="fisheye", k1=-0.02, k2=0.004, k3=0.001, k4=-0.0005
)
WAVES = np.mgrid[0:61, 0:81] / 3.0
RELIEF = HeightMap(0.01 * np.sin(WAVES[0]) * np.cos(WAVES[1]), -3.0, -5.0, 0.1)  # 2 cm, waves of 2 m
angles = st.floats(-0.5, 0.5)


def view(a: float = 0.1, b: float = -0.2, c: float = 0.3, camera: Camera = CAMERA) -> View:
    return View(camera, FACING @ rotation(np.array([a, b, c])), np.array([1.0, -2.0, 4.0]))


@given(a=angles, b=angles, c=st.floats(-3.0, 3.0), x=st.floats(0, 799), y=st.floats(0, 599))
def test_plane_and_photo_are_inverse(a: float, b: float, c: float, x: float, y: float) -> None:
    one = view(a, b, c)
    np.testing.assert_allclose(one.to_undistorted(one.to_plane([[x, y]])), [[x, y]], atol=1e-6)
    raised = replace(one, relief=RELIEF)
    np.testing.assert_allclose(raised.to_undistorted(raised.to_plane([[x, y]])), [[x, y]], atol=1e-3)


@given(a=angles, b=angles, c=angles)
def test_rotation_vector_undoes_rotation(a: float, b: float, c: float) -> None:
    np.testing.assert_allclose(rotation_vector(rotation(np.array([a, b, c]))), [a, b, c], atol=1e-9)


@given(scale=st.floats(0.2, 5.0), angle=st.floats(-3, 3), u=st.floats(-9, 9), v=st.floats(-9, 9))
def test_a_similarity_of_the_plane_moves_the_view_with_it(
    scale: float, angle: float, u: float, v: float
) -> None:
    one = view()
    px = np.array([[0.0, 0.0], [799.0, 10.0], [400.0, 599.0]])
    moved = one.moved(scale, angle, np.array([u, v])).to_plane(px) @ [1, 1j]
    wanted = scale * np.exp(1j * angle) * (one.to_plane(px) @ [1, 1j]) + complex(u, v)
    np.testing.assert_allclose(moved, wanted, rtol=1e-9, atol=1e-9)


def test_a_shrunk_photo_shows_the_same() -> None:
    one = view()
    half = shrunk(one, 2)
    uv = one.to_plane([[100.0, 200.0]])
    np.testing.assert_allclose(2 * (half.to_photo(uv) + 0.5) - 0.5, one.to_photo(uv), atol=1e-9)


def test_the_map_of_a_photo_is_exact_to_a_hundredth_of_a_pixel() -> None:
    tilted = view(0.5, -0.4, 0.3)
    canvas = lay_out("wall", [tilted], None, 0.004)
    x0, y0, x1, y1 = canvas.bounds_px(tilted)
    found = photo_map(tilted, canvas, x0, y0, x1 - x0, y1 - y0)
    y, x = np.mgrid[y0:y1:7, x0:x1:5]
    exact = tilted.to_photo(canvas.to_plane(np.column_stack([x.ravel(), y.ravel()])))
    inside = ((exact > 0) & (exact < [799, 599])).all(axis=1)
    off = found[::7, ::5].reshape(-1, 2)[inside] - exact[inside]
    assert inside.sum() > 1000
    assert np.abs(off).max() < 0.01


@settings(max_examples=40)
@given(n=st.integers(1, 30), shared=st.integers(0, 3), seed=st.integers(0, 10_000))
def test_skyline_solves_what_lapack_solves(n: int, shared: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.3)
    A = A @ A.T + np.eye(n)
    b = rng.normal(size=n)
    x = solve_positive(A.copy(), b, min(shared, n - 1))
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("A", [np.diag([1.0, -1.0]), np.array([[1.0, 2.0], [2.0, 1.0]])])
def test_skyline_refuses_what_is_not_positive(A: Array) -> None:
    with pytest.raises(np.linalg.LinAlgError):
        solve_positive(A, np.ones(2))


def test_skyline_lets_what_nothing_tells_but_for_rounding_move_far() -> None:
    A = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 - 1e-16, 0.0], [0.0, 0.0, 2.0]])
    x = solve_positive(A, np.array([1.0, 1.001, 4.0]))
    assert np.isfinite(x).all()
    assert abs(x[1]) > 1e6
    assert x[2] == pytest.approx(2.0)


@pytest.mark.parametrize("relief", [None, RELIEF], ids=["flat", "relief"])
@pytest.mark.parametrize("camera", [CAMERA, FISHEYE], ids=["brown", "fisheye"])
def test_derivatives_of_the_bundle(camera: Camera, relief: HeightMap | None) -> None:
    rng = np.random.default_rng(0)
    views = [view(0.1, 0.05, 0.0, camera), view(-0.1, 0.1, 0.2, camera)]
    views = [replace(v, relief=relief) for v in views]
    photo = np.repeat([0, 1], 20)
    track = np.tile(np.arange(20), 2)
    order = np.argsort(track, kind="stable")
    xy = rng.uniform(50, 550, (40, 2))
    priors = [Prior(v, np.full(3, 0.1), np.full(3, 0.05)) for v in views]
    seen = Observations(photo[order], track[order], xy)
    bundle = build_bundle(
        views, (camera,), seen, priors, np.full(3, 0.1), [0.01, 0.01], np.full(2, 5.0), np.zeros((2, 2))
    )
    state = State(
        R=np.stack([v.R for v in views]),
        C=np.stack([v.C for v in views]),
        roll=np.array([[2.0, -1.0], [0.5, 3.0]]),
        lens=np.array([[0.01, -0.05, 395.0, 302.0]]),
        bias=np.zeros(3),
        X=np.zeros((0, 2)),
        w=np.zeros(0),
    )
    X, _ = points(state, bundle, 0.5)
    state = replace(state, X=X, w=rng.normal(0.0, 0.02, len(X)))
    start, jacobians = linearise(state, bundle)
    np.testing.assert_allclose(start, residuals(state, bundle), atol=1e-9)
    step = 1e-6
    for k in range(3):
        turn = np.zeros(3)
        turn[k] = step
        turned = replace(state, R=state.R @ rotation(turn))
        moved = replace(state, C=state.C + turn)
        for changed, analytic in ((turned, jacobians.pose[:, :, k]), (moved, jacobians.pose[:, :, 3 + k])):
            np.testing.assert_allclose((residuals(changed, bundle) - start) / step, analytic, atol=2e-2)
    for k in range(2):
        rolling = replace(state, roll=state.roll + step * np.eye(2)[k])
        numeric = (residuals(rolling, bundle) - start) / step
        np.testing.assert_allclose(numeric, jacobians.pose[:, :, 6 + k], atol=1e-4)
    for k in range(4):
        bent = replace(state, lens=state.lens + step * np.eye(4)[k])
        numeric = (residuals(bent, bundle) - start) / step
        np.testing.assert_allclose(numeric, jacobians.lens[:, :, k], atol=2e-2)
    for k in range(2):
        shifted = replace(state, X=state.X + step * np.eye(2)[k])
        numeric = (residuals(shifted, bundle) - start) / step
        np.testing.assert_allclose(numeric, jacobians.point[:, :, k], atol=2e-2)
    raised = replace(state, w=state.w + step)
    numeric = (residuals(raised, bundle) - start) / step
    np.testing.assert_allclose(numeric, jacobians.point[:, :, 2], atol=2e-2)


def test_a_rolling_shutter_moves_rows_in_proportion() -> None:
    rolling = replace(view(0.1, 0.05, 0.2), roll_px=np.array([3.0, -2.0]))
    still = replace(rolling, roll_px=np.zeros(2))
    uv = rolling.to_plane([[10.0, 20.0], [400.0, 300.0], [700.0, 580.0]])
    moved, ideal = rolling.to_photo(uv), still.to_photo(uv)
    share = (moved[:, 1] + 0.5) / 600 - 0.5
    np.testing.assert_allclose(moved - ideal, share[:, None] * [3.0, -2.0], atol=1e-9)


def test_the_homography_undoes_the_rolling_shutter() -> None:
    plain = Camera(width_px=800, height_px=600, focal_px=1000.0)
    rolling = replace(view(0.1, 0.05, 0.2), camera=plain, roll_px=np.array([3.0, -2.0]))
    px = np.array([[10.0, 20.0], [400.0, 300.0], [700.0, 580.0]])
    np.testing.assert_allclose(rolling.to_photo(rolling.to_plane(px)), px, atol=1e-9)


def test_a_canvas_that_explodes_is_refused() -> None:
    one = view(0.0, 0.0, 0.0)
    far = one.moved(1.0, 0.0, np.array([5000.0, 5000.0]))
    with pytest.raises(BadInput, match="do not add up to a mosaic"):
        lay_out("wall", [one, far], None, None)
    assert isinstance(lay_out("wall", [one], None, None), Canvas)
