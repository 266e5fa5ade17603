"""The adjustment alone, on points that cameras truly saw: rolling shutters, and how well it knows itself."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from schemas.camera import Camera
from tasks.stitching import adjustment
from tasks.stitching.adjustment import Adjusted, adjust
from tasks.stitching.prior import UNKNOWN, Prior
from tasks.stitching.tracks import Observations
from tasks.stitching.view import FACING, View, rotation

Array = npt.NDArray[np.float64]
CAMERA = Camera(width_px=1600, height_px=1200, focal_px=2000.0, k1=-0.03)
POINTS = 1200


def flown(seed: int, roll_px: float) -> list[View]:
    """4 × 3 photos, 60 % overlap, 1.5° and 5 cm of jitter, 4 m away; rolling shutters each its own way."""
    rng = np.random.default_rng(seed)
    views = []
    for k in range(12):
        at = np.array([1.3 * (k % 4), 1.0 * (k // 4), 4.0]) + rng.normal(0, 0.05, 3)
        turn = rotation(np.radians(rng.normal(0, 1.5, 3)))
        views.append(View(CAMERA, FACING @ turn, at, rng.normal(0, roll_px, 2)))
    return views


def adjusted(true: list[View], noise_px: float, seed: int, bent_px: float = 0.0) -> Adjusted:
    """bent_px: how far each photo's far corners are off in ways that no unknown describes."""
    said, seen, priors = observed(true, noise_px, seed)
    if bent_px:
        bend = np.random.default_rng([seed, 2]).normal(0, bent_px, (12, 2, 3))
        x, y = ((seen.xy - [800, 600]) / [800, 600]).T
        off = np.einsum("ijk,ki->ij", bend[seen.photo], np.stack([x**3, x * y**2, y**3]))
        seen = replace(seen, xy=seen.xy + off)
    return adjust(said, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None)


def observed(true: list[View], noise_px: float, seed: int) -> tuple[list[View], Observations, list[Prior]]:
    """Positions off by 5 cm and level cameras without rolling shutter, distortion and relief; what the true
    ones see; and what is known of them."""
    rng = np.random.default_rng([seed, 1])
    X = rng.uniform((-1.5, -1.2), (5.5, 3.3), (POINTS, 2))
    photo, track, xy = [], [], []
    for i, view in enumerate(true):
        px = view.to_photo(X) + rng.normal(0, noise_px, X.shape)
        seen = np.flatnonzero(((px > 0) & (px < [1599, 1199])).all(axis=1))
        photo.append(np.full(len(seen), i))
        track.append(seen)
        xy.append(px[seen])
    order = np.argsort(np.concatenate(track), kind="stable")
    plain = CAMERA.model_copy(update={"k1": 0.0})
    seen = Observations(np.concatenate(photo)[order], np.concatenate(track)[order], np.concatenate(xy)[order])
    every = Observations(seen.photo, seen.track, seen.xy).where(np.ones(len(order), bool))
    said = [View(plain, FACING, v.C + rng.normal(0, 0.05, 3)) for v in true]
    priors = [Prior(v, np.full(3, 0.05), np.radians(np.full(3, 2.0))) for v in said]
    return said, every, priors


def off_m(found: Adjusted, true: list[View], px: Array) -> Array:
    """(photos, N, 2) metres between where pixels lie and where they were found, after the best similarity."""
    z = np.concatenate([_on_plane(v, px) for v in found.views]) @ [1, 1j]
    w = np.concatenate([_on_plane(v, px) for v in true]) @ [1, 1j]
    columns = np.column_stack([z, np.ones(len(z))])
    left = columns @ np.linalg.lstsq(columns, w, rcond=None)[0] - w
    return np.column_stack([left.real, left.imag]).reshape(len(true), -1, 2)


def _on_plane(view: View, px: Array) -> Array:
    """Pixels as taken: the rolling shutter undone first, then the lens."""
    still = px - ((px[:, 1:] + 0.5) / 1200 - 0.5) * view.roll_px
    c = view.camera
    ideal = c.undistort((still - c.principal_px) / c.focal_px) * c.focal_px + c.principal_px
    return replace(view, roll_px=np.zeros(2)).to_plane(ideal)


CORNERS = np.array([[0.0, 0.0], [1599.0, 0.0], [1599.0, 1199.0], [0.0, 1199.0], [800.0, 600.0]])
PIXEL_M = 0.002
BENT_PX = 0.1


