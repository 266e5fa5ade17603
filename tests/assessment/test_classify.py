import pytest

from schemas.crack import Crack
from schemas.settings import AssessSettings
from tasks.assessment.classify import classified, kind, severity
from tests.measurement.mosaics import wall

SETTINGS = AssessSettings()


def crack(direction: float, width_mm: float | None = 0.4, network: int = 0) -> Crack:
    return Crack(
        id=f"wall-C{network}",
        surface="wall",
        polyline_px=((0.0, 0.0), (10.0, 0.0)),
        length_px=10.0,
        width_median_px=1.0,
        width_max_px=1.0,
        width_max_mm=width_mm,
        orientation_deg=direction,
        network=network,
    )


@pytest.mark.parametrize(
    ("width_mm", "expected"),
    [(0.05, "hairline"), (0.2, "fine"), (0.49, "fine"), (0.5, "medium"), (1.0, "wide"), (None, None)],
)
def test_severity_by_width(width_mm: float | None, expected: str | None) -> None:
    assert severity(width_mm, SETTINGS) == expected


@pytest.mark.parametrize(
    ("direction", "expected"),
    [(0, "longitudinal"), (170, "longitudinal"), (90, "transverse"), (70, "transverse"), (45, "diagonal")],
)
def test_kind_by_direction(direction: float, expected: str) -> None:
    assert kind(direction, 0.0) == expected


def test_the_axis_is_the_members_long_side() -> None:
    assert classified((crack(90),), wall(2.0, 6.0), SETTINGS)[0].kind == "longitudinal"
    assert classified((crack(90),), wall(6.0, 2.0), SETTINGS)[0].kind == "transverse"
    assert classified((crack(90),), None, SETTINGS)[0].kind == "transverse"


def test_many_joined_cracks_in_many_directions_are_a_map() -> None:
    net = tuple(crack(d, network=3) for d in (0, 50, 100, 150))
    bundle = tuple(crack(d, network=4) for d in (0, 5, 10, 15))
    kinds = [c.kind for c in classified(net + bundle, None, SETTINGS)]
    assert kinds == ["map"] * 4 + ["longitudinal"] * 4
