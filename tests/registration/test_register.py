"""Registration of the small site and of real pairs, against their true poses."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from schemas.problem import BadInput
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from schemas.target import SeenTarget, SiteTarget
from tasks.registration.read_scan import read_scan
from tasks.registration.register import Registration
from tasks.registration.register import register as register_to
from tasks.registration.rigid_motion import Array, angle_deg, inverse, transform, yaw
from tasks.simulation.bridge import bridge
from tasks.simulation.scanner import scan
from tests.development_data import development_data
from tests.registration.site import POSITIONS_M, as_scan, errors_mm_deg, measured_position, pose_of, write_ply

SETTINGS = RegistrationSettings()
Given = tuple[Scan, Path]


def register(given: list[Given], settings: RegistrationSettings, *targets: SiteTarget) -> Registration:
    with TemporaryDirectory() as folder:
        return register_to(given, settings, Path(folder) / "model.ply", targets)


def measured(folder: Path, k: int) -> Given:
    return as_scan(folder / f"station{k}.ply", station_position_m=measured_position(k))


def unknown(folder: Path, name: str) -> Given:
    return as_scan(folder / f"{name}.ply")


def poses(found: Registration) -> list[Array]:
    return [np.array(s.T_world_scan) for s in found.stations]


def true_poses(found: Registration) -> list[Array]:
    return [pose_of(int(s.name[-1])) for s in found.stations]


def test_stations_with_measured_positions(site_folder: Path) -> None:
    found = register([measured(site_folder, k) for k in range(4)], SETTINGS)
    assert [s.name for s in found.stations] == ["station0", "station1", "station2", "station3"]
    assert not found.left_out
    worst_mm, worst_deg = errors_mm_deg(poses(found), true_poses(found))
    assert worst_mm < 2.0
    assert worst_deg < 0.01
    # four positions of 5 cm fix the world frame to centimetres, and its z stays up
    off = [np.linalg.norm(f[:3, 3] - t[:3, 3]) for f, t in zip(poses(found), true_poses(found), strict=True)]
    assert max(off) < 0.12
    assert all(T[2, 2] > np.cos(np.radians(0.02)) for T in poses(found))
    assert all(p.overlap >= 0.05 and 0.0003 < p.rmse_m < 0.005 for p in found.pairs)
    for station in found.stations:  # what it says of its own accuracy is of the size of its error
        C = np.array(station.covariance)
        assert np.allclose(C, C.T)
        assert np.linalg.eigvalsh(C).min() > -1e-12
        assert station.sigma_mm is not None
        assert 0.05 < station.sigma_mm < 3.0
        assert station.scanner_m is not None
        assert np.allclose(station.scanner_m, np.array(station.T_world_scan)[:3, 3])


def test_stations_of_which_nothing_is_known(site_folder: Path) -> None:
    """A yard among them is refused by name, a mirrored scan too, one of three points, and one given twice."""
    folder = site_folder
    three = folder / "three.xyz"
    three.write_text("1 0 0\n0 5 0\n0 0 5\n")
    names = ["station0", "station1", "yard", "station2", "station3", "mirror"]
    given = [*(unknown(folder, name) for name in names), as_scan(three)]
    twin = given[0][0].model_copy(update={"name": "twin"})
    found = register([*given, (twin, given[0][1])], SETTINGS)
    assert [s.name for s in found.stations] == ["station0", "station1", "station2", "station3"]
    assert sorted(item.item for item in found.left_out) == ["mirror", "three", "twin", "yard"]
    worst_mm, worst_deg = errors_mm_deg(poses(found), true_poses(found))
    assert worst_mm < 2.0
    assert worst_deg < 0.01
    assert np.abs(poses(found)[0] - np.eye(4)).max() < 1e-9  # the first scan's frame is the world


def test_one_wrong_statement_does_not_sink_the_rest(site_folder: Path) -> None:
    """Poses as stated, the first station's wrong by 10 m and 180°."""
    stated = [pose_of(k) for k in range(4)]
    stated[0] = yaw(np.pi, (10.0, 0.0, 0.0)) @ stated[0]
    given = [
        as_scan(site_folder / f"station{k}.ply", T_world_scan=tuple(map(tuple, T)))
        for k, T in enumerate(stated)
    ]
    found = register(given, SETTINGS)
    assert len(found.stations) == 4
    for f, t in zip(poses(found), true_poses(found), strict=True):
        assert np.linalg.norm(f[:3, 3] - t[:3, 3]) < 0.003
        assert angle_deg(inverse(t) @ f) < 0.02


def test_only_scans_that_share_nothing(site_folder: Path) -> None:
    with pytest.raises(BadInput, match=r"station0, yard: no two of these scans overlap"):
        register([unknown(site_folder, "station0"), unknown(site_folder, "yard")], SETTINGS)


def test_one_scan_alone(site_folder: Path, tmp_path: Path) -> None:
    given = unknown(site_folder, "station1")
    found = register_to([given], SETTINGS, tmp_path / "model.ply")
    assert np.array_equal(poses(found)[0], np.eye(4))
    assert found.stations[0].covariance is None
    model = read_scan(found.model.path)
    assert model.normals is not None
    assert (np.einsum("ij,ij->i", model.normals, -model.points_m) > 0).mean() > 0.999


def test_large_coordinates_keep_their_millimetres(site_folder: Path) -> None:
    east, north = 500_000.0, 5_000_000.0
    given = []
    for k in (0, 3):
        x, y, z = POSITIONS_M[k]
        given.append(as_scan(site_folder / f"station{k}.ply", station_position_m=(x + east, y + north, z)))
    found = register(given, SETTINGS)
    assert tuple(found.origin_m) == (east, north, 0.0)
    assert np.abs([found.model.low_m, found.model.high_m]).max() < 100
    for f, t in zip(poses(found), true_poses(found), strict=True):
        assert np.linalg.norm(f[:3, 3] - t[:3, 3]) < 0.005


