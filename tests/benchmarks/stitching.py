"""`make bench-stitching`: errors of mosaics against truth, in photo pixels, beside OpenCV's stitcher, the
`stitching` package and pyOrthomosaic. Small sets by default; ARGS=--full is 30 photos of 8 MP and 5 seeds.

A peer that is not installed is a row that says so."""

import argparse
import json
import resource
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt

from artifacts import store
from flows.console import out
from schemas.mosaic import Mosaic
from schemas.photo import Photo
from schemas.problem import BadInput
from schemas.registered_model import RegisteredModel
from schemas.relief import Relief
from schemas.settings import StitchSettings
from tasks.photos.task import features, ingest
from tasks.stitching.relief import HeightMap
from tasks.stitching.task import stitch
from tasks.surfaces.task import measure_relief
from tests.benchmarks import beach_rows, feature_rows, mosaic_size_rows
from tests.benchmarks.mosaic_truth import errors, heights_of, on_crack, seam_steps_px
from tests.benchmarks.stitchers import NEEDS, PEERS, run_peer
from tests.benchmarks.wall_photos import CASES, Case, WallPhotos, wall_photos

Array = npt.NDArray[np.float64]

BARS = {
    "plane": (0.15, 1.0),
    "k1": (0.3, None),
    "rolling": (0.5, None),
    "rolling-blind": (0.5, None),
    "relief-scan": (1.5, None),
}  # px RMS, px worst
GROWTH_GRIDS = ((6, 5), (10, 9), (20, 15))  # columns and rows
STEP_P95, STEP_WORST = 0.5, 2.0  # px
IN_99 = 9.2103  # d² of two numbers that holds 99 %


@dataclass(frozen=True)
class Run:
    photos: WallPhotos
    mosaic: Mosaic
    refused: dict[str, str]  # before stitching, by name
    cpu_s: float
    steps_px: Array  # across seams
    on_crack: npt.NDArray[np.bool_]  # which of these seam pixels lie on a crack
    heights: HeightMap | None  # that the mosaic lies on


def run(photos: WallPhotos) -> Run:
    began = time.process_time()
    taken: list[Photo] = []
    refused: dict[str, str] = {}
    for path in sorted(photos.folder.glob("*.jpg")):
        try:
            taken.append(
                ingest.bare(
                    store.current().put(path),
                    path.name,
                    "wall",
                    photos.camera,
                    photos.poses[path.name],
                    photos.position_sigma_m,
                    photos.velocities_m_s[path.name],
                )
            )
        except BadInput as problem:
            refused[path.name] = problem.what
    settings = StitchSettings()
    described = tuple(features.bare(photo, settings) for photo in taken)
    surface, relief = photos.face.surface(), _relief(photos)
    mosaic = stitch.bare("wall", surface, tuple(taken), described, settings, None, relief)
    cpu_s = time.process_time() - began
    heights = heights_of(mosaic)
    steps_px, shown = seam_steps_px(mosaic, photos, heights)
    return Run(photos, mosaic, refused, cpu_s, steps_px, on_crack(shown, photos), heights)


def _relief(photos: WallPhotos) -> Relief | None:
    """As the stage measures it in a registered model."""
    if photos.scan_m is None:
        return None
    surface = photos.face.surface()
    points = photos.scan_m.astype("<f4")
    normals = np.tile(np.asarray(surface.plane.normal, "<f4"), (len(points), 1))
    header = "ply\nformat binary_little_endian 1.0\n" + f"element vertex {len(points)}\n"
    header += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "wall.ply"
        path.write_bytes((header + "end_header\n").encode() + np.hstack([points, normals]).tobytes())
        low, high = (tuple(float(x) for x in p) for p in (points.min(axis=0), points.max(axis=0)))
        known: dict[str, Any] = {"cloud": store.current().put(path), "points": len(points)}
        model = RegisteredModel(**known, stations=(), min_m=low, max_m=high)
    (relief,) = measure_relief.bare(model, (surface,))
    return relief


def row(
    what: str, value: float, unit: str, least: float | None = None, most: float | None = None, **known: Any
) -> dict[str, Any]:
    """A line of the table; it holds where the value lies from `least` to `most`."""
    low, high = -np.inf if least is None else least, np.inf if most is None else most
    barred = least is not None or most is not None
    return {
        "what": what,
        "value": round(float(value), 3),
        "unit": unit,
        "bar": " and ".join(f"{s} {b:g}" for s, b in (("≥", least), ("≤", most)) if b is not None) or None,
        "holds": bool(low <= value <= high) if barred else None,
        "peer": None,
        "peer_value": None,
        "data": None,
        "seed": None,
    } | known


