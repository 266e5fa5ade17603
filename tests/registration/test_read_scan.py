"""Every format gives the right points, every broken file one clear BadInput."""

import struct
from contextlib import suppress
from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.problem import BadInput
from tasks.registration.read_scan import READERS, cut_short, read_scan, scan_blocks, scan_count, stated_unit_m
from tasks.registration.readers import e57, las, ply, text_rows
from tasks.registration.readers import pcd as pcd_reader
from tasks.registration.readers.file_scan import Unreadable
from tasks.registration.readers.lzf import decompress
from tests.development_data import development_data
from tests.registration.mutated_files import mutated_files, outcome

POINTS = np.array([[0.0, 0.0, 1.0], [2.5, -1.25, 0.5], [-3.0, 4.0, 2.0], [1.0, 1.0, 7.5]])
NORMALS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8]])


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def rows(table: np.ndarray, separator: str = " ") -> str:
    return "".join(separator.join(repr(float(v)) for v in row) + "\n" for row in table)


def ply_header(kind: str, count: int = 4, types: str = "double", normals: bool = False) -> str:
    names = ["x", "y", "z", *(["nx", "ny", "nz"] if normals else [])]
    properties = "".join(f"property {types} {name}\n" for name in names)
    return f"ply\nformat {kind} 1.0\nelement vertex {count}\n{properties}end_header\n"


def test_ply_ascii_and_binary_with_normals(tmp_path: Path) -> None:
    both = np.hstack([POINTS, NORMALS])
    for name, content in {
        "a.ply": (ply_header("ascii", normals=True) + rows(both)).encode(),
        "l.ply": ply_header("binary_little_endian", normals=True).encode() + both.astype("<f8").tobytes(),
        "b.ply": ply_header("binary_big_endian", types="float", normals=True).encode()
        + both.astype(">f4").tobytes(),
    }.items():
        scan = read_scan(written(tmp_path, name, content))
        assert np.allclose(scan.points_m, POINTS, atol=1e-12)
        assert scan.points_m.dtype == np.float64
        assert scan.normals is not None
        assert np.allclose(scan.normals, NORMALS, atol=1e-6)


def test_ply_keeps_float64_of_large_coordinates(tmp_path: Path) -> None:
    utm = POINTS + np.array([512_345.678, 4_321_987.654, 12.0])
    content = ply_header("binary_little_endian").encode() + utm.astype("<f8").tobytes()
    scan = read_scan(written(tmp_path, "utm.ply", content))
    assert tuple(scan.origin_m) == (512_300.0, 4_322_000.0, 0.0)
    assert np.abs(scan.points_m + scan.origin_m - utm).max() < 1e-9
    assert scan.viewpoint_m is None


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("text.ply", "hello\nworld\n", "no PLY file"),
        ("short.ply", ply_header("binary_little_endian") + "abc", "cut short: 4 points"),
        ("rows.ply", ply_header("ascii") + "1 2 3\n", "cut short: 4 points"),
        ("none.ply", ply_header("ascii", count=0), "no points"),
        ("huge.ply", ply_header("binary_little_endian", count=10**15), "cut short"),
        ("header.ply", "ply\nformat ascii 1.0\n", "has no end"),
        ("words.xyz", "1 2 3\n1 two 3\n", "not numeric"),
        ("two.xyz", "1 2\n3 4\n", "fewer than the three columns"),
        ("names.csv", "a,b,c\n1,2,3\n", "columns x, y, z"),
        ("empty.xyz", "", "no points"),
        ("nan.xyz", "nan nan nan\nnan 1 2\n", "NaN"),
        ("short.xyz", "5\n1 2 3\n4 5 6\n", "cut short: 5 points are announced and 2 follow"),
        ("short.pts", "5\n1 2 3\n4 5 6\n", "cut short: 5 points"),
        ("bad.pcd", "1 2 3\n", "no PCD header"),
        ("bad.e57", "ASTM-E57 and no more", "libE57 refuses it"),
        ("bad.las", "LASF and no more", "no LAS header"),
        ("bad.laz", b"\x00\x01\x02", "no LAS header"),
        ("short.ptx", "2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n", "cut short"),
        ("photo.jpg", "1 2 3", "not known"),
        ("binary.xyz", bytes(range(128, 256)), "no text file"),
    ],
)
def test_broken_files_say_what_is_wrong(tmp_path: Path, name: str, content: str | bytes, says: str) -> None:
    with pytest.raises(BadInput, match=says) as caught:
        scan_count(written(tmp_path, name, content))
        read_scan(tmp_path / name)
    assert caught.value.item == name
    assert caught.value.remedy


