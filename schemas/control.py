"""Control of a mosaic: marks that photos show, their surveyed places, and lengths between them."""

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from schemas.contract import Contract, Vector2

TagFamily = Literal[
    "4X4_50",
    "4X4_100",
    "4X4_250",
    "4X4_1000",
    "5X5_50",
    "5X5_100",
    "5X5_250",
    "5X5_1000",
    "6X6_50",
    "6X6_100",
    "6X6_250",
    "6X6_1000",
    "7X7_50",
    "7X7_100",
    "7X7_250",
    "7X7_1000",
    "ARUCO_ORIGINAL",
    "ARUCO_MIP_36H12",
    "APRILTAG_16H5",
    "APRILTAG_25H9",
    "APRILTAG_36H10",
    "APRILTAG_36H11",
]


class PlaneTarget(Contract):
    """A mark whose place on the surface was surveyed."""

    mark: str
    uv_m: Vector2  # u to the right, v up, seen from the side that is photographed
    check: bool = False  # True: it judges the mosaic and is never fitted to


class ScaleBar(Contract):
    """Two marks a known length apart."""

    ends: tuple[str, str]
    length_mm: float = Field(gt=0)
    check: bool = False

    @property
    def name(self) -> str:
        return " – ".join(self.ends)


class Control(Contract):
    """What fixes a mosaic's scale, place and turn, and what judges it."""

    tags: TagFamily | None = None  # printed tags to look for; a tag's centre is a mark, its id the name
    marks: dict[str, dict[str, Vector2]] = Field(
        default_factory=dict
    )  # {mark: {photo: [x, y]}}: pixels of the photo shown upright, the first pixel's centre at [0, 0]
    targets: tuple[PlaneTarget, ...] = ()
    scale_bars: tuple[ScaleBar, ...] = ()

    @model_validator(mode="after")
    def _names_that_mean_something(self) -> Self:
        if not (self.targets or self.scale_bars):
            raise ValueError("give targets or scale_bars: marks alone say nothing of the scale")
        named = [t.mark for t in self.targets] + [end for bar in self.scale_bars for end in bar.ends]
        unknown = sorted(set(named) - set(self.marks))
        if unknown and self.tags is None:
            raise ValueError(
                f"no photo is said to show {', '.join(unknown)}: list it under marks, or give tags"
            )
        places = [t.mark for t in self.targets]
        twice = sorted({mark for mark in places if places.count(mark) > 1})
        if twice:
            raise ValueError(f"{', '.join(twice)} has more than one place")
        if any(a == b for a, b in (bar.ends for bar in self.scale_bars)):
            raise ValueError("a scale bar needs two different marks")
        return self


class ControlResidual(Contract):
    """How the mosaic lies to a target or a scale bar."""

    name: str
    kind: Literal["target", "scale bar"]
    check: bool
    used: bool  # in the fit; False for check points, and for control that contradicts the rest
    photos: int  # that show it; of a bar, the fewer of its ends
    residual_mm: Vector2 | float  # mosaic minus survey: (u, v) of a target, the length of a bar
    spread_mm: float  # how far a photo that shows it lies from the others, at most

    @property
    def length_mm(self) -> float:
        return abs(self.residual_mm) if isinstance(self.residual_mm, float) else math.hypot(*self.residual_mm)
