import numpy as np

from tasks.registration.open_side import to_open_side

RNG = np.random.default_rng(0)


def sheet(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    spans = np.subtract(high, low)
    return RNG.uniform(low, high, (int(400 * np.prod(spans[spans > 0])), 3))


def test_places_face_the_air_they_were_seen_through() -> None:
    """Two girders over the ground, a soffit between them, nothing scanned from above."""
    parts = {
        (0, 0, 1): sheet((-10, -10, 0), (10, 10, 0)),
        (0, -1, 0): np.vstack([sheet((-4, -1.0, 5), (4, -1.0, 6)), sheet((-4, 0.6, 5), (4, 0.6, 6))]),
        (0, 1, 0): sheet((-4, -0.6, 5), (4, -0.6, 6)),
        (0, 0, -1): sheet((-4, -0.6, 6), (4, 0.6, 6)),
    }
    points = np.concatenate(list(parts.values()))
    true = np.concatenate([np.tile(n, (len(p), 1)) for n, p in parts.items()]).astype(float)
    mistaken = true * RNG.choice([-1.0, 1.0], (len(true), 1))
    found = to_open_side(points, mistaken)
    assert (np.einsum("ni,ni->n", found, true) > 0).mean() > 0.9
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", found, true)), 1.0)


def test_a_house_is_seen_from_outside_and_its_roof_from_above() -> None:
    walls = [sheet((-5, -4, 0), (5, -4, 6)), sheet((-5, 4, 0), (5, 4, 6)), sheet((-5, -4, 6), (5, 4, 6))]
    points = np.concatenate(walls)
    normals = np.repeat([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], [len(w) for w in walls], axis=0)
    roof = to_open_side(points, normals)[-len(walls[2]) :]
    assert (roof[:, 2] > 0).mean() > 0.95
