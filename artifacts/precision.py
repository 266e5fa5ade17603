"""Numbers as an engineer writes them: never more digits than the uncertainty warrants."""

import math

FINEST_MM = 0.1  # a photo of a structure promises no more, unless its stated uncertainty does
FINEST_STATED_MM = 0.01


def millimetres(value_mm: float | None, sigma_mm: float | None = None, at_most: bool = False) -> str:
    """A length or width, "1.3 ± 0.1" or "≤ 0.4": σ to one digit (two where it begins with 1), and the
    value to the same place, 0.1 mm at the finest; 0.01 mm where σ is below that. "–" for None."""
    if value_mm is None:
        return "–"
    if sigma_mm is None or sigma_mm <= 0:
        return f"≤ {_up(value_mm, -1):.1f}" if at_most else f"{value_mm:.1f}"
    place = _last_place(sigma_mm)
    decimals = max(0, -place)
    if at_most:
        return f"≤ {_up(value_mm, place):.{decimals}f}"
    value = f"{_rounded(value_mm, place):.{decimals}f}"
    return f"{value} ± {_rounded(max(sigma_mm, 10.0**place), place):.{decimals}f}"


def _last_place(sigma_mm: float) -> int:
    """Power of ten of the last digit that is worth stating."""
    place = math.floor(math.log10(sigma_mm))
    if sigma_mm / 10.0**place < 1.95:
        place -= 1
    finest = FINEST_MM if sigma_mm >= FINEST_MM else FINEST_STATED_MM
    return max(place, round(math.log10(finest)))


def _rounded(value: float, place: int) -> float:
    return round(value, -place)


def _up(value: float, place: int) -> float:
    """An upper bound stays one."""
    return math.ceil(round(value / 10.0**place, 6)) * 10.0**place


def number(value: float | None, decimals: int = 1) -> str:
    """ "–" for None, a true minus sign, and never a minus zero."""
    return "–" if value is None else f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")


def area_m2(value: float | None) -> str:
    """Three digits are plenty for an area."""
    if value is None:
        return "–"
    return f"{value:.2f}" if value < 10 else f"{value:.1f}" if value < 100 else f"{value:.0f}"
