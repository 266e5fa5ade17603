"""Stage: find the cracks of a mosaic."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from artifacts import store
from artifacts.mask_png import write_mask
from artifacts.page import Page, page_key
from artifacts.picture import mask_markdown
from artifacts.raster import MosaicRaster, read_drawn_mask
from schemas.bit_mask import BitMask
from schemas.detection import DRAWN, Detection, Patterns
from schemas.file import File
from schemas.mosaic import Mosaic
from schemas.problem import BadInput
from schemas.settings import DetectSettings
from tasks.stage import progress, stage


def pages(inputs: Mapping[str, Any], detection: Detection) -> list[Page]:
    mosaic: Mosaic = inputs["mosaic"]
    masks = [(detection.method, detection.mask), *detection.baselines]
    pictures = [f"**{name}**\n\n{mask_markdown(mosaic, mask, (255, 0, 0))}" for name, mask in masks]
    title = f"### Cracks of {mosaic.name}: {detection.crack_px} of {detection.inspected_px} px"
    return [Page(key=page_key("detection", mosaic.name), markdown="\n\n".join([title, *pictures]))]


@stage(pages=pages)
def detect(
    mosaic: Mosaic, patterns: Patterns, settings: DetectSettings, model: File | None = None
) -> Detection:
    """Crack pixels by the settings' method; with `baselines` the paper's global thresholds as well.

    model: the network's file where the method is `onnx`.
    The paper's own method looks at all of the image, markers included, and takes them out by t1 and t2."""
    from tasks.detection.detect import baselines, detect_raster
    from tasks.detection.network import Model

    files = store.current()
    taken_out = None if settings.method == "paper" else files.path(patterns.mask)
    image, coverage = files.path(mosaic.image), files.path(mosaic.coverage)
    with MosaicRaster(image, coverage, mosaic.name, taken_out) as raster, files.scratch() as folder:
        guest = Model(files.path(model).read_bytes(), settings.model or "model") if model else None
        found = detect_raster(raster, settings, mosaic.gsd_mm_px, patterns, progress, guest)
        write_mask(found.bits, folder / "cracks.png")
        mask = files.put(folder / "cracks.png")
        beside = []
        for n, (name, baseline) in enumerate(baselines(raster, patterns) if settings.baselines else ()):
            write_mask(baseline, folder / f"baseline-{n}.png")
            beside.append((name, files.put(folder / f"baseline-{n}.png")))
    return Detection(
        mask=mask,
        method=settings.method,
        crack_px=found.bits.count(),
        inspected_px=found.inspected_px,
        rejected=(
            *((joint.position_px, _reason(joint.length_px, mosaic)) for joint in found.joints),
            *((position, "a stain or shadow: its edges are soft") for position in found.stains),
            *((one.position_px, f"no crack, most likely: score {one.score:.2f}") for one in found.doubtful),
        ),
        scores=tuple((one.position_px, one.score) for one in found.scores),
        baselines=tuple(beside),
    )


def _reason(length_px: float, mosaic: Mosaic) -> str:
    if mosaic.gsd_mm_px is None:
        return f"a joint: straight over {length_px:.0f} px"
    return f"a joint: straight over {length_px * mosaic.gsd_mm_px / 1000:.2f} m"


def crack_probability(mosaic: Mosaic, patterns: Patterns) -> npt.NDArray[np.uint8]:
    """(H, W) 255 × our network's probability; no stage: only the command line asks for it."""
    from tasks.detection.network import our_model, probability

    files = store.current()
    paths = files.path(mosaic.image), files.path(mosaic.coverage)
    with MosaicRaster(*paths, mosaic.name, files.path(patterns.mask)) as raster:
        return probability(raster, our_model())


def given_mask(mosaic: Mosaic, mask: File, name: str) -> Detection:
    """A mask that somebody drew or another program made, as a detection. Raises BadInput by name."""
    drawn = read_drawn_mask(store.current().path(mask), name)
    if drawn.shape != (mosaic.height_px, mosaic.width_px):
        raise BadInput(
            name,
            f"is {drawn.shape[1]}×{drawn.shape[0]} px but its image {mosaic.width_px}×{mosaic.height_px}",
            "Give the mask of this very image",
        )
    with store.current().scratch() as folder:
        write_mask(BitMask.of(drawn), folder / "cracks.png")
        entered = store.current().put(folder / "cracks.png")
    return Detection(mask=entered, method=DRAWN, crack_px=int(drawn.sum()), inspected_px=int(drawn.size))