@pytest.mark.parametrize(("roll_px", "most_px"), [(0.0, 0.25), (3.0, 2.5)])
def test_is_metric_with_and_without_a_rolling_shutter(roll_px: float, most_px: float) -> None:
    """3 px of shutter each, left in, would bend the mosaic by pixels; what all share cannot be seen."""
    true = flown(20, roll_px)
    found = adjusted(true, 0.3, 20)
    rms_px = float(np.sqrt((off_m(found, true, CORNERS) ** 2).sum(axis=2).mean())) / PIXEL_M
    assert rms_px < most_px
    if roll_px == 0.0:
        assert np.abs([v.roll_px for v in found.views]).max() < 0.1
    else:
        rest = np.array([f.roll_px - t.roll_px for f, t in zip(found.views, true, strict=True)])
        assert (rest - rest.mean(axis=0)).std() < 1.5


def test_noise_in_the_rows_is_not_taken_for_a_shutter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free to, the shutter must not stretch photos so that their noise shrinks: each by a pixel, it did."""
    monkeypatch.setattr(adjustment, "_is_told", lambda *_: True)
    monkeypatch.setattr(adjustment, "learnt_roll", lambda *_: np.full(2, 3.0))
    found = adjusted(flown(20, 0.0), 0.3, 20)
    assert np.abs(np.mean([v.roll_px for v in found.views], axis=0)).max() < 0.3


@pytest.mark.parametrize("seed", [20, 21, 22])
def test_the_speed_of_the_vehicle_tells_what_a_shutter_did_to_all_photos_alike(seed: int) -> None:
    """30 ms, speeds known to 3 cm/s: what is left of 3 px each; speeds of other photos are of no use."""
    true = flown(seed, 3.0)
    said, seen, priors = observed(true, 0.3, seed)
    rng, errors_px = np.random.default_rng([seed, 3]), []
    moving = [_speed(view) + rng.normal(0, 0.03, 3) for view in true]
    for speeds in (moving, moving[1:] + moving[:1], [UNKNOWN] * 12):
        known = [replace(prior, velocity=v) for prior, v in zip(priors, speeds, strict=True)]
        found = adjust(said, seen, known, np.full(3, 0.05), [0.01] * 12, lambda _: None)
        errors_px.append(float(np.sqrt((off_m(found, true, CORNERS) ** 2).sum(axis=2).mean())) / PIXEL_M)
    assert errors_px[0] < 0.7 < errors_px[2]
    assert errors_px[1] == pytest.approx(errors_px[2])


def _speed(view: View) -> Array:
    """(3,) of a vehicle whose camera reads out in 30 ms and shows what `view` shows."""
    across = -view.roll_px / 0.03 * view.C[2] / view.camera.focal_px
    return np.asarray(view.R @ np.append(across, 0.0))


def test_a_lens_off_its_middle_is_found() -> None:
    """8 and 5 px off, the distortion about it: taken for centred, the mosaic bends by 0.4 px RMS."""
    values = {"k1": -0.07, "cx_px": 807.5, "cy_px": 594.5}
    off_middle = Camera.model_validate(CAMERA.model_dump() | values)
    true = [replace(view, camera=off_middle) for view in flown(20, 0.0)]
    found = adjusted(true, 0.2, 20)
    rms_px = float(np.sqrt((off_m(found, true, CORNERS) ** 2).sum(axis=2).mean())) / PIXEL_M
    assert rms_px < 0.2
    assert found.views[0].camera.principal_px == pytest.approx((807.5, 594.5), abs=3.0)


@pytest.mark.parametrize("seed", range(20, 26))
def test_what_bends_photos_is_not_taken_for_a_shutter(seed: int) -> None:
    """Free to stretch each photo, a shutter would follow any error, and stretch the whole wall."""
    found = adjusted(flown(seed, 0.0), 0.2, seed, bent_px=BENT_PX)
    assert np.abs([v.roll_px for v in found.views]).max() < 0.1


def test_errors_are_as_large_as_it_says() -> None:
    """12 photos, 5 draws of few truly free numbers each: mean d²/2 near 1, most inside the 99 % ellipse."""
    d2 = []
    for seed in range(20, 25):
        true = flown(seed, 1.0)
        found = adjusted(true, 0.3, seed)
        off = off_m(found, true, CORNERS[4:])[:, 0]
        d2 += [float(e @ np.linalg.solve(c, e)) for e, c in zip(off, found.certainty.relative, strict=True)]
    assert 0.5 < np.mean(d2) / 2 < 2.0
    assert np.mean(np.array(d2) < 9.21) >= 0.9
