"""Each fault of the scanner and of the site by itself, on a scene small enough to know what is right."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from schemas.scanning import Scanning
from tasks.simulation.bridge import bridge
from tasks.simulation.face import Face, Placement
from tasks.simulation.plants import crown
from tasks.simulation.scan_faults import every_fault
from tasks.simulation.scan_target import MIXED, NOTHING
from tasks.simulation.scanner import Sweep, scan
from tasks.simulation.scene import Scene

X, Y, Z = np.eye(3)
PLACE = Placement()
EXACT = Scanning(
    step_deg=0.5, range_sigma_m=0, angle_sigma_deg=0, level_sigma_deg=0, station_sigma_m=0
)  # no error at all
POST = PLACE.face("post", (-0.1, 4.8, 0.0), X, Z, 0.2, 6.0)
WALL = PLACE.face("wall", (-8.0, 5.0, -1.0), X, Z, 16.0, 8.0)
FAR_WALL = PLACE.face("far", (-8.0, 9.0, -1.0), X, Z, 16.0, 8.0)
LAWN = PLACE.face("ground", (-20.0, -20.0, 0.0), X, Y, 40.0, 40.0, "ground")
HEAD = ((0.0, 0.0, 1.6), (3.0, 0.0, 1.6), (-3.0, 1.0, 1.6))  # of the scanner


@cache
def place(*faces: Face, seed: int = 1, stations: int = 1) -> Scene:
    return replace(bridge(seed), seed=seed, faces=faces, stations_m=HEAD[:stations], inspected=(), cracks={})


def sweep(scene: Scene, **faults: float | None) -> Sweep:
    return next(scan(scene, lambda _: None, EXACT.model_copy(update=faults)))


def ranges(one: Sweep) -> np.ndarray:
    return np.linalg.norm(one.points.astype(float), axis=1)


def in_world(one: Sweep) -> np.ndarray:
    return one.points.astype(float) @ one.T_world_scan[:3, :3].T + one.T_world_scan[:3, 3]


def test_without_any_error_points_lie_on_the_wall() -> None:
    np.testing.assert_allclose(in_world(sweep(place(WALL)))[:, 1], 5.0, atol=1e-5)


def test_ranges_are_too_long_by_an_offset_a_scale_and_a_wave() -> None:
    true = ranges(sweep(place(WALL)))
    off = ranges(sweep(place(WALL), range_offset_m=0.002)) - true
    scaled = ranges(sweep(place(WALL), range_scale_ppm=500)) / true - 1
    wave = ranges(sweep(place(WALL), range_wave_m=0.003)) - true
    np.testing.assert_allclose(off, 0.002, atol=2e-6)
    np.testing.assert_allclose(scaled, 5e-4, atol=1e-6)
    assert wave.max() == pytest.approx(0.003, abs=1e-4) == -wave.min()


def test_an_index_error_tilts_one_half_of_the_circle_up_and_the_other_down() -> None:
    true, off = sweep(place(WALL)), sweep(place(WALL), index_deg=0.1)
    rises = np.degrees(
        np.arcsin(off.points[:, 2] / ranges(off)) - np.arcsin(true.points[:, 2] / ranges(true))
    )
    np.testing.assert_allclose(rises, np.where(true.points[:, 0] > 0, 0.1, -0.1), atol=1e-4)


def test_collimation_and_trunnion_errors_grow_with_elevation() -> None:
    true = sweep(place(WALL))
    a, e = np.arctan2(true.points[:, 0], true.points[:, 1]), np.arcsin(true.points[:, 2] / ranges(true))
    face = np.where(a > 0, 1, -1)
    for fault, expected in (("collimation_deg", 1 / np.cos(e)), ("trunnion_deg", np.tan(e))):
        off = sweep(place(WALL), **{fault: 0.1}).points
        turned = np.degrees(np.arctan2(off[:, 0], off[:, 1]) - a)
        inside = np.abs(a) < 3.0
        np.testing.assert_allclose(turned[inside], 0.1 * (face * expected)[inside], atol=1e-3)


def test_pulses_mix_at_the_edge_of_a_post_but_not_with_what_is_far_behind() -> None:
    near = sweep(place(POST, WALL), beam_mrad=3.0)
    between = near.face == MIXED
    depth = in_world(near)[between, 1]
    assert between.sum() > 20
    assert ((depth > 4.79) & (depth < 5.01)).all()
    assert ((depth > 4.82) & (depth < 4.98)).mean() > 0.5
    assert (sweep(place(POST, WALL)).face != MIXED).all()
    far = in_world(sweep(place(POST, FAR_WALL), beam_mrad=3.0))[:, 1]
    assert ((np.abs(far - 4.8) < 0.02) | (np.abs(far - 9.0) < 0.02)).all()


def test_pulses_are_lost_with_distance_and_slant() -> None:
    whole, thinned = sweep(place(LAWN)), sweep(place(LAWN), reach_m=20.0)

    def counts(one: Sweep) -> np.ndarray:
        return np.histogram(ranges(one), bins=[0, 5, 10, 20])[0]

    kept = counts(thinned) / counts(whole)
    assert kept[0] > 0.75 > kept[1] > 0.3 > kept[2]
    wall = len(sweep(place(WALL), reach_m=20.0).points) / len(sweep(place(WALL)).points)
    assert wall > 0.85  # as far away, but bright and faced squarely


def test_a_window_pane_returns_one_pulse_in_ten() -> None:
    pane = replace(WALL, material="glass")
    assert len(sweep(place(pane)).points) == pytest.approx(0.1 * len(sweep(place(WALL)).points), rel=0.1)


def test_people_and_cars_stand_elsewhere_at_each_station() -> None:
    faults = EXACT.model_copy(update={"people": 4, "cars": 2})
    sweeps = list(scan(place(LAWN, POST, stations=3), lambda _: None, faults))
    seen = [in_world(s)[s.face == NOTHING] for s in sweeps]
    for points in seen:
        assert len(points) > 200
        assert points[:, 2].max() < 1.9
        assert np.linalg.norm(points[:, None, :2] - np.array(HEAD)[:, :2], axis=2).min() > 0.5
    cells = [{tuple(c) for c in np.floor(points * 2).astype(int)} for points in seen]
    assert len(cells[0] & cells[1]) < 0.2 * len(cells[0])


def test_leaves_sway_and_walls_do_not() -> None:
    leaves = crown(PLACE, np.random.default_rng(0), (2.0, 3.0, 2.0))
    scene = place(WALL, *leaves)
    still, windy = sweep(scene), sweep(scene, sway_m=0.1)
    assert np.abs(in_world(windy)[windy.face == 0][:, 1] - 5.0).max() < 1e-4
    for one, expected in ((still, 0.0), (windy, 0.1)):
        off = []
        for k in np.unique(one.face[one.face > 0]):
            off.append(abs(np.median(scene.faces[k].to_face(in_world(one)[one.face == k])[:, 2])))
        assert np.median(off) == pytest.approx(expected, abs=0.06)


def test_positions_are_written_down_wrong_where_stations_go_astray() -> None:
    faults = EXACT.model_copy(update={"astray": 1, "astray_m": 10.0})
    off = [
        np.linalg.norm(np.subtract(s.measured_m, s.T_world_scan[:3, 3]))
        for s in scan(place(WALL, stations=3), lambda _: None, faults)
    ]
    assert sorted(np.round(off, 6)) == [0.0, 0.0, 10.0]


def test_every_fault_is_on_at_once_and_drawn_anew_for_each_seed() -> None:
    drawn = [every_fault(seed) for seed in range(20)]
    for one in drawn:
        switches = one.model_dump(exclude=set(Scanning().model_dump(exclude_defaults=True)))
        assert all(value for value in switches.values())
        assert 0.05 <= one.astray_m <= 10.0
    assert len({one.range_offset_m for one in drawn}) == 20
    again = [
        [s.points for s in scan(place(WALL, POST, LAWN, stations=2), lambda _: None, drawn[0])]
        for _ in range(2)
    ]
    for one, two in zip(*again, strict=True):
        np.testing.assert_array_equal(one, two)
