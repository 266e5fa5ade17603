"""`hairline calibrate` against lenses known by construction."""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from flows.calibrate_command import calibrate as command
from flows.plain_files import read_camera
from schemas.calibration import Calibration
from schemas.camera import Camera
from schemas.problem import BadInput
from tasks.photos.boards import Corners, Read, charuco_finder
from tasks.photos.calibrate import calibrate
from tests.photos.board_photos import (
    BoardPose,
    Lens,
    charuco,
    chessboard,
    photo,
    tilted,
    usual_poses,
)

BROWN = Lens(960, 720, 830.0, 487.0, 355.0, (-0.12, 0.05, 0.001, -0.0008, -0.01))
FISHEYE = Lens(960, 720, 480.0, 484.0, 352.0, (-0.03, 0.006, -0.002, 0.0003))
PLACES = np.column_stack([a.ravel() for a in np.meshgrid(np.linspace(0, 959, 13), np.linspace(0, 719, 11))])


def field_error_px(camera: Camera, lens: Lens, places: np.ndarray = PLACES) -> float:
    """The largest angle between the ray of a pixel and its true ray, over the whole frame, in pixels of the
    focal length; a turn of the whole camera is no error of its calibration."""
    ideal = camera.undistort((places - camera.principal_px) / camera.focal_px)
    mine, true = np.column_stack([ideal, np.ones(len(places))]), lens.rays(places)
    mine, true = (rays / np.linalg.norm(rays, axis=1, keepdims=True) for rays in (mine, true))
    U, _, Vt = np.linalg.svd(mine.T @ true)
    return float(np.linalg.norm(np.cross(mine @ U @ Vt, true), axis=1).max() * lens.focal_px)


def write(folder: Path, lens: Lens, board: np.ndarray, poses: Sequence[BoardPose]) -> None:
    for k, pose in enumerate(poses):
        Image.fromarray(photo(lens, board, pose, seed=k)).save(
            folder / f"{k:02d}.jpg", quality=93, subsampling=2
        )


def test_a_chessboard_gives_the_camera_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, BROWN, chessboard(), usual_poses(BROWN, 9, seed=1))
    Image.fromarray(np.full((720, 960, 3), 128, np.uint8)).save(tmp_path / "wall.png")
    (tmp_path / "broken.jpg").write_bytes(b"\xff\xd8\xff")
    command(tmp_path, out=tmp_path / "out" / "camera.yaml")
    camera = read_camera(tmp_path / "out" / "camera.yaml")
    assert (camera.width_px, camera.height_px, camera.lens) == (960, 720, "brown")
    assert field_error_px(camera, BROWN) <= 0.2
    made = Calibration.model_validate_json((tmp_path / "out" / "camera.json").read_bytes())
    assert made.camera == camera.model_copy(update={n: getattr(made.camera, n) for n in made.sigma})
    truth = [BROWN.focal_px, BROWN.cx_px, BROWN.cy_px, *BROWN.coefficients]
    deviations = [(getattr(camera, n) - t) / s for (n, s), t in zip(made.sigma.items(), truth, strict=True)]
    assert 0.1 < np.sqrt(np.mean(np.square(deviations))) < 2.0  # uncertainties are neither boasts nor excuses
    assert made.rms_px < 0.08
    assert {left.item for left in made.left_out} == {"wall.png", "broken.jpg"}
    assert len(made.views) == 9
    said = capsys.readouterr()
    assert "wall.png" in said.err
    assert "broken.jpg" in said.err
    assert "focal_px" in said.out
    with Image.open(tmp_path / "out" / "camera.png") as picture:
        assert picture.size == (1400, 700)


def test_a_fisheye(tmp_path: Path) -> None:
    write(tmp_path, FISHEYE, chessboard(), usual_poses(FISHEYE, 9, seed=2, fill=0.45))
    command(tmp_path, out=tmp_path / "fish.yaml", fisheye=True)
    camera = read_camera(tmp_path / "fish.yaml")
    assert camera.lens == "fisheye"
    made = Calibration.model_validate_json((tmp_path / "fish.json").read_bytes())
    every = np.array([xy for view in made.views for xy in view.corners_px])
    assert np.hypot(*(every - (484, 352)).T).max() > 480 * np.radians(45)
    assert field_error_px(camera, FISHEYE, every) <= 0.2
    assert (
        field_error_px(camera, FISHEYE) <= 3 * made.extrapolated_sigma_px
    )  # 70° off the axis: and it says so


