"""`hairline stitch`, `detect` and `measure`: from photos to cracks, on plain files."""

from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Literal

from flows.command_line import app
from flows.console import err, plain
from flows.option_types import Gsd, of_options
from flows.plain_files import (
    OutFolder,
    one_by_one,
    photos_in,
    read_camera,
    read_control,
    refuse_unless_file,
    say,
    warn,
    working,
)
from schemas.problem import BadInput, LeftOut

if TYPE_CHECKING:
    from schemas.crack import Measurement
    from schemas.detection import Detection, Patterns
    from schemas.mosaic import Mosaic
    from schemas.photo import Photo
    from schemas.settings import DetectSettings

Method = Literal["hairline", "ridge", "paper", "global", "onnx"]


@app.command
def stitch(
    folder: Path,
    *,
    out: OutFolder,
    gsd_mm_px: Gsd = None,
    camera: Path | None = None,
    control: Path | None = None,
) -> None:
    """Stitch the photos of one surface: D/mosaic.tif, D/stitch.json (per photo: status, 3×3 homography).

    Parameters
    ----------
    folder:
        Photos: JPEG, PNG, BMP, TIFF, HEIC. Focal length, GPS and gimbal angles are read where stated.
    out:
        Folder to write to.
    gsd_mm_px:
        States the mosaic's scale, mm per pixel. Default: from GPS and altitude where the photos have them.
    camera:
        YAML with width_px, height_px and focal_px, where EXIF lacks or errs; `hairline calibrate` writes one.
    control:
        YAML with targets or scale_bars, and the marks or tags that photos show them by: they fix the mosaic's
        scale and place, or judge it. stitch.json has the residuals in mm.
    """
    from artifacts import store
    from flows.results import write_mosaic
    from schemas.photo import Photo
    from schemas.settings import StitchSettings
    from tasks.photos.task import features, ingest
    from tasks.stitching.task import stitch as stitch_photos

    lens = read_camera(camera) if camera else None
    known = read_control(control) if control else None
    name = folder.resolve().name

    def ingested(path: Path) -> Photo:
        return ingest.bare(store.current().put(path), path.name, name, lens, None, 5.0)

    with working(out):
        photos, left_out = one_by_one(photos_in(folder), ingested)
        settings = StitchSettings(gsd_mm_px=gsd_mm_px)
        described = tuple(features.bare(photo, settings) for photo in photos)
        mosaic = stitch_photos.bare(name, None, tuple(photos), described, settings, known)
        mosaic = mosaic.model_copy(update={"left_out": (*left_out, *mosaic.left_out)})
        write_mosaic(out, mosaic, copy=True)
    counts = {s: sum(p.status == s for p in mosaic.placements) for s in ("solved", "placed", "rejected")}
    say(", ".join(f"{count} {status}" for status, count in counts.items()) + f": {out / 'mosaic.tif'}")
    say(mosaic.gauge)
    warn(mosaic.left_out)
    _warn_of_assumed(photos)


def _warn_of_assumed(photos: "list[Photo]") -> None:
    assumed = [photo.name for photo in photos if photo.camera_from.startswith("assumed")]
    if assumed:
        names = ", ".join(assumed[:5]) + (f" and {len(assumed) - 5} more" if len(assumed) > 5 else "")
        text = (
            f"Warning: no focal length is stated in {names}: 1.2 × the longer side is assumed, and adjusted"
            " where photos are tilted. State it: a file with width_px, height_px and focal_px (or focal_mm"
            " and sensor_width_mm) as --camera; hairline calibrate makes one from photos of a chessboard"
        )
        err.print(f"[yellow]{plain(text)}[/yellow]")


@app.command
def detect(
    images: Path,
    *,
    out: OutFolder,
    method: Method = "hairline",
    gsd_mm_px: Gsd = None,
    global_threshold: int | None = None,
    model: Path | None = None,
    min_score: float = 0.5,
) -> None:
    """Find and measure cracks in images as they are: D/NAME.mask.png (0/255) per image, D/cracks.json.

    Parameters
    ----------
    images:
        An image or a folder of images: JPEG, PNG, BMP, TIFF; mosaics as TIFF, tiled, of any size.
    out:
        Folder to write to.
    method:
        hairline: Hairline's own network. ridge: dark lines on a flattened surface, without any training.
        paper: the paper's method, step by step. global: one threshold for the whole image. onnx: a network
        of yours.
    gsd_mm_px:
        Ground sample distance, mm per pixel; without it results are in pixels only, but of a GeoTIFF, which
        tells it.
    global_threshold:
        Grey level of `global`, 1 to 254. Default: from the histogram's peaks.
    model:
        ONNX file of `onnx`: (1, 3, H, W) RGB in 0..1 to (1, 1, H, W) logits.
    min_score:
        Least probability, 0 to 1, that what a network found is a crack. A lower one finds more and errs more.
    """
    from artifacts.run_folder import lay_out, safe_name
    from flows.results import write_json
    from schemas.settings import AssessSettings, DetectSettings
    from tasks.assessment.task import assess

    if (method == "onnx") != (model is not None):
        raise BadInput("--model", "goes with --method onnx, and only with it", "Give both or neither")
    if model is not None:
        refuse_unless_file(model)
    settings = of_options(
        DetectSettings,
        method=method,
        global_threshold=global_threshold,
        model=model.name if model else None,
        min_score=min_score,
    )
    seen: list[Detected] = []
    problems: list[BadInput] = []
    masks, first = set[str](), dict[str, str]()
    paths = photos_in(images, mosaics=True)
    with working(out) as progress:
        for number, path in enumerate(paths, start=1):
            try:
                seen.append(detected(path, settings, gsd_mm_px, model, first))
                name = path.stem if [p.stem for p in paths].count(path.stem) == 1 else path.name
                lay_out(out, {f"{name}.mask.png": seen[-1].detection.mask}, copy=True)
                masks.add(safe_name(f"{name}.mask.png"))
            except BadInput as problem:
                problems.append(problem)
            progress(number / len(paths))
        if not seen:
            raise problems[0]
        left_out = tuple(LeftOut.because("detection", problem) for problem in problems)
        report = assess.bare(
            images.resolve().name,
            method,
            tuple(one.mosaic for one in seen),
            tuple(one.measurement for one in seen),
            tuple(one.patterns for one in seen),
            (),
            left_out,
            AssessSettings(),
        )
        _remove_earlier_masks(out, masks)
        write_json(out / "cracks.json", report)
    say(f"{len(report.cracks)} cracks in {len(seen)} images: {out / 'cracks.json'}")
    warn(left_out)


