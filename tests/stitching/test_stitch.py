"""The whole stage against truth: a wall photographed with unknown distortion, exposures and rough poses."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from artifacts import store
from artifacts.raster import TiffWindows
from schemas.camera import CameraPose
from schemas.file import File
from schemas.mosaic import Mosaic
from schemas.problem import BadInput
from schemas.settings import StitchSettings
from tasks.stitching.task import pages
from tests.stitching.conftest import CAMERA
from tests.stitching.photo_sets import PhotoSet, errors_px, photo_set
from tests.stitching.scenes import WALL, Texture, concrete, plane_points, render


def pixels(file: File) -> np.ndarray:
    windows = TiffWindows(store.current().path(file), "test")
    whole = windows.read(0, windows.height_px, 0, windows.width_px)
    windows.close()
    return whole


def status(mosaic: Mosaic) -> dict[str, str]:
    return {p.name: p.status for p in mosaic.placements}


@pytest.fixture(scope="module")
def mosaic(wall: PhotoSet) -> Mosaic:
    return wall.stitch(WALL)


def test_is_metric_up_to_a_similarity(wall: PhotoSet, mosaic: Mosaic) -> None:
    assert set(status(mosaic).values()) == {"solved"}
    errors = errors_px(mosaic, wall.truth, gauge=True)
    assert np.sqrt(np.mean(errors**2)) < 0.15
    assert errors.max() < 1.0
    assert mosaic.photos[0].camera.k1 == pytest.approx(CAMERA.k1, abs=0.01)


def test_lies_where_the_poses_say(wall: PhotoSet, mosaic: Mosaic) -> None:
    """Twelve positions, each within 0.1 m: the mosaic lies within 0.1 m on the surface, 5 % in scale."""
    assert mosaic.surface == WALL
    assert mosaic.scale_from == "poses"
    off_mm = errors_px(mosaic, wall.truth, gauge=False) * 2.0
    assert np.median(off_mm) < 100.0
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=0.05)


def test_edges_and_pages_tell_how_the_photos_hold_together(mosaic: Mosaic) -> None:
    held = [edge for edge in mosaic.edges if edge.held]
    assert len(held) >= len(mosaic.photos)
    assert {k for edge in held for k in edge.photos} == set(range(len(mosaic.photos)))
    assert min(edge.matches for edge in held) > 8
    picture, graph, table = pages({}, mosaic)
    assert picture.markdown is not None
    assert graph.markdown is not None
    assert graph.markdown.startswith(f"### Match graph of wall: {len(mosaic.edges)} pairs")
    assert [row["photo"] for row in table.table] == [photo.name for photo in mosaic.photos]


def test_gains_undo_the_exposures(mosaic: Mosaic, true_gains: dict[str, float]) -> None:
    worst = max(abs(p.gain / true_gains[p.name] - 1.0) for p in mosaic.placements)
    assert worst < 0.005


def test_every_pixel_knows_its_photo(mosaic: Mosaic) -> None:
    image, coverage, source = pixels(mosaic.image), pixels(mosaic.coverage), pixels(mosaic.source)
    assert image.shape == (mosaic.height_px, mosaic.width_px, 3)
    assert set(np.unique(coverage)) == {0, 255}
    assert ((source > 0) == (coverage > 0)).all()
    assert source.max() == len(mosaic.photos)
    assert (image[coverage == 0] == 0).all()
    gsd_m = (mosaic.gsd_mm_px or 0.0) / 1000.0
    assert mosaic.covered_m2 == pytest.approx(np.count_nonzero(coverage) * gsd_m**2)


def test_shows_the_wall_without_steps_at_seams(texture: Texture, wall: PhotoSet, mosaic: Mosaic) -> None:
    """Every patch of the mosaic, seams too, fits the wall itself within half a pixel of its neighbours."""
    grey = cv2.cvtColor(pixels(mosaic.image), cv2.COLOR_RGB2GRAY).astype(np.float32)
    coverage, source = pixels(mosaic.coverage), pixels(mosaic.source)
    truth = _wall_in(mosaic, texture, wall)
    shifts, on_seam = [], []
    for y in range(0, mosaic.height_px - 96, 48):
        for x in range(0, mosaic.width_px - 96, 48):
            window = (slice(y, y + 96), slice(x, x + 96))
            if coverage[window].all():
                (dx, dy), response = cv2.phaseCorrelate(
                    truth[window], grey[window], cv2.createHanningWindow((96, 96), cv2.CV_32F)
                )
                assert response > 0.15
                shifts.append((dx, dy))
                on_seam.append(len(np.unique(source[window])) > 1)
    lengths = np.linalg.norm(np.array(shifts) - np.median(shifts, axis=0), axis=1)
    assert sum(on_seam) > 50
    assert np.percentile(lengths[on_seam], 95) < 0.5
    assert lengths.max() < 1.0


def _wall_in(mosaic: Mosaic, texture: Texture, wall: PhotoSet) -> np.ndarray:
    """The wall's texture on the mosaic's grid, laid over it by the similarity that the truth gives."""
    found, real = [], []
    for photo, placement in zip(mosaic.photos, mosaic.placements, strict=True):
        camera, pose = wall.truth[photo.name]
        middle = np.array([[camera.principal_px[0], camera.principal_px[1]]])
        q = np.array(placement.H_mosaic_photo) @ [*middle[0], 1.0]
        found.append(complex(*(q[:2] / q[2])))
        real.append(plane_points(camera, pose, middle)[0] @ [1, -1j])
    columns = np.column_stack([found, np.ones(len(found))])
    factor, shift = np.linalg.lstsq(columns, np.array(real), rcond=None)[0]
    x, y = np.meshgrid(np.arange(mosaic.width_px), np.arange(mosaic.height_px))
    uv = factor * (x + 1j * y) + shift
    u = ((uv.real - texture.left_m) / texture.m_px).astype(np.float32)
    v = ((texture.top_m + uv.imag) / texture.m_px).astype(np.float32)
    blurred = cv2.GaussianBlur(texture.linear, (0, 0), 1.2)
    return np.asarray(cv2.remap(np.sqrt(blurred) * 255, u, v, cv2.INTER_CUBIC))


def test_needs_no_poses(wall: PhotoSet) -> None:
    bare = PhotoSet(
        tuple(p.model_copy(update={"pose": None}) for p in wall.photos), wall.features, wall.truth
    )
    without = bare.stitch(None)
    assert (without.gsd_mm_px, without.scale_from, without.surface) == (None, "none", None)
    assert set(status(without).values()) == {"solved"}
    assert np.sqrt(np.mean(errors_px(without, wall.truth, gauge=True) ** 2)) < 0.15
    stated = bare.stitch(None, StitchSettings(features=2000, gsd_mm_px=2.0))
    assert (stated.gsd_mm_px, stated.scale_from) == (2.0, "stated GSD")
    assert (stated.width_px, stated.height_px) == pytest.approx((without.width_px, without.height_px), abs=3)


def test_poses_alone_give_the_scale(wall: PhotoSet) -> None:
    mosaic = wall.stitch(None)
    assert mosaic.scale_from == "poses"
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=0.1)
    assert np.sqrt(np.mean(errors_px(mosaic, wall.truth, gauge=True) ** 2)) < 0.15


def test_order_of_photos_changes_no_byte(wall: PhotoSet, mosaic: Mosaic) -> None:
    turned = PhotoSet(wall.photos[::-1], wall.features[::-1], wall.truth)
    assert turned.stitch(WALL).model_dump() == mosaic.model_dump()


def test_two_cards_with_the_same_file_names_are_one_set(wall: PhotoSet, mosaic: Mosaic) -> None:
    """Six photos of each card, called alike by both: each is matched by its own features, and shown once."""
    names = [f"DJI_{k % 6 + 1:04d}.JPG" for k in range(12)]
    photos = tuple(p.model_copy(update={"name": n}) for p, n in zip(wall.photos, names, strict=True))
    described = tuple(f.model_copy(update={"photo": n}) for f, n in zip(wall.features, names, strict=True))
    truth = {p.file.sha256: wall.truth[p.name] for p in wall.photos}
    both = PhotoSet(photos, described, truth).stitch(WALL)
    assert set(status(both).values()) == {"solved"}
    by_file = both.model_copy(
        update={"photos": tuple(p.model_copy(update={"name": p.file.sha256}) for p in both.photos)}
    )
    assert np.sqrt(np.mean(errors_px(by_file, truth, gauge=True) ** 2)) < 0.15
    assert both.covered_m2 == pytest.approx(mosaic.covered_m2, rel=0.01)


def test_same_picture_on_two_cards_counts_once(wall: PhotoSet) -> None:
    both = PhotoSet((*wall.photos, wall.photos[0]), (*wall.features, wall.features[0]), wall.truth)
    assert sum(p.status == "rejected" for p in both.stitch(WALL).placements) == 1


def test_number_of_threads_changes_no_byte(wall: PhotoSet, mosaic: Mosaic) -> None:
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        assert wall.stitch(WALL).model_dump() == mosaic.model_dump()
    finally:
        cv2.setNumThreads(before)


def test_foreign_and_blurred_photos_are_rejected_by_name(wall: PhotoSet, folder: Path) -> None:
    """One shows another wall though its pose says this one; one is blurred by 4 px."""
    other = concrete(seed=99)
    reported_poses = {p.name: p.pose for p in wall.photos if p.pose is not None}
    foreign_pose, blurred_pose = reported_poses["03.png"], reported_poses["07.png"]
    images = {
        "foreign.png": render(other, CAMERA, wall.truth["03.png"][1], seed=50),
        "blurred.png": render(concrete(), CAMERA, wall.truth["07.png"][1], seed=51, blur_px=4.0),
    }
    bad = photo_set(
        folder,
        images,
        wall.photos[0].camera,
        {},
        {"foreign.png": foreign_pose, "blurred.png": blurred_pose},
    )
    mosaic = wall.plus(bad).stitch(WALL)
    found = status(mosaic)
    reasons = {p.name: p.reason for p in mosaic.placements}
    assert found["foreign.png"] == "rejected"
    assert "another place" in reasons["foreign.png"]
    assert found["blurred.png"] == "rejected"
    assert "blurred" in reasons["blurred.png"]
    assert {left.item for left in mosaic.left_out} == {"foreign.png", "blurred.png"}
    assert sum(s == "solved" for s in found.values()) == 12


def test_a_second_wall_is_left_out_whole(wall: PhotoSet, folder: Path) -> None:
    """Three photos match one another, and their poses say this wall, but they match none of its photos."""
    other = concrete(seed=98)
    poses = {p.name: p.pose for p in wall.photos if p.pose is not None}
    shots = [wall.truth[wall.photos[5].name][1]] * 3
    shifted = [
        pose.model_copy(update={"position_m": (pose.position_m[0] + 0.2 * k, *pose.position_m[1:])})
        for k, pose in enumerate(shots)
    ]
    images = {f"other-{k}.png": render(other, CAMERA, pose, seed=70 + k) for k, pose in enumerate(shifted)}
    said = dict.fromkeys(images, poses[wall.photos[5].name])
    mosaic = wall.plus(photo_set(folder, images, wall.photos[0].camera, {}, said)).stitch(WALL)
    found = status(mosaic)
    assert {found[name] for name in images} == {"rejected"}
    assert sum(s == "solved" for s in found.values()) == 12


def test_photos_without_texture_are_placed_by_their_pose(wall: PhotoSet, folder: Path) -> None:
    """Three photos of a blank wall: nothing to match, but their poses say where."""
    blank = Texture(np.full((3000, 4000), 0.3, np.float32), 0.0015, -1.0, 3.5)
    names = ["00.png", "05.png", "11.png"]
    poses = {p.name: p.pose for p in wall.photos if p.pose is not None and p.name in names}
    images = {name: render(blank, CAMERA, wall.truth[name][1], seed=60 + k) for k, name in enumerate(names)}
    flat = photo_set(folder, images, wall.photos[0].camera, {}, poses)
    mosaic = wall.without(set(names)).plus(flat).stitch(WALL)
    found = status(mosaic)
    assert {found[name] for name in names} == {"placed"}
    assert sum(s == "solved" for s in found.values()) == 9
    assert all("± 0.10 m" in p.reason for p in mosaic.placements if p.status == "placed")
    for photo, placement in zip(mosaic.photos, mosaic.placements, strict=True):
        if placement.status == "placed":
            assert _offset_m(mosaic, photo.name, wall) < 0.4


def _offset_m(mosaic: Mosaic, name: str, wall: PhotoSet) -> float:
    placement = next(p for p in mosaic.placements if p.name == name)
    camera, pose = wall.truth[name]
    middle = np.array([[camera.principal_px[0], camera.principal_px[1]]])
    q = np.array(placement.H_mosaic_photo) @ [*middle[0], 1.0]
    uv = q[:2] / q[2] * (mosaic.gsd_mm_px or 0.0) / 1000.0 * [1, -1] + mosaic.origin_uv_m
    return float(np.linalg.norm(uv - plane_points(camera, pose, middle)[0]))


def test_photos_that_share_nothing_are_an_error(wall: PhotoSet, folder: Path) -> None:
    images = {
        "a.png": render(concrete(seed=7), CAMERA, wall.truth["00.png"][1], seed=1),
        "b.png": render(concrete(seed=8), CAMERA, wall.truth["00.png"][1], seed=2),
    }
    nothing = photo_set(folder, images, wall.photos[0].camera, {})
    with pytest.raises(BadInput, match=re.escape("none of its 2 photos")):
        nothing.stitch(None)


def test_one_photo_is_a_mosaic_too(wall: PhotoSet) -> None:
    one = PhotoSet(wall.photos[:1], wall.features[:1], wall.truth)
    assert status(one.stitch(WALL)) == {one.photos[0].name: "placed"}


def test_same_picture_twice_counts_once(wall: PhotoSet) -> None:
    twin = wall.photos[0].model_copy(update={"name": "twin.png"})
    both = PhotoSet(
        (*wall.photos, twin),
        (*wall.features, wall.features[0].model_copy(update={"photo": "twin.png"})),
        wall.truth,
    )
    mosaic = both.stitch(WALL)
    placement = next(p for p in mosaic.placements if p.name == "twin.png")
    assert placement.status == "rejected"
    assert placement.reason == f"the same picture as {wall.photos[0].name}"


def test_a_surface_that_no_photo_shows_is_an_error(wall: PhotoSet) -> None:
    away = CameraPose(position_m=(500.0, -4.0, 0.0), yaw_deg=0.0, pitch_deg=0.0)
    photos = tuple(p.model_copy(update={"pose": away}) for p in wall.photos[:2])
    with pytest.raises(BadInput, match="no photo shows any part of this surface"):
        PhotoSet(photos, wall.features[:2], wall.truth).stitch(WALL)
