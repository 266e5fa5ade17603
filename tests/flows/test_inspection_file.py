"""A mistake in the inspection file is told by its key or line, with what to do."""

from pathlib import Path

import pytest

from flows.inspection_file import existing, read_camera_file, read_inspection
from schemas.camera import Camera
from schemas.problem import BadInput


def problem_of(tmp_path: Path, text: str) -> str:
    path = tmp_path / "inspection.yaml"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        read_inspection(path)
    assert caught.value.item == str(path)
    return str(caught.value)


def test_a_minimal_file_gets_every_default(tmp_path: Path) -> None:
    path = tmp_path / "inspection.yaml"
    path.write_text("name: bridge-7\nphotos:\n  - folder: photos\n")
    inspection = read_inspection(path)
    assert inspection.photos[0].stitch
    assert inspection.detect.method == "hairline"
    assert inspection.registration.tau_m == 0.10


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: a\nphoto: []\n", "unknown key 'photo'"),
        ("photos: []\n", "key 'name' is missing"),
        ("name: a\ndetect: {method: magic}\n", "key 'detect.method' cannot be 'magic'"),
        ("name: a\nplan: {overlap: 1.5}\n", "key 'plan.overlap' cannot be 1.5"),
        ("name: ../../etc\n", "key 'name' cannot be '../../etc'"),
        ("name: a\n  b: [\n", "is not valid YAML at line 2"),
        ("", "holds no settings"),
        ("- a\n", "holds no settings"),
        ("name: a\ncamera: {width_px: 100, height_px: 100}\n", "focal_mm together with sensor_width_mm"),
        (
            "name: a\nphotos: [{folder: p}, {folder: ./q/../p, surface: p}]\n",
            "gives the photos './q/../p' twice",
        ),
        ("name: a\nstitch: {ransac_px: .nan}\n", "key 'stitch.ransac_px'"),
        ("name: a\nassess: {fine_mm: 5, medium_mm: 0.5, wide_mm: 0.1}\n", "must not descend"),
        ("name: a\nplan:\n  a1: 1\n  a1: 2\n", "gives the key 'a1' twice, the second time at line 4"),
        ("name: 2024-05-01\n", "key 'name' cannot be 2024-05-01 (give text in quotes)"),
        ("name: 2024-13-01\n", "is not valid YAML (month must be in 1..12)"),
        ("name: a\ndetect: [ridge]\n", "key 'detect' cannot be ['ridge'] (give keys with values)"),
        ("name: a\nflight_log: 3\n", "key 'flight_log' cannot be 3 (give text in quotes or give a list)"),
        ("name: a\nplan: {1: 2}\n", "key 'plan.1' cannot be 1 (give text in quotes)"),
        ("name: a\nphotos: [{folder: inspection.yaml}]\n", "as a folder of photos"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, text: str, words: str) -> None:
    assert words in problem_of(tmp_path, text)


def test_a_file_that_is_absent_binary_or_a_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x80")
    for name, words in (
        ("none.yaml", "no such file"),
        ("binary.yaml", "Save it as UTF-8"),
        ("", "is a folder"),
    ):
        with pytest.raises(BadInput, match=words):
            read_inspection(tmp_path / name)


def test_a_path_that_does_not_exist_names_its_key(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=f"named by key 'scans', does not exist in {tmp_path.parent}"):
        existing(tmp_path / "..", "scan.ply", "scans")


def test_every_mistake_is_told_with_the_keys_that_may_be_meant(tmp_path: Path) -> None:
    text = problem_of(tmp_path, "name: a\nphoto: []\ndetect: {methode: magic, size: 3}\nplan: {overlap: 2}\n")
    assert "unknown key 'photo' (is it 'photos'?)" in text
    assert "unknown key 'detect.methode' (is it 'method'?)" in text
    assert "key 'plan.overlap' cannot be 2" in text
    assert "The keys of detect are method, model, min_score" in text
    assert "`hairline init`" in text
    text = problem_of(tmp_path, "name: a\nphotos: [{folder: p, surfaces: x}]\n")
    assert "unknown key 'photos.0.surfaces' (is it 'surface'?)" in text


def test_a_file_without_a_camera_is_named(tmp_path: Path) -> None:
    (tmp_path / "foo.txt").write_text("hi")
    with pytest.raises(BadInput, match=r"foo\.txt: holds no camera"):
        read_camera_file(tmp_path / "foo.txt")


def test_the_camera_may_be_a_file_beside(tmp_path: Path) -> None:
    (tmp_path / "camera.yaml").write_text(
        "width_px: 400\nheight_px: 300\nlens: fisheye\nfocal_px: 250\nk4: 0.001\n"
    )
    (tmp_path / "inspection.yaml").write_text("name: a\ncamera: camera.yaml\n")
    given = read_inspection(tmp_path / "inspection.yaml").camera
    assert given is not None
    assert given.camera() == Camera(width_px=400, height_px=300, lens="fisheye", focal_px=250, k4=0.001)
    assert read_camera_file(tmp_path / "inspection.yaml") == given
    (tmp_path / "camera.yaml").write_text("width_px: 400\nheight_px: 300\nfocal_px: 250\nk4: 0.001\n")
    with pytest.raises(BadInput, match=r"camera\.yaml: .*k4 belongs to lens fisheye"):
        read_inspection(tmp_path / "inspection.yaml")
    (tmp_path / "camera.yaml").write_text("width_px: 400\nfocal_px: 250\n")
    with pytest.raises(BadInput, match="key 'height_px' is missing"):
        read_inspection(tmp_path / "inspection.yaml")


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-16-le"])
def test_a_file_in_another_encoding_is_told_how_to_save_it(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "inspection.yaml").write_text("name: Brücke\n", encoding=encoding)
    with pytest.raises(BadInput, match="Save it as UTF-8"):
        read_inspection(tmp_path / "inspection.yaml")


def test_a_key_that_overrides_a_merged_one_is_no_second(tmp_path: Path) -> None:
    (tmp_path / "inspection.yaml").write_text(
        "name: a\nphotos:\n  - &first {folder: p, stitch: false}\n  - {<<: *first, folder: q}\n"
    )
    given = read_inspection(tmp_path / "inspection.yaml").photos
    assert [(photos.folder, photos.stitch) for photos in given] == [("p", False), ("q", False)]
