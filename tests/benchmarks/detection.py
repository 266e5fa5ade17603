"""`make bench-detection`: F1 of each method on the development sets, beside the paper's own method.

Both sets are real; their scale is unknown. A set that is not on this machine is a row that says so.
"""

import json
from pathlib import Path

from artifacts import store
from flows.console import out
from flows.evaluate_command import ALL, as_table, compare
from tests.development_data import ROOT

SETS = ("cracks/uav", "cracks/deepcrack_train")


def main() -> None:
    rows = []
    for name in SETS:
        if not (ROOT / name).is_dir():
            rows.append({"what": f"F1 on {name}", "value": None, "data": "not on this machine"})
            continue
        with store.temporary():
            evaluations, _ = compare(ROOT / name / "images", ROOT / name / "masks", ALL, None, lambda _: None)
        out.print(f"\n{name}, {evaluations[0].images} images")
        out.print(as_table(evaluations))
        peer = {one.tolerance_px: one.aggregate.f1 for one in evaluations if one.method == "paper"}
        rows += [
            {
                "what": f"F1 of {one.method} at {one.tolerance_px} px, aggregate",
                "value": round(one.aggregate.f1, 3),
                "unit": "1",
                "bar": None,
                "holds": None,
                "peer": "paper",
                "peer_value": round(peer[one.tolerance_px], 3),
                "data": name,
                "seed": None,
            }
            for one in evaluations
        ]
    path = Path("build/bench/detection.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows, indent=1) + "\n")
    out.print(f"\n{path}")


if __name__ == "__main__":
    main()
