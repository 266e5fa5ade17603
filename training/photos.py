"""Crops to learn from: photos with masks, turned, scaled, cracked, relit, blurred, noisy."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from skimage.morphology import skeletonize

from training.cracks import DOUBTFUL, FAINT, VISIBLE, cracks_on, faint, seen, told

SIDE_PX = 224
ON_CRACK = 0.3  # share of the crops of a photo with a crack that are centred on it
DRAWN = 0.1  # share of the crops of photos on which further cracks are drawn: real surfaces, known cracks
LENT = 0.25  # share of all crops on which the cracks of another photo are laid
FADED = 0.25  # share of all crops whose cracks are made fainter
DAPPLED = 0.15  # share of all crops on which leaves and branches throw their shadows
LENT_SCALES = (0.5, 6.0)  # seen from near they are wide, and the surface still sharp
AROUND_PX = 41  # the surface beside a crack is told from this far around it
FOLDS = 5

Pixels = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Rng = np.random.Generator


@dataclass(frozen=True)
class Photo:
    """rgb (H, W, 3); truth (H, W, 3), 0 or 255: crack, its centreline (3 px wide), whether it counts; kept
    (H, W), 255 × the share of light that its cracks leave of the surface's."""

    name: str
    rgb: Pixels
    truth: Pixels
    kept: Pixels
    on_crack: npt.NDArray[np.int32]  # (n, 2) y, x of some pixels of the cracks
    scales: tuple[float, float]
    drawn: float  # share of its crops on which cracks are drawn


def read(folder: Path, names: list[str], scales: tuple[float, float], drawn: float = 0.0) -> list[Photo]:
    """The named photos of FOLDER/images with their masks of FOLDER/masks."""
    photos = []
    for name in names:
        bgr = cv2.imread(str(folder / "images" / name), cv2.IMREAD_COLOR)
        mask = cv2.imread(str(folder / "masks" / name), cv2.IMREAD_GRAYSCALE)
        if bgr is None or mask is None:
            raise SystemExit(f"{folder}: {name} or its mask cannot be read")
        crack = ((mask > 0) & (mask != DOUBTFUL)).astype(np.uint8)
        truth = 255 * np.dstack([crack, _line(crack), (mask != DOUBTFUL).astype(np.uint8)])
        on_crack = np.argwhere(crack > 0)[::7].astype(np.int32)
        rgb = np.ascontiguousarray(bgr[..., ::-1], np.uint8)
        photos.append(Photo(name, rgb, truth, _kept(rgb, crack), on_crack, scales, drawn))
    return photos


def _line(crack: Pixels) -> Pixels:
    """(H, W) of 0 and 1: the centrelines, three pixels wide."""
    thin = np.asarray(skeletonize(crack > 0), np.uint8)
    return np.asarray(cv2.dilate(thin, np.ones((3, 3), np.uint8)), np.uint8)


def _kept(rgb: Pixels, crack: Pixels) -> Pixels:
    """255 × the light of each crack beside that of what is around it, 255 away from cracks."""
    grey = rgb.mean(axis=2).astype(np.float32)
    rim = cv2.dilate(crack, np.ones((5, 5), np.uint8))
    free, size = (1 - rim).astype(np.float32), (AROUND_PX, AROUND_PX)
    around = cv2.boxFilter(grey * free, -1, size) / np.maximum(cv2.boxFilter(free, -1, size), 1e-3)
    kept = np.where(rim > 0, np.minimum(grey / np.maximum(around, 1.0), 1.0), 1.0)
    return np.asarray(np.rint(255.0 * kept), np.uint8)


def by_fold(groups: Path) -> list[list[str]]:
    """Names of each of FOLDS folds: groups of one photo stay together, folds are of nearly equal size."""
    members: dict[str, list[str]] = {}
    for row in groups.read_text().split("\n"):
        if row.strip():
            name, group = row.split()
            members.setdefault(group, []).append(name)
    folds: list[list[str]] = [[] for _ in range(FOLDS)]
    for group in sorted(members, key=lambda g: (-len(members[g]), int(g))):
        min(folds, key=len).extend(members[group])
    return [sorted(fold) for fold in folds]