def test_a_station_that_does_not_connect_ends_the_run_where_all_are_required(site_folder: Path) -> None:
    strict = RegistrationSettings(require_all=True)
    with pytest.raises(BadInput, match="yard: no overlap ties them"):
        register([*(measured(site_folder, k) for k in (0, 3)), unknown(site_folder, "yard")], strict)


def test_targets_tie_the_model_to_the_site_and_judge_it(site_folder: Path) -> None:
    """Positions to 5 cm are given too, and have no say; the datum is a national grid."""
    to_grid = yaw(0.4, (512_345.0, 5_432_100.0, 87.0))
    places = {"C0": (-9, -8, 2), "C1": (9, -7, 1), "C2": (8, 9, 4), "C3": (-8, 8, 1), "K": (0, 2, 3)}
    surveyed = tuple(
        SiteTarget(name=n, position_m=triple(transform(to_grid, np.array([p]))[0]), check=n == "K")
        for n, p in places.items()
    )
    given = []
    for k in (0, 3):
        scan_of, path = measured(site_folder, k)
        in_scan = transform(inverse(pose_of(k)), np.array(list(places.values())))
        seen = tuple(SeenTarget(name=n, position=triple(p)) for n, p in zip(places, in_scan, strict=True))
        given.append((scan_of.model_copy(update={"targets": seen}), path))
    found = register(given, SETTINGS, *surveyed)
    assert not found.left_out
    assert {(t.name, t.used) for t in found.targets} == {(n, n != "K") for n in places}
    assert all(np.linalg.norm(t.residual_m) < 0.003 for t in found.targets)
    for f, t in zip(poses(found), true_poses(found), strict=True):
        f[:3, 3] += found.origin_m
        assert np.linalg.norm((f - to_grid @ t)[:3, 3]) < 0.003


def triple(p: Array) -> tuple[float, float, float]:
    x, y, z = p
    return float(x), float(y), float(z)


def test_no_scan_that_can_be_read(tmp_path: Path) -> None:
    empty = tmp_path / "empty.ply"
    empty.write_text("hello")
    with pytest.raises(BadInput, match="empty"):
        register([as_scan(empty)], SETTINGS)


def test_the_simulated_bridge(tmp_path: Path) -> None:
    """Six stations about and under the girder bridge, a quarter of their points, 3 mm range noise."""
    sweeps = list(scan(bridge(seed=1), lambda _: None))
    given = [
        as_scan(write_ply(tmp_path / f"{s.name}.ply", s.points[::4]), station_position_m=s.measured_m)
        for s in sweeps
    ]
    found = register(given, SETTINGS)
    assert len(found.stations) == 6
    worst_mm, worst_deg = errors_mm_deg(poses(found), [s.T_world_scan for s in sweeps])
    assert worst_mm < 2.0
    assert worst_deg < 0.01
    off = [f[:3, 3] - s.T_world_scan[:3, 3] for f, s in zip(poses(found), sweeps, strict=True)]
    assert np.linalg.norm(off, axis=1).max() < 0.1  # six positions of 5 cm


def of_pair(folder: Path, target: str, source: str) -> Array:
    found = register([as_scan(folder / target), as_scan(folder / source)], SETTINGS)
    target_pose, source_pose = poses(found)
    return inverse(target_pose) @ source_pose


def test_real_street_pair_without_any_pose() -> None:
    """The reference pose is another engine's; engines differ by 0.3° and 2 cm on this pair."""
    folder = development_data("scans/street_pair")
    apart = inverse(np.loadtxt(folder / "T_target_source.txt")) @ of_pair(folder, "target.ply", "source.ply")
    assert angle_deg(apart) < 0.4
    assert np.linalg.norm(apart[:3, 3]) < 0.025


T_ROOM1_ROOM2 = np.array(  # by small_gicp's GICP at 0.25 m, started from the right basin
    [
        [0.756390, -0.653931, 0.015757, 1.970261],
        [0.653768, 0.756554, 0.014647, 0.061207],
        [-0.021500, -0.000777, 0.999769, 0.034580],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def test_real_rooms_without_any_pose() -> None:
    folder = development_data("scans/rooms")
    apart = inverse(T_ROOM1_ROOM2) @ of_pair(folder, "room_scan1.pcd", "room_scan2.pcd")
    assert angle_deg(apart) < 0.35
    assert np.linalg.norm(apart[:3, 3]) < 0.02


def test_real_rooms_with_a_tenth_of_their_points(tmp_path: Path) -> None:
    """Sparser than τ."""
    folder = development_data("scans/rooms")
    rng = np.random.default_rng(3)
    for k in (1, 2):
        points_m = read_scan(folder / f"room_scan{k}.pcd").points_m
        write_ply(tmp_path / f"{k}.ply", points_m[rng.random(len(points_m)) < 0.1])
    apart = inverse(T_ROOM1_ROOM2) @ of_pair(tmp_path, "1.ply", "2.ply")
    assert angle_deg(apart) < 1.0
    assert np.linalg.norm(apart[:3, 3]) < 0.05


def test_real_car_pair_without_any_pose() -> None:
    """Truth of the data set; the best peer reaches 0.035° and 18.7 mm from the right basin."""
    folder = development_data("scans/car_pair")
    row = (folder / "carCloudList.csv").read_text().splitlines()[2].split(",")[1:]
    truth = np.array(row, dtype=float).reshape(4, 4)
    apart = inverse(truth) @ of_pair(folder, "car_cloud400.csv", "car_cloud401.csv")
    assert angle_deg(apart) < 0.08
    assert np.linalg.norm(apart[:3, 3]) < 0.03
