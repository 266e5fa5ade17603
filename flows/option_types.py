"""Options of commands whose numbers are checked as they are read, and settings made of options."""

from typing import Annotated, TypeVar

from cyclopts import Parameter
from pydantic import BaseModel, ValidationError

from schemas.gsd import LARGEST_MM_PX, SMALLEST_MM_PX
from schemas.problem import BadInput

Model = TypeVar("Model", bound=BaseModel)

NAMED_OTHERWISE = {"free_m": "--free", "surfaces": "--inspect"}  # options of settings with longer names


def _gsd(_: object, mm_px: float | None) -> None:
    if mm_px is not None and not SMALLEST_MM_PX <= mm_px <= LARGEST_MM_PX:  # NaN is not within either
        raise ValueError(f"Give {SMALLEST_MM_PX:g} to {LARGEST_MM_PX:g} mm per pixel.")


def _positive(_: object, value: float | None) -> None:
    if value is not None and not 0 < value < float("inf"):
        raise ValueError("Give a number greater than 0.")


Gsd = Annotated[float | None, Parameter(validator=_gsd)]
Positive = Annotated[float, Parameter(validator=_positive)]
PositiveOrNone = Annotated[float | None, Parameter(validator=_positive)]


def of_options(contract: type[Model], **options: object) -> Model:
    """Settings as a command's options state them. BadInput names the option that cannot be."""
    try:
        return contract.model_validate(options)
    except ValidationError as problem:
        raise bad_option(problem) from None


def bad_option(problem: ValidationError) -> BadInput:
    """An error of settings in the words of the person who typed the option that it comes from."""
    first = problem.errors()[0]
    key = str(first["loc"][0])
    option = NAMED_OTHERWISE.get(key, "--" + key.replace("_", "-"))
    return BadInput(option, f"cannot be {first['input']!r} ({first['msg']})", "Correct it")
