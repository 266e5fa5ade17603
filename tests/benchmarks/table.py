"""A row of a benchmark's table, as DESIGN.md has it."""

from typing import Any

Row = dict[str, Any]


def row(
    what: str,
    value: float,
    unit: str,
    bar: str | None,
    data: str,
    seed: str | None,
    peer: str | None = None,
    peer_value: float | None = None,
) -> Row:
    """A bar is such as "≤ 3"."""
    holds = None
    if bar is not None:
        sign, limit = bar.split()
        holds = value <= float(limit) if sign == "≤" else value >= float(limit)
    named = {"peer": peer, "peer_value": None if peer_value is None else round(peer_value, 3)}
    return (
        {"what": what, "value": round(value, 3), "unit": unit, "bar": bar, "holds": holds}
        | named
        | {
            "data": data,
            "seed": seed,
        }
    )