def rows_of(case: Case, runs: Sequence[Run], data: str) -> list[dict[str, Any]]:
    """The worst of all seeds."""
    scores = [errors(run.mosaic, run.photos, run.heights) for run in runs]
    known: dict[str, Any] = {"data": data, "seed": f"1..{len(runs)}"}
    rms_bar, worst_bar = BARS.get(case.name, (None, None))
    d2 = np.concatenate([s.d2 for s in scores])
    steps = np.concatenate([run.steps_px for run in runs])
    own = [p.status for run in runs for p in run.mosaic.placements if p.name in run.photos.truth]
    strangers = sum(
        p.status != "rejected" and p.name not in run.photos.truth
        for run in runs
        for p in run.mosaic.placements
    )
    on_cracks = []
    if case.cracks_a_m2:
        torn = np.concatenate([run.steps_px[run.on_crack] for run in runs])
        length_m = sum(one.length_m for run in runs for one in run.photos.cracks)
        met = f"{len(torn)} seam pixels on {length_m:.0f} m of cracks"
        on_cracks = [
            row(
                f"{case.what}: step where a seam meets a crack, P95",
                np.percentile(torn, 95),
                "px",
                most=STEP_P95,
                **known | {"data": f"{data}, {met}"},
            ),
            row(
                f"{case.what}: step where a seam meets a crack, worst",
                torn.max(),
                "px",
                most=STEP_WORST,
                **known | {"data": f"{data}, {met}"},
            ),
            row(f"{case.what}: seam pixels a metre of crack", len(torn) / length_m, "px", **known),
        ]
    return [
        *on_cracks,
        row(f"{case.what}: error", max(s.rms_px for s in scores), "px RMS", most=rms_bar, **known),
        row(f"{case.what}: worst error", max(s.worst_px for s in scores), "px", most=worst_bar, **known),
        row(f"{case.what}: mean d²/2", d2.mean() / 2, "1", least=0.8, most=1.2, **known),
        row(f"{case.what}: inside 99 %", 100 * (d2 < IN_99).mean(), "%", least=97, **known),
        row(f"{case.what}: step across seams, P95", np.percentile(steps, 95), "px", most=STEP_P95, **known),
        row(f"{case.what}: step across seams, worst", steps.max(), "px", most=STEP_WORST, **known),
        row(f"{case.what}: gain error", 100 * max(s.gain for s in scores), "%", most=0.5, **known),
        row(f"{case.what}: lost of {len(own)} photos", own.count("rejected"), "photos", most=0, **known),
        row(f"{case.what}: strangers taken in", strangers, "photos", most=0, **known),
        row(f"{case.what}: CPU time", float(np.mean([run.cpu_s for run in runs])), "s", **known),
    ]


def consistency_rows(d2: Array, data: str) -> list[dict[str, Any]]:
    """Of all cases and seeds together: the photos of one set err alike, so that one set says little."""
    known: dict[str, Any] = {"data": f"{data}, {len(d2)} photos of all cases"}
    return [
        row("all cases: mean d²/2", d2.mean() / 2, "1", least=0.8, most=1.2, **known),
        row("all cases: inside 99 %", 100 * (d2 < IN_99).mean(), "%", least=97, **known),
    ]


def peer_rows(photos: WallPhotos, ours: Run, data: str) -> list[dict[str, Any]]:
    """The plane set, first seed, stitched by others. Their errors hold the 0.3 px of reading a mosaic."""
    known: dict[str, Any] = {"data": data, "seed": 1}
    error = errors(ours.mosaic, ours.photos, ours.heights).rms_px
    rows = []
    for name, stitch_photos in PEERS.items():
        if name in NEEDS and find_spec(NEEDS[name]) is None:
            rows.append(row(f"{name}: not installed", 0, "photos", peer=name, **known))
            continue
        with TemporaryDirectory() as folder:
            peer = run_peer(stitch_photos, photos, Path(folder))
        of = f"of {len(photos.truth)} photos"
        rows += [
            row(
                f"photos used {of}",
                len(ours.mosaic.placements),
                "1",
                peer=name,
                peer_value=peer.used,
                **known,
            ),
            row(
                "error, similarity",
                error,
                "px RMS",
                peer=name,
                peer_value=_round(peer.similarity_px),
                **known,
            ),
            row(
                "error, homography",
                error,
                "px RMS",
                peer=name,
                peer_value=_round(peer.homography_px),
                **known,
            ),
            row("CPU time", ours.cpu_s, "s", peer=name, peer_value=_round(peer.cpu_s), **known),
        ]
    return rows


