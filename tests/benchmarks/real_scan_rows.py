"""Rows of `make bench-scans` on real scans: two pairs beside other programs, and files of every format."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tasks.registration.read_scan import read_scan
from tasks.registration.rigid_motion import Array, angle_deg, inverse
from tests.benchmarks.registration_peers import BLIND, PLAIN, Gicp, apart, multi_scale_icp
from tests.benchmarks.surveys import Survey, registered
from tests.benchmarks.table import Row, row
from tests.development_data import ROOT
from tests.registration.mutated_files import mutated_files, outcome
from tests.registration.site import as_scan

REFERENCE = Gicp(0.1, 1.0)  # gave street_pair its reference pose: to 0.001° and 0.1 mm


def rows() -> Iterator[Row]:
    """All rows, as DESIGN.md's benchmarks have them."""
    yield from _real_pairs()
    yield from _bad_files()


def _real_pairs() -> Iterator[Row]:
    """Ours from nothing; the peers' fine alignments from the true pose itself, the best start there is."""
    folder = ROOT / "scans"
    if not folder.is_dir():
        yield row("real pairs", float("nan"), "mm", None, "not on this machine", None)
        return
    car = (folder / "car_pair/carCloudList.csv").read_text().splitlines()[2].split(",")[1:]
    sets = {
        "car_pair": ("car_cloud400.csv", "car_cloud401.csv", np.array(car, dtype=float).reshape(4, 4)),
        "street_pair": ("target.ply", "source.ply", np.loadtxt(folder / "street_pair/T_target_source.txt")),
    }
    for name, (target, source, truth) in sets.items():
        paths = [folder / name / file for file in (target, source)]
        target_m, source_m = (read_scan(path).points_m for path in paths)
        T = _pair_of_files(paths)
        data = f"real {name}"
        if name == "street_pair":
            data += f"; its reference pose is {REFERENCE.name}'s own answer, which is no judge here"
        ours_mm, ours_deg = 1000 * apart(T, truth, source_m), angle_deg(inverse(truth) @ T)
        theirs = {
            "Open3D multi-scale ICP": multi_scale_icp(source_m, target_m, truth),
            PLAIN.name: PLAIN.pair(source_m, target_m, truth),
            REFERENCE.name: REFERENCE.pair(source_m, target_m, truth),
            **{peer: of_peer(source_m, target_m, 0.5) for peer, of_peer in BLIND.items()},
        }
        errors_mm = {peer: 1000 * apart(T_peer, truth, source_m) for peer, T_peer in theirs.items()}
        judges = {
            peer: e for peer, e in errors_mm.items() if not (name == "street_pair" and peer == REFERENCE.name)
        }
        best = min(judges.values())
        for peer, error_mm in errors_mm.items():
            bar = f"≤ {error_mm:.1f}" if error_mm == best else None
            yield row(f"{name}: points off the true pose", ours_mm, "mm RMS", bar, data, None, peer, error_mm)
        yield row(f"{name}: turn off the true pose", ours_deg, "°", None, data, None)


def _bad_files() -> Iterator[Row]:
    """The formats' own bad files, and a hundred made from good ones by damage."""
    folder = ROOT / "scans/formats"
    if not folder.is_dir():
        yield row("bad files", float("nan"), "files", None, "not on this machine", None)
        return
    files = sorted(p for p in folder.iterdir() if not p.name.startswith("LICENSE"))
    with TemporaryDirectory() as name:
        damaged = list(mutated_files(files, Path(name), 100))
        outcomes = [outcome(path) for path in (*files, *damaged)]
    sound = sum(one in ("read", "refused") for one in outcomes)
    what = f"files read or refused in one clear message ({outcomes.count('read')} read)"
    bar = f"≥ {len(outcomes)}"
    yield row(what, sound, f"of {len(outcomes)}", bar, "scans/formats, and 100 damaged", "1..100")


def _pair_of_files(paths: Sequence[Path]) -> Array:
    """T_target_source of two files, the target first, of which nothing is known."""
    found, _, _ = registered(Survey(tuple(as_scan(path) for path in paths), {}, {}))
    target, source = (np.array(s.T_world_scan) for s in found.stations)
    return np.asarray(inverse(target) @ source)