def test_extent_names_every_unit_that_may_be_meant(tmp_path: Path) -> None:
    bridge = POINTS * [10, 10, 2]  # about 80 m
    millimetres = written(tmp_path, "mm.xyz", rows(bridge * 1000))
    kilometres = written(tmp_path, "km.xyz", rows(bridge / 1000))
    with pytest.raises(BadInput, match=r"by .*\(in: 1.96 km, cm: 773 m, mm: 77.3 m\)\.") as caught:
        read_scan(millimetres)
    assert "likely" not in str(caught.value)
    with pytest.raises(BadInput, match=r"km: 77.3 m\); from km, convert it to metres first"):
        read_scan(kilometres)
    with pytest.raises(BadInput, match="Check its unit and its coordinates"):
        read_scan(written(tmp_path, "far.xyz", rows(bridge * 1e6)))
    assert np.allclose(read_scan(millimetres, unit_m=0.001).points_m, bridge)


def test_a_column_that_counts_the_rows_is_no_coordinate(tmp_path: Path) -> None:
    points = np.vstack([POINTS] * 4) + np.arange(16)[:, None] / 8
    numbered = rows(np.column_stack([np.arange(1, 17), points]), ",")
    with pytest.raises(BadInput, match="counts the rows") as caught:
        read_scan(written(tmp_path, "numbered.csv", numbered))
    assert "id,x,y,z" in caught.value.remedy
    for header in ("id,x,y,z\n", "# id,x,y,z\n"):
        assert np.allclose(read_scan(written(tmp_path, "named.csv", header + numbered)).points_m, points)
    line = np.column_stack([np.arange(16), np.zeros((16, 2))])  # three columns: a row of a grid
    assert len(read_scan(written(tmp_path, "grid.xyz", rows(line))).points_m) == 16


def test_the_rows_before_a_cut_one_are_read(tmp_path: Path) -> None:
    for name, text in (("a.xyz", rows(POINTS)), ("a.csv", "x;y;z\n" + rows(POINTS, ";").replace(".", ","))):
        whole = written(tmp_path, name, text.rstrip("\n"))
        assert not cut_short(whole) and len(read_scan(whole).points_m) == 4
        cut = written(tmp_path, name, text[:-5])
        assert cut_short(cut) and np.allclose(read_scan(cut).points_m, POINTS[:3]), name
    with pytest.raises(BadInput, match="4 points are announced and 3 follow"):
        read_scan(written(tmp_path, "n.xyz", "4\n" + rows(POINTS)[:-5]))


def test_lists_of_an_ascii_ply_are_passed_over(tmp_path: Path) -> None:
    header = ply_header("ascii").replace(
        "property double y\n", "property list uchar int a\nproperty double y\n"
    )
    lines = "".join(f"{x} {k} {'7 ' * k}{y} {z}\n" for k, (x, y, z) in enumerate(POINTS))
    assert np.array_equal(read_scan(written(tmp_path, "l.ply", header + lines)).points_m, POINTS)
    with pytest.raises(BadInput, match=r"lists of its points do not fit the row '1 9 1 1'"):
        read_scan(written(tmp_path, "l.ply", header + "1 9 1 1\n"))
    with pytest.raises(BadInput, match="in ASCII files only"):
        read_scan(written(tmp_path, "l.ply", header.replace("ascii", "binary_little_endian") + lines))


