"""The ground sample distance as a person states it, in the bounds of what cameras photograph."""

from typing import Annotated

from pydantic import Field

SMALLEST_MM_PX = 0.001  # a microscope's
LARGEST_MM_PX = 1000.0

GsdMmPx = Annotated[float, Field(ge=SMALLEST_MM_PX, le=LARGEST_MM_PX)]
