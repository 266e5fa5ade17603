"""`hairline evaluate`: how well each method's cracks agree with masks that people drew."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from cyclopts import Parameter
from rich.table import Table

from flows.command_line import app
from flows.console import err
from flows.console import out as console
from flows.option_types import Gsd
from flows.photo_commands import Method
from flows.plain_files import OutFolder, photos_in, warn, working
from schemas.detection import Patterns
from schemas.evaluation import Curves, Evaluation, Levels, Tally
from schemas.mosaic import Mosaic
from schemas.problem import BadInput, LeftOut
from schemas.settings import DetectSettings

Mask = npt.NDArray[np.bool_]

TOLERANCE_PX = 2  # of the curves, and of what is worst
WORST = 8  # images shown
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
    gsd_mm_px: Gsd = None,
) -> None:
    """Compare found cracks with drawn masks: precision, recall, F1 at 0, 2 and 5 px, D/evaluation.json;
    D/curves.png with precision, recall and calibration of the network; D/worst/ with the worst images, what
    was found right in green, falsely in red, and missed in blue.

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
    from flows.results import write_evaluation

    if "onnx" in method:
        raise BadInput("--method onnx", "has no network to try", "Compare its masks: hairline detect --model")
    chosen: dict[str, DetectSettings] = {name: DetectSettings(method=name) for name in method}
    methods = chosen or ALL
    with working(out) as progress:
        result = compare(images, masks, methods, gsd_mm_px, progress)
        write_evaluation(out, result.evaluations, result.curves, result.left_out)
        write_worst(out / "worst", result.worst)
    console.print(as_table(result.evaluations))
    console.print(f"{result.evaluations[0].images} images: {out / 'evaluation.json'}, {out / 'worst'}")
    warn(result.left_out)
    if not result.drawn_px:
        text = f"Warning: no mask in {masks} marks any crack: precision, recall and F1 say nothing"
        err.print(text, style="yellow", markup=False)


class Judged(NamedTuple):
    """An image as the first method did on it."""

    path: Path
    truth: Mask
    found: Mask
    f1: float


class Comparison(NamedTuple):
    evaluations: list[Evaluation]  # of each method and tolerance
    curves: Curves | None  # where the network is one of the methods
    worst: list[Judged]
    left_out: list[LeftOut]  # images that could not be used
    drawn_px: int  # that the masks mark as crack, in all


def compare(
    images: Path,
    masks: Path,
    methods: dict[str, DetectSettings],
    gsd_mm_px: float | None,
    progress: Callable[[float], None],
) -> Comparison:
    """Every method on every image, of which only counts are kept, and the worst few."""
    from tasks.assessment.task import curves, f1_of, levels, tally
    from tasks.assessment.task import evaluate as evaluate_tallies
    from tasks.detection.task import crack_probability

    drawn = {path.stem: path for path in photos_in(masks)}
    tallies: dict[str, list[Tally]] = {name: [] for name in methods}
    worst: list[Judged] = []
    of_all: Levels | None = None
    drawn_px = 0
    problems = []
    paths = photos_in(images)
    for number, path in enumerate(paths, start=1):
        try:
            truth = drawn_for(drawn, path)
            mosaic, patterns = prepared(path, gsd_mm_px, truth.shape)
            of_methods = {name: mask_of(mosaic, patterns, settings) for name, settings in methods.items()}
            if "hairline" in methods:
                seen = levels(crack_probability(mosaic, patterns), truth, TOLERANCE_PX)
                of_all = seen if of_all is None else of_all + seen
            for name, mask in of_methods.items():
                tallies[name].append(tally(mask, truth))
            first = next(iter(methods))
            judged = Judged(path, truth, of_methods[first], f1_of(tallies[first][-1], TOLERANCE_PX))
            drawn_px += int(truth.sum())
            worst = sorted([*worst, judged], key=lambda one: one.f1)[:WORST]
        except BadInput as problem:
            problems.append(problem)
        progress(number / len(paths))
    if not worst:
        raise problems[0]
    return Comparison(
        [one for name, images_of in tallies.items() for one in evaluate_tallies(name, images_of)],
        None if of_all is None else curves(of_all, TOLERANCE_PX),
        worst,
        [LeftOut.because("evaluation", problem) for problem in problems],
        drawn_px,
    )


def prepared(path: Path, gsd_mm_px: float | None, shape: tuple[int, ...]) -> tuple[Mosaic, Patterns]:
    """One image as the stages take it."""
    from artifacts import store
    from schemas.settings import PatternSettings
    from tasks.patterns.task import remove_patterns
    from tasks.photos.task import ingest
    from tasks.stitching.task import single

    photo = ingest.bare(store.current().put(path), path.name, path.stem, None, None, 5.0)
    mosaic = single.bare(photo, gsd_mm_px)
    if (mosaic.height_px, mosaic.width_px) != shape:
        sizes = f"{mosaic.width_px}×{mosaic.height_px} px, its mask {shape[1]}×{shape[0]}"
        raise BadInput(path.name, f"is {sizes}", "Give the mask of this very image")
    return mosaic, remove_patterns.bare(mosaic, PatternSettings())


def mask_of(mosaic: Mosaic, patterns: Patterns, settings: DetectSettings) -> Mask:
    from artifacts import store
    from artifacts.mask_png import read_mask
    from tasks.detection.task import detect

    path = store.current().path(detect.bare(mosaic, patterns, settings).mask)
    return read_mask(path, mosaic.name).whole()


def drawn_for(drawn: dict[str, Path], image: Path) -> Mask:
    if image.stem not in drawn:
        raise BadInput(image.name, "has no mask of the same name", "Add it to the folder of masks")
    from artifacts.raster import read_drawn_mask

    return read_drawn_mask(drawn[image.stem], drawn[image.stem].name)


def as_table(evaluations: list[Evaluation]) -> Table:
    headings = "method", "within", "precision", "recall", "F1", "95 %", "mean\nF1", "length\nfound", "true"
    table = Table(*headings, box=None, pad_edge=False)  # fits the 80 columns of a pipe
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


def write_worst(folder: Path, worst: list[Judged]) -> None:
    from artifacts.evaluation_pictures import side_by_side
    from tasks.assessment.task import near

    folder.mkdir(parents=True, exist_ok=True)
    for number, one in enumerate(worst, start=1):
        rgb = np.asarray(cv2.imread(str(one.path), cv2.IMREAD_COLOR), dtype=np.uint8)[..., ::-1]
        close = near(one.truth, TOLERANCE_PX), near(one.found, TOLERANCE_PX)
        picture = side_by_side(rgb, one.truth, one.found, *close)
        name = f"{number}-F1-{one.f1:.2f}-{one.path.stem}.jpg"
        cv2.imwrite(str(folder / name), np.ascontiguousarray(picture[..., ::-1]))
