"""An axis-aligned box of the world."""

from typing import Self

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from schemas.contract import Contract, Vector3


class Box(Contract):
    """From low_m to high_m, east north up, metres."""

    low_m: Vector3
    high_m: Vector3

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        if not all(low < high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError("low_m must be below high_m along each axis")
        return self

    def contains(self, places_m: npt.ArrayLike, grown_m: float = 0.0) -> npt.NDArray[np.bool_]:
        """(...,) whether each of (..., 3) places lies in the box grown by `grown_m` on every side."""
        places = np.asarray(places_m, dtype=float)
        low, high = np.asarray(self.low_m) - grown_m, np.asarray(self.high_m) + grown_m
        return np.asarray(np.all((places >= low) & (places <= high), axis=-1))
