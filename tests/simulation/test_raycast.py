import numpy as np

from tasks.simulation.bridge import bridge
from tasks.simulation.raycast import cast


def test_agrees_with_open3d_on_the_bridge() -> None:
    import open3d as o3d

    scene = bridge(1)
    rng = np.random.default_rng(0)
    triangles = np.concatenate([f.corners_m[[[0, 1, 2], [0, 2, 3]]] for f in scene.faces])
    vertices = triangles.reshape(-1, 3).astype(np.float32)
    caster = o3d.t.geometry.RaycastingScene(nthreads=1)
    caster.add_triangles(
        o3d.core.Tensor.from_numpy(vertices),
        o3d.core.Tensor.from_numpy(np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)),
    )
    directions = rng.standard_normal((4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = np.array([0.0, -5.0, 2.0]) + rng.uniform(-2, 2, (4000, 3))
    rays = np.hstack([points, directions]).astype(np.float32)
    expected = caster.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
    index, distance = cast(points, directions, scene.arrays)
    same = np.isfinite(expected) == (index >= 0)
    both = np.isfinite(expected) & (index >= 0)
    close = np.abs(distance[both] - expected[both]) < 1e-3 * expected[both]
    assert same.mean() > 0.998 and close.mean() > 0.998  # rays that graze an edge may differ
    assert both.sum() > 1500


def test_a_ray_into_the_sky_meets_nothing() -> None:
    index, _ = cast((0.0, -8.0, 2.0), [[0.0, -0.1, 1.0]], bridge(1).arrays)
    assert index[0] == -1
