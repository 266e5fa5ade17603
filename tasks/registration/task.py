"""Stages of registration: scans are checked one by one, then tied together."""

from collections.abc import Mapping
from typing import Any

from artifacts import store
from artifacts.cloud_sample import cloud_sample
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.contract import Matrix4, Vector3
from schemas.file import File
from schemas.problem import BadInput, LeftOut
from schemas.raster import Pixels
from schemas.registered_model import RegisteredModel
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from schemas.target import SeenTarget, SiteTarget, TargetResidual
from tasks.stage import progress, stage

AXES = ("east", "north", "up")
CUT_SHORT = {
    "stage": "registration",
    "what": "the file breaks off in its last row; the rows before are used",
    "remedy": "Copy or export it again",
}


@stage()
def ingest_scan(
    file: File,
    name: str,
    unit_m: float,
    station_position_m: Vector3 | None,
    T_world_scan: Matrix4 | None,
    targets: tuple[SeenTarget, ...] = (),
) -> tuple[Scan, ...]:
    """Check a scan file. A file with several scans gives several, `NAME-1`, `NAME-2`…; one of them that is
    unusable stays among them, to be left out by name in `register`.

    unit_m: metres per unit of the file's coordinates; where it is 1 and the file itself states another
    (LAS, LAZ), the file's holds. BadInput where no scan of the file can be used.
    """
    from tasks.registration.read_scan import (
        cut_short,
        scan_blocks,
        scan_count,
        stated_unit_m,
        stated_utm_zone,
    )

    path = store.current().path(file)
    count = scan_count(path, name)
    if count > 1 and (station_position_m is not None or T_world_scan is not None or targets):
        raise BadInput(
            name,
            f"{'targets are' if targets else 'one position is'} stated for its {count} scans",
            "Leave it out, so that the file's own poses count, or split the file.",
        )
    if unit_m == 1.0:
        unit_m = stated_unit_m(path, name) or unit_m
    utm_zone = stated_utm_zone(path, name)
    left_out = (LeftOut(item=f"the end of {name}", **CUT_SHORT),) if cut_short(path) else ()
    scans = tuple(
        Scan(
            name=name if count == 1 else f"{name}-{index + 1}",
            file=file,
            index=index,
            unit_m=unit_m,
            station_position_m=station_position_m,
            T_world_scan=T_world_scan,
            utm_zone=utm_zone,
            targets=targets,
            left_out=left_out,
        )
        for index in range(count)
    )
    usable = 0
    problem = None
    for scan in scans:
        try:
            for _ in scan_blocks(path, scan.index, scan.unit_m, scan.name):
                pass
            usable += 1
        except BadInput as bad:
            problem = problem or bad
    if problem is not None and not usable:
        raise problem
    return scans


def pages(inputs: Mapping[str, Any], model: RegisteredModel) -> list[Page]:
    title = f"### {len(model.stations)} stations, {model.points:,} points"
    left_out = "".join(f"\n- left out: **{one.item}**, {one.what}" for one in model.left_out)
    drawn = markdown_of(picture(model), "the model, coloured by station")
    shown = [Page(key="registered-model", markdown=f"{title}\n{_of_targets(model)}{left_out}\n\n{drawn}")]
    stations = [
        {
            "station": one.name,
            "points": one.points,
            "sigma_mm": None if one.sigma_mm is None else round(one.sigma_mm, 2),
            "sigma_deg": None if one.sigma_deg is None else round(one.sigma_deg, 4),
        }
        for one in model.stations
    ]
    pairs = [
        {
            "source": pair.source,
            "target": pair.target,
            "overlap_%": round(100 * pair.overlap),
            "rmse_mm": round(1000 * pair.rmse_m, 2),
            "inliers": pair.inliers,
        }
        for pair in model.pairs
    ]
    targets = [
        {"target": one.name, "station": one.station, "role": _role(one)}
        | {f"{axis}_mm": round(1000 * x, 1) for axis, x in zip(AXES, one.residual_m, strict=True)}
        for one in model.targets
    ]
    tables: dict[str, list[dict[str, Any]]] = {"stations": stations, "pairs": pairs, "targets": targets}
    return shown + [Page(key=f"registered-{key}", table=rows) for key, rows in tables.items() if rows]


def picture(model: RegisteredModel) -> Pixels:
    """(H, W, 3) RGB of the model, coloured by station."""
    from tasks.registration.picture import draw_model

    return draw_model(model, *cloud_sample(store.current().path(model.cloud)))


def _of_targets(model: RegisteredModel) -> str:
    """One line on how well the model lies in the site's datum."""
    kinds = (("control targets, fitted to", model.control_rmse_m), ("check points", model.check_rmse_m))
    said = [f"{kind}: {1000 * rmse_m:.1f} mm RMSE" for kind, rmse_m in kinds if rmse_m is not None]
    return f"\n{'; '.join(said)}\n" if said else ""


def _role(one: TargetResidual) -> str:
    return "check" if one.check else "control" if one.used else "control, not used"


@stage(pages=pages)
def register(
    scans: tuple[Scan, ...], settings: RegistrationSettings, targets: tuple[SiteTarget, ...] = ()
) -> RegisteredModel:
    """Tie the scans together in one world frame and merge them into one cloud.

    targets: surveyed in the site's datum, which control targets make the model's world frame.
    """
    from tasks.registration.register import register as register_scans

    here = store.current()
    with here.scratch() as folder:
        found = register_scans(
            [(scan, here.path(scan.file)) for scan in scans],
            settings,
            folder / "model.ply",
            targets,
            progress,
        )
        cloud = here.put(found.model.path)
    low_m, high_m = found.model.low_m, found.model.high_m
    of_files = {scan.utm_zone for scan in scans if scan.T_world_scan is None} - {None}
    in_its_grid = len(of_files) == 1 and found.origin_m.any() and all(target.check for target in targets)
    return RegisteredModel(
        cloud=cloud,
        origin_m=(float(found.origin_m[0]), float(found.origin_m[1]), float(found.origin_m[2])),
        utm_zone=of_files.pop() if in_its_grid else None,
        stations=found.stations,
        pairs=found.pairs,
        targets=found.targets,
        points=found.model.points,
        min_m=(float(low_m[0]), float(low_m[1]), float(low_m[2])),
        max_m=(float(high_m[0]), float(high_m[1]), float(high_m[2])),
        left_out=(*(left for scan in scans for left in scan.left_out), *found.left_out),
    )
