"""Mosaics with drawn cracks, and inspections made of them: all that a report is written from."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import tifffile

from artifacts.mask_png import write_mask
from schemas.bit_mask import BitMask
from schemas.crack import Crack, Measurement, WidthSample
from schemas.crack_report import CrackReport, SurfaceInspected
from schemas.detection import Detection, Patterns
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.inspection import Inspection
from schemas.mosaic import Mosaic, PhotoPlacement
from schemas.photo import Photo
from schemas.problem import LeftOut
from schemas.registered_model import RegisteredModel
from schemas.structure import Structure
from schemas.surface import Surface
from tests.artifacts.bridge import CAMERA, Shelf, flight, model, structure

Pixels = npt.NDArray[np.uint8]
Line = tuple[tuple[float, float], tuple[float, float], float]  # from, to (mm right and down), width in mm
Seen = tuple[Mosaic, Patterns, Detection, Measurement]
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LIMITS_MM = ((1.0, "wide"), (0.5, "medium"), (0.2, "fine"), (0.0, "hairline"))
SIGMA_PX = 0.12


@dataclass
class Inspected:
    shelf: Shelf
    inspection: Inspection
    report: CrackReport
    seen: Sequence[Seen] = ()
    structure: Structure | None = None
    model: RegisteredModel | None = None
    plan: FlightPlan | None = None
    log: FlightLog | None = None

    def report_inputs(self) -> dict[str, Any]:
        mosaics, patterns, detections, measurements = zip(*self.seen, strict=True) if self.seen else [()] * 4
        return {
            "inspection": self.inspection,
            "report": self.report,
            "mosaics": mosaics,
            "patterns": patterns,
            "detections": detections,
            "measurements": measurements,
            "structure": self.structure,
            "model": self.model,
            "plan": self.plan,
            "log": self.log,
            "open_file": self.shelf.open_file,
        }


def inspected_bridge(folder: Path, gsd: float = 4.0) -> Inspected:
    """Everything there is: scans, flight, three surfaces, six cracks, something left out."""
    shelf = Shelf(folder)
    built = structure(shelf)
    on = {s.name: s for s in built.surfaces}
    lines: dict[str, list[Line]] = {
        "wall-01": [
            ((1500, 200), (1900, 850), 4.0),
            ((5200, 80), (5300, 820), 1.2),
            ((8000, 500), (9400, 620), 0.5),
        ],
        "wall-10": [((300, 900), (1200, 2600), 3.2), ((800, 4000), (850, 5200), 0.9)],
        "soffit-01": [((3000, 300), (6400, 420), 0.3)],
    }
    seen = [
        mosaic_of(shelf, name, on[name], cracks, seed, gsd)
        for seed, (name, cracks) in enumerate(lines.items())
    ]
    plan, log = flight(shelf, built)
    left_out = (
        LeftOut(item="wall-01-006.jpg", stage="stitching", what="blurred", remedy="Shoot it again"),
        LeftOut(
            item="scan-07.ply", stage="registration", what="holds no finite point", remedy="Export it again"
        ),
        LeftOut(
            item="soffit-01-028", stage="flight", what="planned but not shot", remedy="Fly a new mission id"
        ),
    )
    return Inspected(
        shelf,
        Inspection.model_validate({"name": "demo-bridge", "report": {"baselines": True}}),
        crack_report("demo-bridge", seen, left_out),
        seen,
        built,
        model(shelf, built),
        plan,
        log,
    )


def inspected_photos(
    folder: Path, lines: Sequence[Line], count: int = 2, gsd: float | None = None
) -> Inspected:
    """Photos that stand for themselves, without a surface; without a scale where gsd is None."""
    shelf = Shelf(folder)
    seen = [mosaic_of(shelf, f"photo-{n:03d}.jpg", None, lines, n, gsd) for n in range(1, count + 1)]
    return Inspected(shelf, Inspection(name="photos-only"), crack_report("photos-only", seen), seen)


def crack_report(name: str, seen: Sequence[Seen], left_out: Sequence[LeftOut] = ()) -> CrackReport:
    return CrackReport(
        inspection=name,
        method="hairline",
        surfaces=tuple(
            SurfaceInspected(
                name=mosaic.name,
                area_m2=mosaic.surface.area_m2 if mosaic.surface else None,
                inspected_m2=mosaic.covered_m2,
                gsd_mm_px=mosaic.gsd_mm_px,
                photos=sum(p.status != "rejected" for p in mosaic.placements),
                cracks=len(found.cracks),
                method="hairline",
            )
            for mosaic, _, _, found in seen
        ),
        cracks=tuple(crack for *_, found in seen for crack in found.cracks),
        not_inspected=tuple(left_out),
    )


def mosaic_of(
    shelf: Shelf, name: str, on: Surface | None, lines: Sequence[Line], seed: int, gsd: float | None
) -> Seen:
    """A mosaic of a surface (or a photo of 800 × 600 px) with cracks along `lines`, pink markers along its
    upper side and a blank place in its upper right corner."""
    rng = np.random.default_rng(seed)
    mm_px = gsd or 1.0
    u0, v0, u1, v1 = on.bounds_m if on else (0.0, 0.0, 0.8 * mm_px, 0.6 * mm_px)
    width_px, height_px = round((u1 - u0) * 1000 / mm_px), round((v1 - v0) * 1000 / mm_px)
    pixels, mask = concrete(height_px, width_px, seed), np.zeros((height_px, width_px), np.uint8)
    cracks = tuple(
        _crack(name, number, line, on, mm_px, gsd is not None, mask, rng)
        for number, line in enumerate(lines, start=1)
    )
    dark = cv2.GaussianBlur(mask, (0, 0), 0.8)[..., None] / 255.0
    pixels = np.clip(pixels * (1 - 0.68 * dark), 0, 255).astype(np.uint8)
    coverage = np.full((height_px, width_px), 255, np.uint8)
    coverage[: height_px // 3, int(width_px * 0.9) :] = 0
    markers = np.zeros_like(coverage)
    for x in range(width_px // 8, width_px, width_px // 4):
        cv2.circle(markers, (x, height_px // 12), max(2, height_px // 40), 255, -1)
    pixels[markers > 0] = (233, 100, 160)
    pixels[coverage == 0] = 0

    folder = shelf.folder / hashlib.sha256(name.encode()).hexdigest()[:8]
    folder.mkdir()
    mosaic = Mosaic(
        name=name,
        surface=on,
        image=_tiff(shelf, folder / "image.tif", pixels),
        coverage=_tiff(shelf, folder / "coverage.tif", coverage),
        source=_tiff(shelf, folder / "source.tif", np.ones_like(coverage, dtype=np.uint16)),
        width_px=width_px,
        height_px=height_px,
        gsd_mm_px=gsd,
        scale_from="poses" if gsd else "none",
        origin_uv_m=(u0, v1) if on else (0.0, 0.0),
        **_photos(shelf, folder, name, pixels, on is None),
        covered_m2=float((coverage > 0).sum()) * gsd**2 / 1e6 if gsd else None,
        rms_px=0.31,
    )
    patterns = Patterns(
        mask=_png(shelf, folder / "markers.png", np.maximum(markers, 255 - coverage)),
        peaks=(0, 168, 233),
        i_blank=0,
        i_surface=168,
        i_pattern=233,
        t1=84.0,
        t2=200.5,
        pattern_px=int((markers > 0).sum()),
        blank_px=int((coverage == 0).sum()),
        outside_px=0,
        inspectable_px=int(((coverage > 0) & (markers == 0)).sum()),
    )
    detection = Detection(
        mask=_png(shelf, folder / "mask.png", mask),
        method="hairline",
        crack_px=int((mask > 0).sum()),
        inspected_px=patterns.inspectable_px,
        baselines=(("global 125", _png(shelf, folder / "125.png", (pixels[..., 0] < 125) * np.uint8(255))),),
    )
    rejected = (((100.0, 100.0), "a formwork joint"),)
    return mosaic, patterns, detection, Measurement(surface=name, cracks=cracks, rejected=rejected)


def concrete(height_px: int, width_px: int, seed: int) -> Pixels:
    rng = np.random.default_rng(seed)
    grey = np.full((height_px, width_px), 168.0, dtype=np.float32)
    for step, strength in ((1, 5), (4, 5), (16, 5), (96, 9), (400, 10)):
        size = (max(2, -(-height_px // step)), max(2, -(-width_px // step)))
        coarse = rng.normal(0, strength, size).astype(np.float32)
        grey += cv2.resize(coarse, (width_px, height_px), interpolation=cv2.INTER_CUBIC)
    return np.clip(np.stack([grey * 1.01, grey * 0.99, grey * 0.94], axis=-1), 0, 255).astype(np.uint8)


def _crack(
    surface: str,
    number: int,
    drawn: Line,
    on: Surface | None,
    mm_px: float,
    scaled: bool,
    mask: Pixels,
    rng: np.random.Generator,
) -> Crack:
    """Draw a wandering line into `mask`; its measures as Crack."""
    start, end = np.array(drawn[0]) / mm_px, np.array(drawn[1]) / mm_px
    direction = end - start
    length = float(np.linalg.norm(direction))
    t = np.linspace(0, 1, max(8, int(length / 25)))[:, None]
    across = np.array([-direction[1], direction[0]]) / length
    line = (
        start
        + direction * t
        + across * np.cumsum(rng.normal(0, 0.004 * length, t.shape), axis=0) * np.sin(np.pi * t)
    )
    width = drawn[2] / mm_px * (0.55 + 0.45 * np.sin(np.pi * t[:, 0])) * rng.uniform(0.85, 1.15, len(t))
    for a, b, w in zip(line[:-1], line[1:], width, strict=False):
        corners = [tuple(round(v * 16) for v in p) for p in (a, b)]
        cv2.line(mask, *corners, 255, max(1, round(w)), cv2.LINE_8, 4)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    widest = float(np.percentile(width, 95))
    millimetres: dict[str, Any] = {}
    if scaled:
        millimetres = {
            "length_mm": float(s[-1]) * mm_px,
            "length_sigma_mm": 12.0,
            "width_median_mm": float(np.median(width)) * mm_px,
            "width_max_mm": widest * mm_px,
            "width_sigma_mm": SIGMA_PX * mm_px,
            "widths": tuple(
                WidthSample(s_mm=float(a) * mm_px, width_mm=float(w) * mm_px, sigma_mm=SIGMA_PX * mm_px)
                for a, w in zip(s, width, strict=True)
            ),
            "severity": next(name for limit, name in LIMITS_MM if widest * mm_px >= limit),
            "kind": "transverse" if abs(direction[1]) > abs(direction[0]) else "longitudinal",
        }
    if on is not None:
        uv = np.array([on.bounds_m[0], on.bounds_m[3]]) + line * np.array([1, -1]) * mm_px / 1000
        world = on.to_world(uv).tolist()
        millimetres |= {
            "polyline_world_m": tuple(map(tuple, world)),
            "position_m": tuple(world[len(world) // 2]),
            "position_uv_m": tuple(uv[len(uv) // 2].tolist()),
        }
    return Crack(
        id=f"{surface}-C{number:03d}",
        surface=surface,
        polyline_px=tuple(map(tuple, line.tolist())),
        length_px=float(s[-1]),
        width_median_px=float(np.median(width)),
        width_max_px=widest,
        orientation_deg=float(np.degrees(np.arctan2(-direction[1], direction[0])) % 180),
        width_is_upper_bound=drawn[2] < 0.7,
        photo=f"{surface}-001.jpg",
        **millimetres,
    )


def _photos(shelf: Shelf, folder: Path, name: str, pixels: Pixels, alone: bool) -> dict[str, Any]:
    cv2.imwrite(str(folder / "photo.jpg"), pixels[:200, :200, ::-1])
    file = shelf.put(folder / "photo.jpg")
    names = [f"{name}-{number:03d}.jpg" for number in range(1, 7)]
    statuses = [*[("solved", "")] * 4, ("placed", "too few matches"), ("rejected", "blurred")]
    if alone:
        names, statuses = [name], [("solved", "")]
    return {
        "photos": tuple(
            Photo(name=n, file=file, camera=CAMERA, surface=name, sharpness=0.3, exposure=0.5) for n in names
        ),
        "placements": tuple(
            PhotoPlacement(
                name=n,
                status=status,
                reason=reason,
                H_mosaic_photo=None if status == "rejected" else IDENTITY,
                matches=210,
                rms_px=0.31,
            )
            for n, (status, reason) in zip(names, statuses, strict=True)
        ),
    }


def _tiff(shelf: Shelf, path: Path, pixels: npt.NDArray[Any]):
    kind = "rgb" if pixels.ndim == 3 else "minisblack"
    tifffile.imwrite(path, pixels, tile=(256, 256), photometric=kind, compression="zlib")
    return shelf.put(path)


def _png(shelf: Shelf, path: Path, pixels: Pixels):
    write_mask(BitMask.of(pixels > 0), path)
    return shelf.put(path)
