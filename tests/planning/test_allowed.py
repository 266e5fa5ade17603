"""Unknown space, fences and no-fly boxes: against scenes whose hidden parts are known by construction."""

import numpy as np
import pytest

from schemas.box import Box
from schemas.problem import BadInput
from schemas.scan_window import ScanWindow
from schemas.settings import PlanSettings
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import Allowed, Block, allowed_region
from tasks.planning.home import take_off_place
from tests.planning.structures import World, box, rectangle

MARGIN_M = 0.6
LOW, HIGH = np.array([-15.0, -15.0, -1.0]), np.array([15.0, 15.0, 12.0])
STATION = (0.0, -10.0, 1.6)


def screened() -> World:
    """A wall 6 m wide and 5 m high, 6 m in front of the scanner, on flat ground."""
    return (
        World()
        .add(rectangle("ground-01", (0.0, 0.0, 0.0), (0, 0, 1), 30.0, 30.0))
        .add(rectangle("wall-01", (0.0, -4.0, 2.5), (0, -1, 0), 6.0, 5.0))
        .add_points(box((-3.0, -4.0, 0.0), (3.0, -3.8, 5.0)))
    )


def region(stations: tuple[tuple[float, float, float], ...] = (STATION,), **asked: object) -> Allowed:
    world = screened()
    structure = world.structure.model_copy(update={"stations_m": stations})
    return allowed_region(structure, world.cloud, PlanSettings(**asked), MARGIN_M, LOW, HIGH)  # type: ignore[arg-type]


def blocks(allowed: Allowed, places: list[tuple[float, float, float]]) -> list[Block]:
    airspace = Airspace(screened().cloud, 1.0, 0.0, 100.0, allowed)
    return [Block(b) for b in airspace.blocks(np.array(places))]


def test_what_the_scanner_saw_is_free_and_what_it_did_not_see_is_not() -> None:
    places = [(0.0, -8.0, 4.0), (8.0, 0.0, 4.0), (0.0, 5.0, 3.0)]  # before the wall, beside it, behind it
    assert blocks(region(), places) == [Block.FREE, Block.FREE, Block.UNKNOWN]


def test_a_second_scanner_behind_the_wall_sees_what_the_first_did_not() -> None:
    assert blocks(region((STATION, (0.0, 10.0, 1.6))), [(0.0, 5.0, 3.0)]) == [Block.FREE]


def test_no_place_in_the_shadow_is_ever_allowed() -> None:
    """The shadow by its own definition: the line from the scanner crosses the wall's rectangle."""
    allowed = region()
    places = np.random.default_rng(0).uniform(LOW, HIGH, (20_000, 3))
    behind = places[places[:, 1] > -3.8]
    eye = np.array(STATION)
    share = (-4.0 - eye[1]) / (behind[:, 1] - eye[1])
    crossing = eye + share[:, None] * (behind - eye)
    shaded = (np.abs(crossing[:, 0]) < 3.0) & (crossing[:, 2] > 0.0) & (crossing[:, 2] < 5.0)
    assert shaded.sum() > 500
    assert (allowed.slack_m(behind[shaded]) < 0).all()
    lit = behind[(np.abs(crossing[:, 0]) > 4.5) & (behind[:, 2] > 2.0) & (behind[:, 2] < 10.0)]
    lit = lit[(np.abs(lit[:, :2]) < 13.0).all(axis=1)]
    assert (allowed.slack_m(lit) >= 0).mean() > 0.9


def test_without_an_echo_air_is_known_to_the_scanners_reach_and_no_farther() -> None:
    near = blocks(region(scanner_reach_m=8.0), [(0.0, -10.0, 8.0)])
    assert near == [Block.FREE]
    assert blocks(region(scanner_reach_m=5.0), [(0.0, -10.0, 8.0)]) == [Block.UNKNOWN]


def test_where_a_scanner_did_not_look_no_air_is_known() -> None:
    """It sees the wall from west-northwest to east-northeast, from 20° below level to 40° above it."""
    window = ScanWindow(blind_deg=((160.0, 20.0),), lowest_deg=-20.0, highest_deg=40.0)
    structure = screened().structure.model_copy(update={"stations_m": (STATION,), "windows": (window,)})
    allowed = allowed_region(structure, screened().cloud, PlanSettings(), MARGIN_M, LOW, HIGH)
    before, behind, beside = (0.0, -6.5, 2.0), (0.0, -13.0, 4.0), (-12.0, -10.0, 4.0)
    above, below = (0.0, -8.0, 6.0), (0.0, -8.0, -0.4)
    assert blocks(allowed, [before, behind, beside, above]) == [Block.FREE, *[Block.UNKNOWN] * 3]
    assert allowed.slack_m(np.array([below])) < 0
    assert blocks(region(), [behind, beside, above]) == [Block.FREE] * 3