def crop(photo: Photo, lender: Photo, rng: Rng) -> tuple[Floats, Floats]:
    """(3, SIDE_PX, SIDE_PX) RGB in 0..1 and (3, SIDE_PX, SIDE_PX) truth, as read() gives it."""
    A, scale, at = _view(photo, photo.scales, ON_CRACK, rng)
    rgb = photo.rgb if scale > 0.8 else _softened(photo.rgb, at, scale)
    looks = _warped(rgb, A).astype(np.float32) / np.float32(255.0)
    truth = (_warped(photo.truth, A) > 110).astype(np.float32)
    if rng.random() < FADED:
        looks = _faded(looks, _warped(photo.kept, A).astype(np.float32) / np.float32(255.0), rng)
    if rng.random() < photo.drawn:
        looks, truth = _cracked(looks, truth, rng)
    if len(lender.on_crack) and rng.random() < LENT:
        looks, truth = _lent(looks, truth, lender, rng)
    return _relit(looks, rng).transpose(2, 0, 1), truth.transpose(2, 0, 1)


def _view(
    photo: Photo, scales: tuple[float, float], on_crack: float, rng: Rng
) -> tuple[npt.NDArray[np.float64], float, tuple[float, float]]:
    """The 2×3 map from the photo to a crop, its scale and the point (x, y) of the photo in its middle."""
    height, width = photo.rgb.shape[:2]
    scale = float(np.exp(rng.uniform(*np.log(scales))))
    if len(photo.on_crack) and rng.random() < on_crack:
        off = rng.uniform(-0.35, 0.35, 2) * SIDE_PX / scale
        y, x = photo.on_crack[rng.integers(len(photo.on_crack))] + off
    else:
        y, x = rng.uniform(0, height), rng.uniform(0, width)
    angle = rng.uniform(0, 2 * np.pi) if rng.random() < 0.6 else rng.integers(4) * np.pi / 2
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    flip = rng.choice([-1.0, 1.0])
    A = np.array([[c * flip, -s, 0.0], [s * flip, c, 0.0]])
    A[:, 2] = SIDE_PX / 2 - A[:, :2] @ (x, y)
    return A, scale, (float(x), float(y))


def _lent(rgb: Floats, truth: Floats, lender: Photo, rng: Rng) -> tuple[Floats, Floats]:
    """The cracks of another photo on this one, lighter or darker: real shapes, other surfaces. As they were
    where they would drown in this surface's texture."""
    A, _, _ = _view(lender, LENT_SCALES, 1.0, rng)
    cracks = (_warped(lender.truth, A) > 110).astype(np.float32)
    kept = (_warped(lender.kept, A).astype(np.float32) / np.float32(255.0)) ** np.exp(rng.normal(0.0, 0.3))
    dark = 1.0 - float((kept * cracks[..., 0]).sum() / max(1.0, float(cracks[..., 0].sum())))
    if dark < 1.5 * _texture(rgb):
        return rgb, truth
    both = np.dstack([np.maximum(truth[..., :2], cracks[..., :2]), np.maximum(truth[..., 2], cracks[..., 0])])
    return rgb * kept[..., None].astype(np.float32), both


def _texture(rgb: Floats) -> float:
    """RMS of ln(brightness) at up to some ten pixels' size."""
    grey = np.log(rgb.mean(axis=2) + np.float32(0.02))
    return float(np.std(grey - cv2.GaussianBlur(grey, (0, 0), 8.0)))


def _cracked(rgb: Floats, truth: Floats, rng: Rng) -> tuple[Floats, Floats]:
    """Further cracks across the crop, each lot as dark as one crack."""
    texture = _texture(rgb)
    share = seen(cracks_on(rng, SIDE_PX, 1.0, texture), SIDE_PX, SIDE_PX, 1.0)
    kept = np.exp(rng.uniform(np.log(0.12), np.log(0.88)))
    if rng.random() < FAINT:
        kept = faint(rng, texture)
    cracked = rgb * (1.0 - share * np.float32(1.0 - kept))[..., None]
    drawn = told(cracked, 255 * (share >= VISIBLE).astype(np.uint8))
    crack = (drawn == 255).astype(np.uint8)
    both = np.maximum(truth, np.dstack([crack, _line(crack), crack]))
    both[..., 2] *= (drawn != DOUBTFUL) | (truth[..., 0] > 0)
    return cracked, both


def _faded(rgb: Floats, kept: Floats, rng: Rng) -> Floats:
    """The photo's own cracks nearer to the brightness around them, and still to be seen."""
    lifted = np.maximum(kept, np.float32(0.05)) ** np.float32(-rng.uniform(0.2, 0.7))
    return np.minimum(rgb * lifted[..., None], np.float32(1.0))


def _warped(picture: Pixels, A: npt.NDArray[np.float64]) -> Pixels:
    side, mirrored = (SIDE_PX, SIDE_PX), cv2.BORDER_REFLECT_101
    return np.asarray(cv2.warpAffine(picture, A, side, flags=cv2.INTER_LINEAR, borderMode=mirrored), np.uint8)


