import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tasks.simulation.marks import CELL_M, REACH_M, discs, in_cells, line, painted_box

coordinate = st.floats(0.02, 0.48)


@settings(max_examples=60)
@given(a=st.tuples(coordinate, coordinate), b=st.tuples(coordinate, coordinate), t=st.floats(0, 1))
def test_the_cell_of_every_point_near_a_line_knows_it(
    a: tuple[float, float], b: tuple[float, float], t: float
) -> None:
    marks = in_cells([line(a, b, 0.004, 0.0)], 0.5, 0.5)
    on = np.asarray(a) + t * (np.asarray(b) - a)
    for shift in ((0, 0), (REACH_M * 0.7, 0), (0, -REACH_M * 0.7)):
        column, row = np.floor((on + shift) / CELL_M).astype(int)
        cell = row * marks.columns + column
        assert 0 in marks.items[marks.start[cell] : marks.start[cell + 1]]


def test_shapes_of_a_cell_keep_the_order_they_were_laid_in() -> None:
    layers = [
        painted_box((0.25, 0.25), 10.0, (0.1, 0.1), (1, 0, 0)),
        line((0.2, 0.25), (0.3, 0.25), 0.01, 0.2),
    ]
    marks = in_cells([*layers, discs(np.array([[0.25, 0.25]]), np.array([0.01]), np.ones(1))], 0.5, 0.5)
    cell = int(0.25 / CELL_M) * marks.columns + int(0.25 / CELL_M)
    assert list(marks.items[marks.start[cell] : marks.start[cell + 1]]) == [0, 1, 2]


def test_most_of_a_face_has_no_marks() -> None:
    marks = in_cells([line((0.1, 0.1), (0.4, 0.3), 0.002, 0.0)], 0.5, 0.5)
    assert (np.diff(marks.start) > 0).mean() < 0.06
