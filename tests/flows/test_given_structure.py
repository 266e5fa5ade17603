"""Surfaces that somebody has edited by hand, before a flight is planned for them."""

from pathlib import Path

import pytest

from flows.given_structure import read_structure
from schemas.file import File
from schemas.plane import Plane
from schemas.problem import BadInput
from schemas.structure import Structure
from schemas.surface import Surface

SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
WALL = Surface(
    name="wall",
    plane=Plane(normal=(0.0, -1.0, 0.0), d_m=0.0),
    origin_m=(0.0, 0.0, 0.0),
    u=(1.0, 0.0, 0.0),
    v=(0.0, 0.0, 1.0),
    outline_m=SQUARE,
    hull_m=SQUARE,
    area_m2=12.0,
)


def written(folder: Path, *surfaces: Surface) -> Path:
    file = File(sha256="0" * 64, size=1, suffix=".ply")
    low, high = (-5.0, -5.0, 0.0), (5.0, 5.0, 5.0)
    structure = Structure(surfaces=surfaces, obstacles=(), occupied=file, min_m=low, max_m=high)
    path = folder / "surfaces.json"
    path.write_text(structure.model_dump_json())
    return path


def test_what_surfaces_wrote_is_read(tmp_path: Path) -> None:
    assert read_structure(written(tmp_path, WALL)).surfaces == (WALL,)


@pytest.mark.parametrize(
    ("edited", "what"),
    [
        ({"u": (10.0, 0.0, 0.0)}, "perpendicular unit vectors"),
        ({"u": (0.0, 0.0, 0.0)}, "perpendicular unit vectors"),
        ({"u": WALL.v, "v": WALL.u}, "right-handed"),
        ({"outline_m": SQUARE[:2]}, "fewer than three corners"),
        ({"outline_m": (SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3])}, "crosses itself"),
        ({"holes_m": (SQUARE,)}, "leave nothing"),
        ({"holes_m": (SQUARE[:2],)}, "holes_m has fewer"),
    ],
)
def test_a_surface_that_cannot_be_is_told(tmp_path: Path, edited: dict[str, object], what: str) -> None:
    path = written(tmp_path, WALL.model_copy(update=edited))
    with pytest.raises(BadInput, match=what):
        read_structure(path)


def test_two_surfaces_of_one_name_are_told(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="calls 2 surfaces 'wall'"):
        read_structure(written(tmp_path, WALL, WALL))