def test_a_charuco_board_may_leave_the_frame(tmp_path: Path) -> None:
    board = cv2.aruco.CharucoBoard(
        (12, 9), 1.0, 0.7, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    )
    write(tmp_path, BROWN, charuco(board), usual_poses(BROWN, 8, seed=3, fill=0.9))
    find = charuco_finder((12, 9), "5x5_100", 0.7)
    made = calibrate([(path.name, path) for path in sorted(tmp_path.iterdir())], find, "brown")
    assert min(len(view.corners_px) for view in made.views) < 88  # of 11 × 8
    assert field_error_px(made.camera, BROWN) <= 0.2


def prepared(
    folder: Path, poses: Sequence[BoardPose], noise_px: float = 0.05
) -> tuple[list[tuple[str, Path]], Callable[[Sequence[Read]], list[Corners | None]]]:
    """Blank photos, and a search that finds in them the corners that boards at these poses have."""
    x, y = np.meshgrid(np.arange(9) - 4.0, np.arange(6) - 2.5)
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(54)])
    corners: list[Corners | None] = []
    rng = np.random.default_rng(0)
    for k, pose in enumerate(poses):
        Image.fromarray(np.zeros((720, 960), np.uint8)).save(folder / f"{k}.png")
        px, _ = cv2.projectPoints(
            flat, cv2.Rodrigues(pose.R)[0], pose.t, BROWN.K, np.array(BROWN.coefficients)
        )
        corners.append(Corners(flat[:, :2], px[:, 0] + rng.normal(0, noise_px, (54, 2))))
    return [(f"{k}.png", folder / f"{k}.png") for k in range(len(poses))], lambda photos: corners


@pytest.mark.parametrize(
    ("poses", "what"),
    [
        (usual_poses(BROWN, 3, seed=0), "3 of 3 show the board"),
        ([tilted(30, 10, 0, (0.02 * k, 0, 14)) for k in range(12)], "11 of them as another does"),
        (usual_poses(BROWN, 12, seed=0, tilt_deg=6.0), "tilted by at most"),
        (usual_poses(BROWN, 12, seed=0, fill=0.08), "of the frame"),
    ],
    ids=["few", "alike", "square", "small"],
)
def test_photos_that_do_not_tell_are_refused(tmp_path: Path, poses: list[BoardPose], what: str) -> None:
    photos, find = prepared(tmp_path, poses)
    with pytest.raises(BadInput, match=what) as caught:
        calibrate(photos, find, "brown")
    assert "tilted by 30 to 45°" in caught.value.remedy


def test_uncertain_is_said_to_be(tmp_path: Path) -> None:
    photos, find = prepared(tmp_path, usual_poses(BROWN, 6, seed=0), noise_px=3.0)
    with pytest.raises(BadInput, match="uncertain by"):
        calibrate(photos, find, "brown")


def test_a_photo_of_a_bent_board_is_left_out(tmp_path: Path) -> None:
    photos, find = prepared(tmp_path, usual_poses(BROWN, 10, seed=0))
    bent = find([])[4]
    assert bent is not None
    bent.px[:, 1] += 1.5 * np.sin(bent.board[:, 0])
    made = calibrate(photos, find, "brown")
    assert [left.item for left in made.left_out] == ["4.png"]
    assert "off" in made.left_out[0].what
    assert field_error_px(made.camera, BROWN) <= 0.5


def test_another_size_is_left_out_and_turned_photos_are_turned_back(tmp_path: Path) -> None:
    photos, find = prepared(tmp_path, usual_poses(BROWN, 9, seed=0))
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.fromarray(np.zeros((720, 960), np.uint8)).save(
        tmp_path / "0.png", exif=exif
    )  # a portrait: same sensor
    Image.fromarray(np.zeros((600, 800), np.uint8)).save(tmp_path / "8.png")
    corners = find([])
    made = calibrate(photos, lambda reads: [corners[k] for k in range(len(reads))], "brown")
    assert [left.item for left in made.left_out] == ["8.png"]
    assert "800 × 600" in made.left_out[0].what


def test_an_unknown_dictionary_is_refused() -> None:
    with pytest.raises(BadInput, match="there is no 7Z7"):
        charuco_finder((12, 9), "7Z7", 0.75)