def _remove_earlier_masks(out: Path, masks: set[str]) -> None:
    """Those that the cracks.json of an earlier run names, and this run has not written."""
    from artifacts.run_folder import safe_name
    from schemas.crack_report import CrackReport
    from schemas.detection import DRAWN

    try:
        earlier = CrackReport.model_validate_json((out / "cracks.json").read_bytes())
    except (OSError, ValueError):  # none, or not ours
        return
    if earlier.method == DRAWN:  # of `hairline measure`: the masks are the user's
        return
    for one in earlier.surfaces:
        for name in {one.name, PurePath(one.name).stem}:
            mask = out / safe_name(f"{name}.mask.png")
            if mask.name not in masks:
                mask.unlink(missing_ok=True)


@dataclass(frozen=True)
class Detected:
    mosaic: "Mosaic"
    patterns: "Patterns"
    detection: "Detection"
    measurement: "Measurement"


def detected(
    path: Path,
    settings: "DetectSettings",
    gsd_mm_px: float | None,
    model: Path | None = None,
    first: dict[str, str] | None = None,
) -> Detected:
    """One image, seen through to its cracks. first: photos whose cracks are counted already, as
    `fit_alone` has them."""
    from artifacts import store
    from schemas.settings import PatternSettings
    from tasks.detection.task import detect as detect_cracks
    from tasks.measurement.task import measure as measure_cracks
    from tasks.patterns.task import remove_patterns
    from tasks.photos.task import fit_alone, ingest, is_mosaic
    from tasks.stitching.task import given_mosaic, single

    file = store.current().put(path)
    if is_mosaic(file):
        mosaic = given_mosaic(file, path.name, gsd_mm_px)
    else:
        photo = ingest.bare(file, path.name, path.stem, None, None, 5.0)
        (fit,) = fit_alone([photo], first)
        if isinstance(fit, BadInput):
            raise fit
        mosaic = single.bare(photo, gsd_mm_px)
    patterns = remove_patterns.bare(mosaic, PatternSettings())
    network = store.current().put(model) if model else None
    detection = detect_cracks.bare(mosaic, patterns, settings, network)
    return Detected(mosaic, patterns, detection, measure_cracks.bare(mosaic, patterns, detection, settings))


@app.command
def measure(image: Path, mask: Path, *, out: OutFolder, gsd_mm_px: Gsd = None) -> None:
    """Measure the cracks that a mask marks in an image: D/cracks.json.

    Parameters
    ----------
    image:
        JPEG, PNG, BMP or TIFF.
    mask:
        Image of the same size, not 0 where there is a crack.
    out:
        Folder to write to.
    gsd_mm_px:
        Ground sample distance, mm per pixel; without it results are in pixels only.
    """
    from artifacts import store
    from flows.results import write_json
    from schemas.detection import DRAWN
    from schemas.settings import AssessSettings, DetectSettings, PatternSettings
    from tasks.assessment.task import assess
    from tasks.detection.task import given_mask
    from tasks.measurement.task import measure as measure_cracks
    from tasks.patterns.task import remove_patterns
    from tasks.photos.task import ingest
    from tasks.stitching.task import single

    with working(out):
        for path in (image, mask):
            refuse_unless_file(path)
        photo = ingest.bare(store.current().put(image), image.name, image.stem, None, None, 5.0)
        mosaic = single.bare(photo, gsd_mm_px)
        patterns = remove_patterns.bare(mosaic, PatternSettings(remove=False))
        detection = given_mask(mosaic, store.current().put(mask), mask.name)
        measured = measure_cracks.bare(mosaic, patterns, detection, DetectSettings())
        report = assess.bare(image.name, DRAWN, (mosaic,), (measured,), (patterns,), (), (), AssessSettings())
        write_json(out / "cracks.json", report)
    say(f"{len(report.cracks)} cracks: {out / 'cracks.json'}")