def test_xyz_and_csv_dialects(tmp_path: Path) -> None:
    both = np.hstack([POINTS, NORMALS])
    named = "nx,ny,nz,intensity,x,y,z\n" + rows(np.hstack([NORMALS, np.ones((4, 1)), POINTS]), ",")
    for name, content, has_normals in (
        ("plain.xyz", rows(POINTS), False),
        ("more.txt", "# exported\n" + rows(both), False),  # six columns without names may be colours
        ("named.csv", named, True),
        ("cloud.asc", "//X Y Z Nx Ny Nz\n" + rows(both), True),
        ("quoted.csv", '"x [m]" , "y [m]" , "z [m]"\n' + rows(POINTS, " , "), False),
        ("comma.csv", "x;y;z\n" + rows(POINTS, ";").replace(".", ","), False),
        ("bare.csv", rows(POINTS, ";").replace(".", ","), False),
        ("tabs.xyz", rows(POINTS, "\t").replace(".", ","), False),
        ("tabs.txt", "X\tY\tZ\n" + rows(POINTS, "\t").replace(".", ","), False),
        ("whole.csv", "1, 2, 3\n" + rows(POINTS, ", "), False),
        ("mark.csv", "\ufeffX,Y,Z\n" + rows(POINTS, ","), False),
        ("mark.pts", "\ufeff4\n" + rows(POINTS), False),
        (
            "latin.csv",
            "x,y,z,Höhe\n".encode("latin-1") + rows(np.hstack([POINTS, POINTS]), ",").encode(),
            False,
        ),
        ("count.xyz", "4\n" + rows(POINTS), False),
        ("survey.csv", "Easting,Northing,Elevation,Intensity\n" + rows(POINTS, ","), False),
        ("both.csv", "Height,x,y,z\n" + rows(np.hstack([POINTS[:, 2:] + 9, POINTS]), ","), False),
    ):
        scan = read_scan(written(tmp_path, name, content))
        assert np.allclose(scan.points_m[-4:], POINTS), name
        assert len(scan.points_m) == 4 + (name == "whole.csv"), name
        assert (scan.normals is not None) == has_normals, name


def test_points_with_nan_are_dropped(tmp_path: Path) -> None:
    path = written(tmp_path, "some.xyz", "nan nan nan\n" + rows(POINTS) + "inf 0 0\n")
    assert np.array_equal(read_scan(path).points_m, POINTS)


def pcd(data: str, body: bytes, kind: str = "F", size: int = 4) -> bytes:
    head = f"VERSION 0.7\nFIELDS x y z _\nSIZE {size} {size} {size} 1\nTYPE {kind} {kind} {kind} U\n"
    head += f"COUNT 1 1 1 4\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 2 1 0 0 0\nPOINTS 4\nDATA {data}\n"
    return head.encode() + body


def literal_lzf(data: bytes) -> bytes:
    """Packed without any reference: runs of at most 32 literals."""
    runs = (data[k : k + 32] for k in range(0, len(data), 32))
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def test_shots_without_an_echo_are_dropped(tmp_path: Path) -> None:
    """Programs write them as (0, 0, 0), in a map's coordinates 5,500 km away from the scan."""
    utm = POINTS + np.array([467_123.0, 5_512_345.0, 312.0])
    scan = read_scan(written(tmp_path, "utm.xyz", rows(np.vstack([np.zeros((3, 3)), utm]))))
    assert np.allclose(scan.points_m + scan.origin_m, utm, atol=1e-9)
    with pytest.raises(BadInput, match=r"none.xyz: all of its points are NaN or \(0, 0, 0\)"):
        read_scan(written(tmp_path, "none.xyz", rows(np.zeros((200, 3)))))


def test_pcd_encodings(tmp_path: Path) -> None:
    table = np.zeros(4, dtype=[("xyz", "<f8", 3), ("_", "u1", 4)])
    table["xyz"] = POINTS
    by_field = POINTS.T.astype("<f8").tobytes() + bytes(16)
    packed = literal_lzf(by_field)
    compressed = struct.pack("<II", len(packed), len(by_field)) + packed
    text = rows(np.hstack([POINTS, np.zeros((4, 4))])).encode()
    for name, data, body in (
        ("a.pcd", "ascii", text),
        ("b.pcd", "binary", table.tobytes()),
        ("c.pcd", "binary_compressed", compressed),
    ):
        scan = read_scan(written(tmp_path, name, pcd(data, body, size=8)))
        assert np.array_equal(scan.points_m, POINTS)
        assert scan.viewpoint_m is not None
        assert tuple(scan.viewpoint_m) == (0, 0, 2)
    for cut in ("binary", "binary_compressed"):
        with pytest.raises(BadInput, match=r"cut short|does not hold"):
            read_scan(written(tmp_path, "cut.pcd", pcd(cut, b"123456789012", size=8)))


