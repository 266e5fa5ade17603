"""Colours that mean something, the same in every picture, table and graph."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

SEVERITIES = ("wide", "medium", "fine", "hairline")  # worst first
SEVERITY: Mapping[str | None, str] = {
    "wide": "#c1121f",
    "medium": "#e8590c",
    "fine": "#d99a00",
    "hairline": "#2b7fb8",
    None: "#a61e8c",  # no scale, so no severity
}
INK = "#1d2733"
FAINT = "#8a96a3"
ACCENT = "#0b5d7a"
PLANNED = "#1971c2"
FLOWN = "#7a1fa2"
SHOT = "#12304a"
GROUND = "#d8d2c4"
OBSTACLE = "#9a8f86"
NOT_INSPECTED = "#eceff2"
_SERIES = ("#4c78a8", "#f2a541", "#54a37a", "#c65d57", "#8a6bb1", "#4aa8b5", "#b5883f", "#d37ba6", "#7d8f2e")


def series(index: int) -> str:
    """Colours that differ from their neighbours, for stations and surfaces."""
    return _SERIES[index % len(_SERIES)]


def rgb(colour: str) -> npt.NDArray[np.uint8]:
    """(3,) of "#rrggbb"."""
    return np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)


def pale(colour: str) -> str:
    """Half way to white: a ground for what is drawn over it."""
    return "#" + "".join(f"{(int(channel) + 255) // 2:02x}" for channel in rgb(colour))
