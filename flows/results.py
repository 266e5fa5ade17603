"""The files with fixed names that people and other programs find: runs/<inspection>/<stage>/…, or --out.

Pictures and clouds are links into the store unless `copy` is asked for; JSON and the report are real files.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from artifacts.mission_files import write_missions
from artifacts.run_folder import lay_out, safe_name
from artifacts.whole_file import whole
from schemas.detection import Detection, Patterns
from schemas.evaluation import Curves, Evaluation
from schemas.file import Folder
from schemas.flight_log import FlightLog
from schemas.flight_plan import FlightPlan
from schemas.mosaic import Mosaic
from schemas.problem import LeftOut
from schemas.registered_model import RegisteredModel
from schemas.structure import Structure


def write_json(path: Path, content: BaseModel | Mapping[str, Any]) -> None:
    """Stable bytes: the same content gives the same file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    plain = content.model_dump(mode="json") if isinstance(content, BaseModel) else content
    with whole(path) as temporary:
        temporary.write_text(json.dumps(plain, indent=1) + "\n", encoding="utf-8")


def write_registration(folder: Path, model: RegisteredModel, copy: bool = False) -> None:
    """poses.json: `T_world_scan` 4×4 per scan, metres; model.ply."""
    poses = {
        station.name: _shifted(station.T_world_scan, model.origin_m).tolist() for station in model.stations
    }
    write_json(
        folder / "poses.json",
        {"unit": "m", "T_world_scan": poses} | model.model_dump(mode="json", exclude={"cloud"}),
    )
    lay_out(folder, {"model.ply": model.cloud}, copy=copy)


def _shifted(T_world_scan: Any, origin_m: tuple[float, float, float]) -> Any:
    T = np.array(T_world_scan)
    T[:3, 3] += origin_m
    return T


def write_evaluation(
    folder: Path, evaluations: Sequence[Evaluation], curves: Curves | None, left_out: Sequence[LeftOut]
) -> None:
    """evaluation.json; curves.png where there are curves."""
    from artifacts.evaluation_pictures import curves_picture

    content = {
        "images": evaluations[0].images,
        "results": [one.model_dump(mode="json") for one in evaluations],
        "curves": None if curves is None else curves.model_dump(mode="json"),
        "left_out": [one.model_dump(mode="json") for one in left_out],
    }
    write_json(folder / "evaluation.json", content)
    if curves is not None:
        (folder / "curves.png").write_bytes(curves_picture(curves, evaluations))


def write_structure(folder: Path, structure: Structure, copy: bool = False) -> None:
    write_json(folder / "surfaces.json", structure)
    lay_out(folder, {"occupied.ply": structure.occupied}, copy=copy)


def write_flight_plan(folder: Path, plan: FlightPlan, copy: bool = False) -> None:
    """plan.json; SURFACE.width_mm.tif, the smallest measurable width at each place; the mission files, one
    of each kind a flight: mission.*, mission-2.*, …"""
    write_json(folder / "plan.json", plan)
    maps = {f"{c.surface}.width_mm.tif": c.width_map for c in plan.coverage if c.width_map is not None}
    lay_out(folder, maps, copy=copy)
    names = [f"mission-{n}" if n > 1 else "mission" for n in range(1, len(plan.each_flight) + 1)]
    for name, flight in zip(names, plan.each_flight, strict=True):
        write_missions(flight, folder / name)
    for stale in folder.glob("mission-*.*"):
        if stale.stem not in names:
            stale.unlink()


def write_flight(folder: Path, log: FlightLog, copy: bool = False) -> None:
    write_json(folder / "track.json", log.model_dump(mode="json", exclude={"archive", "later_archives"}))
    later = {f"flight-{n}{file.suffix}": file for n, file in enumerate(log.later_archives, start=2)}
    lay_out(folder, {f"flight{log.archive.suffix}": log.archive, **later}, copy=copy)


def write_mosaic(folder: Path, mosaic: Mosaic, copy: bool = False) -> None:
    """stitch.json: per photo its status, its 3×3 homography from undistorted photo pixels to mosaic pixels,
    and the adjusted camera that undistorts it."""
    plain = mosaic.model_dump(mode="json", exclude={"image", "coverage", "source", "photos"})
    for placement, photo in zip(plain["placements"], mosaic.photos, strict=True):
        placement["camera"] = photo.camera.model_dump(mode="json")
    write_json(folder / "stitch.json", plain)
    lay_out(
        folder,
        {
            "mosaic.tif": mosaic.image,
            "mosaic.coverage.tif": mosaic.coverage,
            "mosaic.source.tif": mosaic.source,
        },
        copy=copy,
    )


def lay_out_model(folder: Path, model: RegisteredModel, structure: Structure) -> None:
    write_registration(folder / "registration", model)
    write_structure(folder / "surfaces", structure)


def lay_out_flight(folder: Path, log: FlightLog | None) -> None:
    if log is not None:
        write_flight(folder / "flight", log)


def lay_out_mosaic(folder: Path, mosaic: Mosaic, patterns: Patterns, detection: Detection) -> None:
    write_mosaic(folder / "mosaics" / safe_name(mosaic.name), mosaic)
    lay_out(
        folder / "detection" / safe_name(mosaic.name),
        {"cracks.png": detection.mask, "not_inspected.png": patterns.mask},
        copy=False,
    )


def lay_out_report(folder: Path, pages: Folder) -> None:
    lay_out(folder, {"report": pages}, copy=True)
