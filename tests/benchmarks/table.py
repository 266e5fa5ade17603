"""The table of a benchmark, as DESIGN.md has it: its rows, and the file that keeps them."""

import argparse
import json
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from flows.console import out

Row = dict[str, Any]
MARKS = {True: "holds", False: "MISSED", None: ""}


def row(
    what: str,
    value: float | None,
    unit: str,
    bar: str | None,
    data: str | None,
    seed: str | None,
    peer: str | None = None,
    peer_value: float | None = None,
) -> Row:
    """A bar is such as "≤ 3" or "≥ 0.8 and ≤ 1.2"; a value of None was not measured."""
    return {
        "what": what,
        "value": _rounded(value),
        "unit": unit,
        "bar": bar,
        "holds": None
        if bar is None or value is None
        else all(_holds(value, one) for one in bar.split(" and ")),
        "peer": peer,
        "peer_value": _rounded(peer_value),
        "data": data,
        "seed": seed,
    }


def absent(what: str, peer: str, problem: object) -> Row:
    """The row of a peer that is not here."""
    return row(what, None, "", None, f"not measured: {problem}", None, peer)


def cpu_s(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of a call, and its result."""
    began = time.process_time()
    result = call()
    return time.process_time() - began, result


def gather(name: str, parts: Mapping[str, Callable[[], Iterable[Row]]]) -> None:
    """Measure all parts, or those that --parts names, tell each row and keep it in build/bench/NAME.json at
    once; rows of other parts that were measured before stay."""
    asked = argparse.ArgumentParser()
    asked.add_argument("--parts", nargs="*", choices=parts, default=list(parts))
    chosen = asked.parse_args().parts
    path = Path("build/bench") / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    before = json.loads(path.read_text()) if path.is_file() else []
    table = [one for one in before if one.get("part") in parts and one["part"] not in chosen]
    for part in chosen:
        for one in parts[part]():
            table.append({"part": part} | one)
            tell(one)
            keep(path, table)
    out.print(f"\n{path}")


def keep(path: Path, table: list[Row]) -> None:
    path.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")


def tell(one: Row) -> None:
    value = "–" if one["value"] is None else f"{one['value']:g}"
    peer = f"  {one['peer']}: {one['peer_value']}" if one["peer"] else ""
    judged = f"{one['bar'] or ''} {MARKS[one['holds']]}"
    text = f"{one['what']}: {value} {one['unit']}  {judged}{peer}  [{one['data']}]"
    out.print(text, markup=False, soft_wrap=True)


def _holds(value: float, bar: str) -> bool:
    sign, limit = bar.split()
    return value <= float(limit) if sign == "≤" else value >= float(limit)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 3)
