"""`hairline register` and `surfaces`: from scans to surfaces and obstacles, on plain files."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from flows.command_line import app
from flows.option_types import of_options
from flows.plain_files import (
    OutFolder,
    one_by_one,
    refuse_unless_file,
    say,
    warn,
    working,
)
from schemas.problem import BadInput

if TYPE_CHECKING:
    from schemas.inspection import ScanInput
    from schemas.registered_model import RegisteredModel
    from schemas.scan import Scan


@app.command
def register(
    *scans: Path,
    out: OutFolder,
    unit: Literal["m", "cm", "mm", "ft", "in"] = "m",
    voxel_m: float = 0.02,
    tau_m: float = 0.10,
    require_all: bool = False,
    survey: Path | None = None,
) -> None:
    """Register laser scans into one model: D/poses.json, D/model.ply, D/model.png.

    poses.json holds per scan T_world_scan (4×4, metres) and its covariance, per pair overlap and RMSE, per
    target how far the model misses it.

    Parameters
    ----------
    scans:
        Scan files: PLY, PCD, XYZ, CSV, PTS, PTX, E57, LAS, LAZ.
    out:
        Folder to write to.
    unit:
        Unit of the files' coordinates.
    voxel_m:
        Point spacing of the merged model, metres.
    tau_m:
        The paper's τ: points closer than this overlap, metres.
    require_all:
        Stop where a scan ties to no other. Default: it is named and the others go on.
    survey:
        What the crew knows, as YAML with an inspection file's keys: `targets` (name, position_m, check) for
        surveyed ones, and `scans` (file, and its targets, position_m, T_world_scan, unit where known).
    """
    from artifacts.picture import write_png
    from flows.results import write_registration
    from flows.survey_file import Survey, read_survey
    from schemas.scan import Scan
    from schemas.settings import RegistrationSettings
    from tasks.registration.task import picture
    from tasks.registration.task import register as register_scans

    if not scans:
        raise BadInput("register", "no scan is given", "Name the scan files before --out")
    with working(out):
        known = read_survey(survey, list(scans)) if survey else Survey()
        usable, left_out = one_by_one(list(scans), lambda path: ingested_scan(path, known.of(path, unit)))
        settings = of_options(RegistrationSettings, voxel_m=voxel_m, tau_m=tau_m, require_all=require_all)
        read: tuple[Scan, ...] = tuple(usable)
        model = register_scans.bare(read, settings, known.targets)
        model = model.model_copy(update={"left_out": (*left_out, *model.left_out)})
        write_registration(out, model, copy=True)
        write_png(out / "model.png", picture(model))
    taken_in = f"files that state no unit taken in {unit}"
    say(f"{len(model.stations)} scans registered, {taken_in}, {model.points:,} points: {out / 'model.ply'}")
    for kind, rmse_m in (("control targets", model.control_rmse_m), ("check points", model.check_rmse_m)):
        if rmse_m is not None:
            say(f"{kind}: {1000 * rmse_m:.1f} mm RMSE")
    warn(model.left_out)


def ingested_scan(path: Path, known: "ScanInput") -> "tuple[Scan, ...]":
    from artifacts import store
    from flows.model_structure import METRES, seen_targets
    from tasks.registration.task import ingest_scan

    refuse_unless_file(path)
    file, seen = store.current().put(path), seen_targets(known)
    return ingest_scan.bare(file, path.name, METRES[known.unit], known.position_m, known.T_world_scan, seen)


@app.command
def surfaces(
    cloud: Path,
    *,
    out: OutFolder,
    unit: Literal["m", "cm", "mm", "ft", "in"] = "m",
    min_area_m2: float = 0.5,
    distance_m: float = 0.02,
    epsilon_m: float = 0.5,
) -> None:
    """Find flat surfaces and obstacles in a cloud: D/surfaces.json, D/occupied.ply, D/surfaces.png.

    Parameters
    ----------
    cloud:
        The model.ply of `hairline register`, its poses.json beside it, or any scan file. Where the scanners
        stood says which air they saw to be free, which a flight plan asks.
    out:
        Folder to write to.
    unit:
        Unit of the file's coordinates.
    min_area_m2:
        Smaller patches are not surfaces, square metres.
    distance_m:
        RANSAC inlier distance, metres.
    epsilon_m:
        The paper's ε: obstacles are more than this apart, metres.
    """
    from artifacts.picture import write_png
    from flows.results import write_structure
    from schemas.inspection import ScanInput
    from schemas.settings import RegistrationSettings, SurfaceSettings
    from tasks.registration.task import register as register_scans
    from tasks.surfaces.task import extract, picture

    with working(out):
        model = registered_beside(cloud) or register_scans.bare(
            ingested_scan(cloud, ScanInput(file=cloud.name, unit=unit)), RegistrationSettings()
        )
        settings = of_options(
            SurfaceSettings, min_area_m2=min_area_m2, distance_m=distance_m, epsilon_m=epsilon_m
        )
        structure = extract.bare(model, settings)
        write_structure(out, structure, copy=True)
        write_png(out / "surfaces.png", picture(structure))
    say(f"{len(structure.surfaces)} surfaces, {len(structure.obstacles)} obstacles: {out / 'surfaces.json'}")
    warn(structure.left_out)


def registered_beside(cloud: Path) -> "RegisteredModel | None":
    """The registered model that wrote this cloud, by the poses.json beside it; None where there is none."""
    import json

    from artifacts import store
    from schemas.registered_model import RegisteredModel

    poses = cloud.with_name("poses.json")
    if cloud.name != "model.ply" or not (cloud.is_file() and poses.is_file()):
        return None
    try:
        content = json.loads(poses.read_text(encoding="utf-8"))
        known = {key: value for key, value in content.items() if key in RegisteredModel.model_fields}
        return RegisteredModel.model_validate(known | {"cloud": store.current().put(cloud)})
    except (ValueError, AttributeError):
        raise BadInput(str(poses), "is no poses.json of `hairline register`", "Register again") from None


def enter_beside(json_path: Path, name: str, sha256: str) -> None:
    """Put the file that a JSON refers to, and that lies beside it, into the store."""
    from artifacts import store

    path = json_path.parent / name
    if not path.is_file():
        raise BadInput(str(path), f"is missing beside {json_path.name}", "Keep the command's files together")
    if store.current().put(path).sha256 != sha256:
        raise BadInput(
            str(path),
            f"is not the file that {json_path.name} was written with",
            "Run `hairline surfaces` again",
        )