def test_the_crew_can_vouch_for_air_that_nobody_scanned() -> None:
    vouched = Box(low_m=(-4.0, 2.0, 0.0), high_m=(4.0, 9.0, 8.0))
    assert blocks(region(free_m=(vouched,)), [(0.0, 5.0, 3.0), (0.0, -1.0, 3.0)]) == [
        Block.FREE,
        Block.UNKNOWN,
    ]


def test_without_scanners_and_without_a_word_nothing_is_known() -> None:
    with pytest.raises(BadInput, match=r"no scanner's position is known") as problem:
        region(stations=())
    assert "plan.free_m" in problem.value.remedy
    anywhere = Box(low_m=(-50.0, -50.0, -5.0), high_m=(50.0, 50.0, 50.0))
    assert blocks(region(stations=(), free_m=(anywhere,)), [(0.0, 5.0, 3.0)]) == [Block.FREE]


def test_fence_and_no_fly_boxes_are_kept_with_the_margin() -> None:
    fence = ((-10.0, -10.0), (10.0, -10.0), (10.0, 0.0), (-10.0, 0.0))
    closed = Box(low_m=(5.0, -8.0, 2.0), high_m=(7.0, -6.0, 4.0))
    allowed = region(fence_m=fence, no_fly_m=(closed,))
    places = [(0.0, -8.0, 4.0), (-9.0, 3.0, 4.0), (6.0, -7.0, 3.0), (4.7, -7.0, 3.0), (-9.8, -5.0, 3.0)]
    assert blocks(allowed, places) == [Block.FREE, Block.FENCE, Block.NO_FLY, Block.NO_FLY, Block.FENCE]
    inside = np.random.default_rng(1).uniform(LOW, HIGH, (5000, 3))
    inside = inside[allowed.slack_m(inside) >= 0]
    assert len(inside) > 100
    assert (np.abs(inside[:, 0]) <= 10.0 - MARGIN_M).all()
    assert (inside[:, 1] >= -10.0 + MARGIN_M).all()
    assert (inside[:, 1] <= -MARGIN_M).all()
    outside = np.maximum(np.maximum(np.array(closed.low_m) - inside, inside - closed.high_m), 0.0)
    assert np.linalg.norm(outside, axis=1).min() >= MARGIN_M


@pytest.mark.parametrize(
    ("asked", "home_m", "why"),
    [
        ({"no_fly_m": (Box(low_m=(-3.0, -13.0, 2.2), high_m=(3.0, -7.0, 5.0)),)}, (0.0, -10.0), "no-fly box"),
        ({"no_fly_m": (Box(low_m=(0.8, -13.0, 0.0), high_m=(3.0, -7.0, 1.0)),)}, (0.0, -10.0), "no-fly box"),
        ({"fence_m": ((-9.0, -9.0), (9.0, -9.0), (9.0, 0.0), (-9.0, 0.0))}, (0.0, -10.0), "the fence"),
        ({"free_m": (Box(low_m=(-4.0, 2.0, 4.0), high_m=(4.0, 9.0, 12.0)),)}, (0.0, 5.0), "no scanner saw"),
        ({}, (0.0, 5.0), "no scanner saw"),
        ({}, (0.0, -4.0), "something is closer"),
    ],
    ids=["box overhead", "box beside", "fence", "free air over unknown air", "unknown air", "in the wall"],
)  # fmt: skip
def test_a_home_whose_climb_enters_closed_or_unknown_air_is_refused(
    asked: dict[str, object], home_m: tuple[float, float], why: str
) -> None:
    airspace = Airspace(screened().cloud, 1.0, 0.5, 100.0, region(**asked))
    with pytest.raises(BadInput, match=why):
        take_off_place((*home_m, 0.0), airspace)
    assert take_off_place((8.0, -8.0, 0.0), Airspace(screened().cloud, 1.0, 0.5, 100.0, region()))[2] < 2.5


def test_a_segment_through_unknown_air_is_refused() -> None:
    airspace = Airspace(screened().cloud, 1.0, 0.0, 100.0, region((STATION, (0.0, 12.0, 1.6))))
    start, end = np.array([[-10.0, -8.0, 4.0]]), np.array([[10.0, -8.0, 4.0]])
    assert airspace.segments_free(start, end).all()
    alone = Airspace(screened().cloud, 1.0, 0.0, 100.0, region())
    through = np.array([[-11.0, 4.0, 3.0]]), np.array([[11.0, 4.0, 3.0]])
    assert not alone.segments_free(*through).any()


def test_water_is_ground_that_no_scanner_sees() -> None:
    world = screened()
    dry = Airspace(world.cloud, 0.5, 1.0, 100.0)
    wet = Airspace(world.cloud, 0.5, 1.0, 100.0, water_m=2.0)
    place = np.array([[0.0, -10.0, 2.5]])
    assert dry.is_free(place).all()
    assert [Block(b) for b in wet.blocks(place)] == [Block.LOW]