def growth_rows(megapixels: float, cache: Path) -> list[dict[str, Any]]:
    """CPU time of larger and larger sets with poses, of the plane."""
    (case,) = (case for case in CASES if case.name == "plane")
    counts, times = [], []
    for columns, rows in GROWTH_GRIDS:
        photos = wall_photos(case, columns, rows, megapixels, 1, cache)
        with store.temporary():
            done = run(photos)
        counts.append(columns * rows)
        times.append(done.cpu_s)
        out.print(f"{counts[-1]} photos: {times[-1]:.1f} CPU s")
    data = f"simulated, {counts[0]} to {counts[-1]} photos of {megapixels:g} MP with poses"
    exponent = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
    known: dict[str, Any] = {"data": data, "seed": 1}
    return [
        row("growth of CPU time with photos", exponent, "exponent", most=1.15, **known),
        row(f"CPU time a photo, of {counts[-1]}", times[-1] / counts[-1], "s", **known),
    ]


def _round(value: float) -> float | None:
    return round(value, 2) if np.isfinite(value) else None


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--full", action="store_true", help="30 photos of 8 MP, 5 seeds")
    asked.add_argument("--seeds", type=int, default=1)
    asked.add_argument("--cases", nargs="*", default=[case.name for case in CASES])
    asked.add_argument("--cache", type=Path, default=Path("build/bench/photos"))
    asked.add_argument("--grid", type=int, nargs=2, default=(4, 3))
    asked.add_argument("--no-peers", action="store_true")
    asked.add_argument("--growth", action="store_true", help="CPU time from 30 to 300 photos")
    asked.add_argument(
        "--large", type=int, nargs=2, metavar=("COLUMNS", "ROWS"), help="memory at 12 MP a photo"
    )
    asked.add_argument("--gsd", type=float, help="of the mosaic of --large, mm a pixel")
    asked.add_argument("--features", action="store_true", help="beside OpenCV's SIFT")
    asked.add_argument("--beach", action="store_true", help="the real photos, at full size")
    asked.add_argument("--megapixels", type=float, default=2.0)
    given = asked.parse_args()
    columns, rows = (6, 5) if given.full else given.grid
    megapixels, seeds = (8.0, 5) if given.full else (given.megapixels, given.seeds)
    size = f"simulated, {columns * rows} × {megapixels:g} MP"
    table: list[dict[str, Any]] = []
    if given.growth:
        table += growth_rows(megapixels, given.cache)
        for line in table:
            _tell(line)
    if given.large:
        for line in mosaic_size_rows.rows(*given.large, given.cache, given.gsd):
            table.append(line)
            _tell(line)
    if given.features:
        for line in feature_rows.rows(given.cache):
            table.append(line)
            _tell(line)
    if given.beach:
        for line in beach_rows.rows():
            table.append(line)
            _tell(line)
    every_d2 = []
    for case in CASES:
        if case.name not in given.cases:
            continue
        runs = []
        for seed in range(1, seeds + 1):
            photos = wall_photos(case, columns, rows, megapixels, seed, given.cache)
            with store.temporary():
                runs.append(run(photos))
        lines = rows_of(case, runs, size)
        every_d2 += [errors(run.mosaic, run.photos, run.heights).d2 for run in runs]
        if case.name == "plane" and not given.no_peers:
            lines += peer_rows(runs[0].photos, runs[0], size)
        for line in lines:
            table.append(line)
            _tell(line)
    if every_d2:
        for line in consistency_rows(np.concatenate(every_d2), size):
            table.append(line)
            _tell(line)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    table.append(row("peak memory", peak, "GiB", most=4.0, data=size))
    path = Path("build/bench/stitching.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n")
    out.print(f"\n{path}")


def _tell(line: dict[str, Any]) -> None:
    if line["peer"]:
        theirs = f"{line['peer']}: {line['peer_value']}"
        out.print(f"{line['what']:44} {line['value']:9} {line['unit']:7} {theirs}")
        return
    mark = {True: "holds", False: "MISSED", None: ""}[line["holds"]]
    out.print(f"{line['what']:68} {line['value']:9} {line['unit']:7} {line['bar'] or '':15} {mark}")


if __name__ == "__main__":
    main()
