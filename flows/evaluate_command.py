"""`hairline evaluate`: how well each method's cracks agree with masks that people drew."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import numpy.typing as npt
from cyclopts import Parameter
from rich.table import Table

from flows.command_line import app
from flows.console import out as console
from flows.photo_commands import Method
from flows.plain_files import OutFolder, photos_in, warn, working
from schemas.evaluation import Evaluation
from schemas.problem import BadInput, LeftOut
from schemas.settings import DetectSettings

Mask = npt.NDArray[np.bool_]
ALL = {
    "hairline": DetectSettings(method="hairline"),
    "ridge": DetectSettings(method="ridge"),
    "paper": DetectSettings(method="paper"),
    "global 125": DetectSettings(method="global", global_threshold=125),
    "global 155": DetectSettings(method="global", global_threshold=155),
}


@app.command
def evaluate(
    images: Path,
    masks: Path,
    *,
    out: OutFolder,
    method: Annotated[tuple[Method, ...], Parameter(consume_multiple=True)] = (),
    gsd_mm_px: float | None = None,
) -> None:
    """Compare found cracks with drawn masks: precision, recall, F1 at 0, 2 and 5 px, D/evaluation.json.

    Parameters
    ----------
    images:
        Folder of images.
    masks:
        Folder of masks with the same names (any image suffix), not 0 where there is a crack.
    out:
        Folder to write to.
    method:
        Methods to compare. Default: hairline, ridge, paper, and global at the paper's thresholds 125 and 155.
    gsd_mm_px:
        Ground sample distance, mm per pixel, where it is known.
    """
    from flows.results import write_json

    if "onnx" in method:
        raise BadInput("--method onnx", "has no network to try", "Compare its masks: hairline detect --model")
    chosen: dict[str, DetectSettings] = {name: DetectSettings(method=name) for name in method}
    methods = chosen or ALL
    with working(out) as progress:
        evaluations, left_out = compare(images, masks, methods, gsd_mm_px, progress)
        write_json(
            out / "evaluation.json",
            {
                "images": evaluations[0].images,
                "results": [one.model_dump(mode="json") for one in evaluations],
                "left_out": [one.model_dump(mode="json") for one in left_out],
            },
        )
    console.print(as_table(evaluations))
    console.print(f"{evaluations[0].images} images: {out / 'evaluation.json'}")
    warn(left_out)


def compare(
    images: Path,
    masks: Path,
    methods: dict[str, DetectSettings],
    gsd_mm_px: float | None,
    progress: Callable[[float], None],
) -> tuple[list[Evaluation], list[LeftOut]]:
    """An Evaluation for each method and tolerance, and the images that could not be used."""
    from tasks.assessment.task import evaluate as evaluate_masks

    drawn = {path.stem: path for path in photos_in(masks)}
    found: dict[str, list[tuple[Mask, Mask]]] = {name: [] for name in methods}
    problems = []
    paths = photos_in(images)
    for number, path in enumerate(paths, start=1):
        try:
            truth = read_mask(drawn, path)
            for name, mask in masks_of(path, methods, gsd_mm_px):
                if mask.shape != truth.shape:
                    raise BadInput(
                        path.name, "and its mask differ in size", "Give the mask of this very image"
                    )
                found[name].append((mask, truth))
        except BadInput as problem:
            problems.append(problem)
        progress(number / len(paths))
    if not any(found.values()):
        raise problems[0]
    evaluations = [one for name, pairs in found.items() for one in evaluate_masks(name, pairs)]
    return evaluations, [LeftOut.because("evaluation", problem) for problem in problems]


def masks_of(
    path: Path, methods: dict[str, DetectSettings], gsd_mm_px: float | None
) -> Iterator[tuple[str, Mask]]:
    """The mask that each method finds in an image."""
    from artifacts import store
    from schemas.settings import PatternSettings
    from tasks.detection.task import detect
    from tasks.patterns.task import remove_patterns
    from tasks.photos.task import ingest
    from tasks.stitching.task import single

    photo = ingest.bare(store.current().put(path), path.name, path.stem, None, None, 5.0)
    mosaic = single.bare(photo, gsd_mm_px)
    patterns = remove_patterns.bare(mosaic, PatternSettings())
    for name, settings in methods.items():
        detection = detect.bare(mosaic, patterns, settings)
        mask = cv2.imread(str(store.current().path(detection.mask)), cv2.IMREAD_GRAYSCALE)
        yield name, np.asarray(mask) > 0


def read_mask(drawn: dict[str, Path], image: Path) -> Mask:
    if image.stem not in drawn:
        raise BadInput(image.name, "has no mask of the same name", "Add it to the folder of masks")
    mask = cv2.imread(str(drawn[image.stem]), cv2.IMREAD_GRAYSCALE)
    if mask is None:
        raise BadInput(drawn[image.stem].name, "is no image", "Give the mask as PNG")
    return np.asarray(mask) > 0


def as_table(evaluations: list[Evaluation]) -> Table:
    table = Table(
        "method", "tolerance", "precision", "recall", "F1", "95 %", "mean F1", "length found", "true"
    )
    for one in evaluations:
        whole, (low, high) = one.aggregate, one.f1_interval
        table.add_row(
            one.method,
            f"{one.tolerance_px} px",
            *(f"{figure:.3f}" for figure in (whole.precision, whole.recall, whole.f1)),
            f"{low:.2f}–{high:.2f}",
            *(f"{figure:.3f}" for figure in (one.mean.f1, one.length.recall, one.length.precision)),
        )
    return table