def _softened(rgb: Pixels, at: tuple[float, float], scale: float) -> Pixels:
    """The photo, blurred around `at` as much as a reduction by `scale` asks for."""
    reach = int(0.75 * SIDE_PX / scale) + 8
    rows = slice(max(0, int(at[1]) - reach), max(0, int(at[1]) + reach))
    columns = slice(max(0, int(at[0]) - reach), max(0, int(at[0]) + reach))
    soft = rgb.copy()
    if soft[rows, columns].size:
        soft[rows, columns] = cv2.GaussianBlur(rgb[rows, columns], (0, 0), 0.45 * np.sqrt(1 / scale**2 - 1))
    return soft


def _dappled(rgb: Floats, rng: Rng) -> Floats:
    """Under ragged, drawn-out shadows: darker and bluer, for the sky shines there, sharp as in the sun."""
    wide = 2 * SIDE_PX  # to turn and stretch
    size_px = float(np.exp(rng.uniform(np.log(8.0), np.log(50.0))))
    leaves = np.zeros((wide, wide), np.float32)
    for octave in range(4):
        noise = cv2.GaussianBlur(rng.standard_normal((wide, wide), np.float32), (0, 0), size_px / 2**octave)
        leaves += noise / noise.std() / np.float32(1.5**octave)
    turn = cv2.getRotationMatrix2D((wide / 2, wide / 2), float(rng.uniform(0, 360)), 1.0)
    turn[:, :2] = turn[:, :2] @ np.diag([float(rng.uniform(0.25, 1.0)), 1.0])
    turn[:, 2] = SIDE_PX / 2 - turn[:, :2] @ np.full(2, wide / 2)
    turned = cv2.warpAffine(leaves, turn, (SIDE_PX, SIDE_PX), borderMode=cv2.BORDER_REFLECT_101)
    sharp = (turned > np.quantile(turned, rng.uniform(0.7, 0.97))).astype(np.float32)
    shadow = cv2.GaussianBlur(sharp, (0, 0), float(np.exp(rng.uniform(np.log(0.5), np.log(4.0)))))
    kept = float(rng.uniform(0.25, 0.7)) * np.array([0.95, 1.0, rng.uniform(1.0, 1.3)], np.float32)
    return np.asarray(rgb * (1.0 - shadow[..., None] * (1.0 - kept)), np.float32)


def _relit(rgb: Floats, rng: Rng) -> Floats:
    """Another camera, another light."""
    if rng.random() < 0.3:
        y, x = np.mgrid[:SIDE_PX, :SIDE_PX].astype(np.float32) / SIDE_PX - 0.5
        angle = rng.uniform(0, 2 * np.pi)
        across = x * np.float32(np.cos(angle)) + y * np.float32(np.sin(angle)) - rng.uniform(-0.4, 0.4)
        edge = np.exp(rng.uniform(np.log(0.002), np.log(0.5)))
        shade = rng.uniform(0.1, 0.65) / (1.0 + np.exp(np.clip(across / edge, -40, 40)))
        rgb = rgb * (1.0 - shade).astype(np.float32)[..., None]
    if rng.random() < DAPPLED:
        rgb = _dappled(rgb, rng)
    gain = np.exp(rng.normal(-0.1, 0.45) + rng.normal(0.0, 0.06, 3)).astype(np.float32)
    rgb = np.clip(rgb * gain, np.float32(1e-3), np.float32(1.0)) ** np.float32(np.exp(rng.normal(0.0, 0.25)))
    grey = rgb @ np.full((3, 1), 1 / 3, np.float32)
    if rng.random() < 0.5:
        rgb = grey + (rgb - grey) * np.float32(rng.choice([0.0, rng.uniform(0.0, 1.6)]))
    middle = grey.mean()
    rgb = middle + (rgb - middle) * np.float32(np.exp(rng.normal(0.0, 0.25)))
    rgb = np.ascontiguousarray(rgb, np.float32)
    if rng.random() < 0.5:
        soft = np.asarray(cv2.GaussianBlur(rgb, (0, 0), float(rng.uniform(0.4, 1.3))), np.float32)
        rgb = soft if rng.random() < 0.7 else rgb + np.float32(rng.uniform(0.3, 1.0)) * (rgb - soft)
    if rng.random() < 0.6:
        fine = rng.standard_normal(rgb.shape, np.float32)
        if rng.random() < 0.5:
            fine = fine[..., :1]
        rgb = rgb + np.float32(rng.uniform(0.003, 0.05)) * fine
    return np.clip(rgb, 0.0, 1.0).astype(np.float32)
