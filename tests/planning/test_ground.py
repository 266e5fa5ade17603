"""Ground where it was scanned, and where a deck hides it."""

import numpy as np

from tasks.planning.ground import ground_under


def plane(
    low: tuple[float, float], high: tuple[float, float], height: float, slope: float = 0.0
) -> np.ndarray:
    x, y = np.meshgrid(np.arange(low[0], high[0], 0.25), np.arange(low[1], high[1], 0.25))
    return np.column_stack([x.ravel(), y.ravel(), height + slope * x.ravel()])


def test_a_deck_is_not_ground_where_nothing_was_scanned_under_it() -> None:
    ground = plane((-30, -30), (30, 30), 0.0)
    deck = plane((-30, -5), (30, 5), 8.0)
    hidden = np.abs(ground[:, 1]) < 5
    found = ground_under(np.concatenate([ground[~hidden], deck]))
    assert np.abs(found.at(np.array([[0.0, 0.0], [10.0, 3.0], [0.0, 20.0]]))).max() < 0.01


def test_a_slope_is_followed_within_a_cell() -> None:
    found = ground_under(plane((-30, -30), (30, 30), 0.0, slope=0.2))
    places = np.array([[-10.0, 0.0], [0.0, 5.0], [10.0, -5.0]])
    assert np.abs(found.at(places) - 0.2 * places[:, 0]).max() <= 0.21  # a column is 1 m wide


def test_it_never_lies_above_the_lowest_scanned_point() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-20, 20, (500, 3))
    assert (points[:, 2] >= ground_under(points).at(points) - 1e-12).all()