def test_lzf_references() -> None:
    packed = np.frombuffer(b"\x02abc\x20\x02\xe0\x01\x05", np.uint8)  # abc, 3 back ×3, 6 back ×10
    assert decompress(packed, 16).tobytes() == b"abcabcabcabcabca"


@given(st.binary(max_size=200), st.integers(0, 400))
@settings(max_examples=100)
def test_damaged_lzf_never_leaves_its_buffers(packed: bytes, size: int) -> None:
    with suppress(Unreadable):
        assert len(decompress(np.frombuffer(packed, np.uint8), size)) == size


def test_ptx_scans_with_poses(tmp_path: Path) -> None:
    """The file's 4×4 is for row vectors: its last row is the scanner's position."""

    def block(points: np.ndarray, transform: str) -> str:
        return f"2\n3\n5 6 7\n0 1 0\n-1 0 0\n0 0 1\n{transform}" + rows(
            np.hstack([points, np.full((6, 1), 0.5)])
        )

    with_blanks = np.vstack([POINTS, np.zeros((2, 3))])
    turned = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n5 6 7 1\n"
    identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    path = written(tmp_path, "two.ptx", block(with_blanks, identity) + block(with_blanks, turned))
    assert scan_count(path) == 2
    first, second = read_scan(path, 0), read_scan(path, 1)
    assert np.array_equal(first.points_m, POINTS)
    assert first.T_world_scan is None
    assert second.T_world_scan is not None
    assert np.allclose(second.T_world_scan @ [1, 0, 0, 1], [5, 7, 7, 1])
    mirrored = written(tmp_path, "m.ptx", block(with_blanks, "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n"))
    with pytest.raises(BadInput, match="mirrors"):
        read_scan(mirrored)


def test_e57_scans_with_poses(tmp_path: Path) -> None:
    path = tmp_path / "two.e57"
    e57 = pye57.E57(str(path), mode="w")
    data = {f"cartesian{axis}": POINTS[:, k].copy() for k, axis in enumerate("XYZ")}
    half = np.sqrt(0.5)
    e57.write_scan_raw(data, rotation=np.array([half, 0, 0, half]), translation=np.array([5.0, 6, 7]))
    e57.write_scan_raw(data)
    e57.close()
    assert scan_count(path) == 2
    scan = read_scan(path, 0)
    assert np.allclose(scan.points_m, POINTS)
    assert scan.T_world_scan is not None
    assert np.allclose(scan.T_world_scan @ [1, 0, 0, 1], [5, 7, 7, 1])
    with pytest.raises(BadInput, match="no scan number 3"):
        read_scan(path, 2)


