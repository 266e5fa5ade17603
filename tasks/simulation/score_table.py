"""A score as text for a terminal."""

from schemas.simulation import CrackScore, Score
from tasks.simulation.score import FALSE_BAR_PER_5_M2, FOUND_SHARE, length_holds, width_holds

CLASSES = ((3.0, "≥ 3 px"), (2.0, "2–3 px"), (1.0, "1–2 px"), (0.0, "< 1 px"))


def score_table(score: Score) -> str:
    """One row a planted crack, widest first, then the counts that the bars are about."""
    rows = [
        f"{'crack':<14}{'surface':<14}{'width':>7}{'found':>7}{'width mm':>16}{'error px':>10}"
        f"{'length mm':>16}{'error':>8}"
    ]
    for crack in sorted(score.cracks, key=lambda c: -c.width_px):
        rows.append(_row(crack))
    rows.append("")
    for low, words in CLASSES:
        high = next((c[0] for c in reversed(CLASSES) if c[0] > low), float("inf"))
        group = [c for c in score.cracks if low <= c.width_px < high]
        if group:
            found = [c for c in group if c.found >= FOUND_SHARE]
            widths, lengths = sum(map(width_holds, found)), sum(map(length_holds, found))
            rows.append(
                f"cracks {words} wide: {len(found)} of {len(group)} found; within the bars: "
                f"{widths} widths, {lengths} lengths"
            )
    near: list[str] = [f.near for f in score.false_cracks]
    kinds = ", ".join(f"{near.count(k)} {w}" for k, w in _NEAR.items() if near.count(k))
    rows.append(
        f"false cracks: {len(near)} on {score.inspected_m2:.1f} m², {score.false_per_5_m2:.2f} per 5 m²"
        f" (bar {FALSE_BAR_PER_5_M2:g})" + (f": {kinds}" if kinds else "")
    )
    fits = (f"{f.surface} {1e3 * f.shift_m:.0f} mm, {100 * (f.scale - 1):+.1f} %" for f in score.fits)
    rows.append("frames apart: " + "; ".join(fits))
    rows.append(
        "every bar holds (cracks ≥ 3 px wide)" if score.holds else "NOT every bar holds (!: beyond it)"
    )
    return "\n".join(rows)


_NEAR = {"marker": "on markers", "crack": "beside a crack", "nothing": "elsewhere"}


def _row(crack: CrackScore) -> str:
    width = length = width_error = length_error = "–"
    if crack.width_mm is not None:
        width = f"{crack.width_mm:.2f} / {crack.width_true_mm:.2f}"
    if crack.found > 0:
        length = f"{crack.length_mm:.0f} / {crack.length_true_mm:.0f}"
    if crack.width_error_px is not None:
        width_error = f"{crack.width_error_px:+.2f}" + ("!" if not width_holds(crack) else " ")
    if crack.length_error is not None:
        length_error = f"{100 * crack.length_error:+.0f} %" + ("!" if not length_holds(crack) else " ")
    return (
        f"{crack.id:<14}{crack.surface:<14}{crack.width_px:>7.1f}{100 * crack.found:>5.0f} %{width:>16}"
        f"{width_error:>10}{length:>16}{length_error:>8}"
    )
