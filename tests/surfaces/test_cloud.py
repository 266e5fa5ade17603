from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from schemas.problem import BadInput
from tasks.surfaces.cloud import read_cloud, write_points
from tasks.surfaces.scanners import scanners

HEADER = b"ply\nformat binary_little_endian 1.0\n"
STATIONS_M = np.array([[0.0, 0.0, 10.0], [0.0, 0.0, -10.0]])


def write_ply(path: Path, columns: dict[str, npt.ArrayLike], kinds: dict[str, str] | None = None) -> Path:
    kinds = kinds or {}
    types = {"float": "<f4", "uchar": "u1", "double": "<f8"}
    count = len(np.asarray(columns["x"]))
    table = np.empty(count, [(name, types[kinds.get(name, "float")]) for name in columns])
    for name, values in columns.items():
        table[name] = values
    header = f"ply\nformat binary_little_endian 1.0\ncomment metres\nelement vertex {count}\n"
    header += "".join(f"property {kinds.get(name, 'float')} {name}\n" for name in columns) + "end_header\n"
    path.write_bytes(header.encode() + table.tobytes())
    return path


def flat(count: int) -> dict[str, npt.ArrayLike]:
    rng = np.random.default_rng(0)
    return {"x": rng.random(count), "y": rng.random(count), "z": np.zeros(count)}


def test_views_point_to_the_scanner_of_each_point(tmp_path: Path) -> None:
    columns = flat(100) | {"nx": 0.0, "ny": 0.0, "nz": np.repeat([1.0, -1.0], 50)}
    columns |= {"station": np.repeat([0, 1], 50)}
    path = write_ply(tmp_path / "a.ply", columns, {"station": "uchar"})
    cloud = read_cloud(path, "a", STATIONS_M)
    assert len(cloud) == 100
    np.testing.assert_array_equal(np.sign(cloud.views[:, 2]), np.sign(cloud.normals[:, 2]))
    np.testing.assert_allclose(np.linalg.norm(cloud.views, axis=1), 1.0)


def test_normals_tell_the_side_where_no_scanner_stood(tmp_path: Path) -> None:
    path = write_ply(tmp_path / "a.ply", flat(100) | {"nx": 0.0, "ny": 0.0, "nz": -1.0})
    cloud = read_cloud(path, "a", STATIONS_M[:1])
    np.testing.assert_allclose(cloud.views, [[0.0, 0.0, -1.0]] * 100)
    assert not cloud.sides_known


def test_a_known_scanner_counts_beside_one_that_is_not_known(tmp_path: Path) -> None:
    columns = flat(100) | {"nx": 0.0, "ny": 0.0, "nz": np.repeat([1.0, -1.0], 50)}
    columns |= {"station": np.repeat([0, 1], 50)}
    path = write_ply(tmp_path / "a.ply", columns, {"station": "uchar"})
    scanners_m = np.array([STATIONS_M[0], [np.nan] * 3])
    cloud = read_cloud(path, "a", scanners_m)
    assert not cloud.sides_known
    np.testing.assert_array_equal(np.sign(cloud.views[:, 2]), np.sign(cloud.normals[:, 2]))
    np.testing.assert_array_equal(scanners(cloud, scanners_m)[0], STATIONS_M[:1])


def test_normals_are_estimated_where_the_file_has_none(tmp_path: Path) -> None:
    cloud = read_cloud(write_ply(tmp_path / "a.ply", flat(500)), "a", STATIONS_M[:1])
    np.testing.assert_allclose(cloud.normals, [[0.0, 0.0, 1.0]] * 500, atol=1e-6)


def test_the_order_in_the_file_does_not_matter(tmp_path: Path) -> None:
    columns = flat(200)
    order = np.random.default_rng(1).permutation(200)
    one = read_cloud(write_ply(tmp_path / "1.ply", columns), "1", STATIONS_M)
    shuffled = {name: np.asarray(values)[order] for name, values in columns.items()}
    two = read_cloud(write_ply(tmp_path / "2.ply", shuffled), "2", STATIONS_M)
    np.testing.assert_array_equal(one.points, two.points)


def test_points_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    columns = {"x": [0.0, np.nan, 1.0], "y": [0.0, 0.0, np.inf], "z": [0.0, 0.0, 0.0]}
    assert len(read_cloud(write_ply(tmp_path / "a.ply", columns), "a", STATIONS_M)) == 1


def test_written_points_can_be_read_again(tmp_path: Path) -> None:
    points = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    write_points(tmp_path / "occupied.ply", points)
    np.testing.assert_array_equal(read_cloud(tmp_path / "occupied.ply", "o", STATIONS_M).points, points)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "no PLY"),
        (b"not a point cloud\n" * 50, "no PLY"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "not binary"),
        (HEADER + b"element vertex 0\nproperty float x\nend_header\n", "no x, y, z"),
        (
            HEADER + b"element vertex 3\nproperty float x\nproperty float y\n"
            b"property float z\nend_header\n" + bytes(20),
            "cut short: 1 of 3",
        ),
        (
            HEADER + b"element vertex 0\nproperty float x\nproperty float y\n"
            b"property float z\nend_header\n",
            "no point",
        ),
        (
            HEADER + b"element vertex x\nproperty float x\nend_header\n",
            "damaged",
        ),
    ],
)  # fmt: skip
def test_a_file_that_is_no_such_cloud_is_named(tmp_path: Path, content: bytes, what: str) -> None:
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(BadInput, match=f"my model: .*{what}"):
        read_cloud(tmp_path / "a.ply", "my model", STATIONS_M)


def test_a_cloud_of_a_wrong_unit_is_refused(tmp_path: Path) -> None:
    columns = {"x": [0.0, 40_000.0], "y": [0.0, 0.0], "z": [0.0, 0.0]}
    with pytest.raises(BadInput, match=r"extends over 40 km.*unit"):
        read_cloud(write_ply(tmp_path / "a.ply", columns), "my model", STATIONS_M)