def test_las_and_laz_keep_scale_and_offset(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales, header.offsets = np.full(3, 0.001), np.array([500_000.0, 4_000_000.0, 0.0])
    las = laspy.LasData(header)
    las.x, las.y, las.z = (POINTS + header.offsets).T
    for name in ("a.las", "a.laz"):
        las.write(tmp_path / name)
        scan = read_scan(tmp_path / name)
        assert np.abs(scan.points_m + scan.origin_m - POINTS - header.offsets).max() < 1e-6
    cut = (tmp_path / "a.las").read_bytes()[:-40]
    with pytest.raises(BadInput, match="cut short"):
        read_scan(written(tmp_path, "cut.las", cut))
    damaged = bytearray((tmp_path / "a.laz").read_bytes())  # a number of chunks that would take 60 GB
    (data_at,) = struct.unpack_from("<I", damaged, 96)
    (table_at,) = struct.unpack_from("<q", damaged, data_at)
    struct.pack_into("<I", damaged, table_at + 4, 3_700_000_000)
    with pytest.raises(BadInput, match="chunk table"):
        read_scan(written(tmp_path, "damaged.laz", bytes(damaged)))


@given(st.sampled_from(sorted(READERS)), st.binary(max_size=300))
@settings(max_examples=150)
def test_arbitrary_bytes_give_points_or_bad_input(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, content: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / f"any{suffix}"
    path.write_bytes(content)
    try:
        for index in range(scan_count(path)):
            assert len(read_scan(path, index).points_m) > 0
    except BadInput as problem:
        assert problem.what


FORMATS = {  # name: points of its scans, or the words of its refusal
    "e57_ColouredCubeFloat.e57": (7680,),
    "e57_ZeroPoints.e57": "no points",
    "e57_bad-crc.e57": "checksum",
    "e57_bunnyInt32.e57": (30571,),
    "e57_empty.e57": "no scan",
    "e57_translationWithoutRotation.e57": (4,),
    "pdal_1.2-with-color.ptx": (1065,),
    "pdal_autzen-utm.pcd": (1065,),
    "pdal_autzen.pts": (10,),
    "pdal_autzen_trim.las": (110_000,),
    "pdal_autzen_trim.laz": (110_000,),
    "pdal_bunny_8.pts": "more rows follow",
    "pdal_complex-transform.ptx": "6.07 mm large",
    "pdal_missingheader.pcd": "no PCD header",
    "pdal_multiple-and-transform.ptx": "scales or shears",
    "pdal_no-color.ptx": (15,),
    "pdal_simple.las": (1065,),
    "pdal_utm17_space.pcd": (10,),
}


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_real_files_of_every_format(name: str) -> None:
    path = development_data("scans/formats") / name
    expected = FORMATS[name]
    if isinstance(expected, str):
        with pytest.raises(BadInput, match=expected):
            [read_scan(path, index) for index in range(scan_count(path))]
        return
    scans = [read_scan(path, index) for index in range(scan_count(path))]
    assert tuple(len(scan.points_m) for scan in scans) == expected


def test_a_hundred_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    folder = development_data("scans/formats")
    files = sorted(path for path in folder.iterdir() if path.name in FORMATS)
    found = {path.name: outcome(path) for path in mutated_files(files, tmp_path, 100)}
    assert {name: said for name, said in found.items() if said not in ("read", "refused")} == {}
    assert {"read", "refused"} == set(found.values())


def test_large_scans_come_in_blocks_and_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every format gives the same points whatever the block; UTM's origin is that of all blocks."""
    for reader in (ply, pcd_reader, e57, las, text_rows):
        monkeypatch.setattr(reader, "BLOCK", 3)
    utm = POINTS + np.array([512_345.0, 4_321_987.0, 12.0])
    header = ply_header("binary_little_endian").encode()
    las_file = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las_file.header.scales, las_file.header.offsets = np.full(3, 0.0001), utm[0]
    las_file.x, las_file.y, las_file.z = utm.T
    las_file.write(tmp_path / "b.las")
    table = np.zeros(4, dtype=[("xyz", "<f8", 3), ("_", "u1", 4)])
    table["xyz"] = utm
    for path in (
        written(tmp_path, "b.ply", header + utm.astype("<f8").tobytes()),
        written(tmp_path, "b.xyz", rows(utm)),
        written(tmp_path, "b.pts", "4\n" + rows(utm)),
        written(tmp_path, "b.pcd", pcd("binary", table.tobytes(), size=8)),
        tmp_path / "b.las",
    ):
        blocks = list(scan_blocks(path))
        assert [len(block.points_m) for block in blocks] == [3, 1], path.name
        assert all(np.array_equal(block.origin_m, blocks[0].origin_m) for block in blocks)
        assert np.abs(read_scan(path).points_m + blocks[0].origin_m - utm).max() < 1e-4
    with pytest.raises(BadInput, match="cut short: 9 points"):
        list(scan_blocks(written(tmp_path, "short.pts", "9\n" + rows(utm))))


def test_real_las_states_its_unit() -> None:
    folder = development_data("scans/formats")
    assert stated_unit_m(folder / "pdal_autzen_trim.laz") == 0.3048
    assert stated_unit_m(folder / "pdal_simple.las") is None
    las, laz = (read_scan(folder / f"pdal_autzen_trim.{kind}") for kind in ("las", "laz"))
    assert np.array_equal(las.points_m, laz.points_m)
