"""Stages of registration: scans are checked one by one, then tied together."""

from collections.abc import Mapping
from typing import Any

from artifacts import store
from artifacts.cloud_sample import cloud_sample
from artifacts.page import Page
from artifacts.picture import markdown_of
from schemas.contract import Matrix4, Vector3
from schemas.file import File
from schemas.problem import BadInput
from schemas.registered_model import RegisteredModel
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from tasks.stage import progress, stage


@stage()
def ingest_scan(
    file: File, name: str, unit_m: float, station_position_m: Vector3 | None, T_world_scan: Matrix4 | None
) -> tuple[Scan, ...]:
    """Check a scan file. A file with several scans gives several, `NAME-1`, `NAME-2`…; one of them that is
    unusable stays among them, to be left out by name in `register`.

    unit_m: metres per unit of the file's coordinates; where it is 1 and the file itself states another
    (LAS, LAZ), the file's holds. BadInput where no scan of the file can be used.
    """
    from tasks.registration.read_scan import read_scan, scan_count, stated_unit_m

    path = store.current().path(file)
    count = scan_count(path, name)
    if count > 1 and (station_position_m is not None or T_world_scan is not None):
        raise BadInput(
            name,
            f"one position is stated for its {count} scans",
            "Leave it out, so that the file's own poses count, or split the file.",
        )
    if unit_m == 1.0:
        unit_m = stated_unit_m(path, name) or unit_m
    scans = tuple(
        Scan(
            name=name if count == 1 else f"{name}-{index + 1}",
            file=file,
            index=index,
            unit_m=unit_m,
            station_position_m=station_position_m,
            T_world_scan=T_world_scan,
        )
        for index in range(count)
    )
    usable = 0
    problem = None
    for scan in scans:
        try:
            read_scan(path, scan.index, scan.unit_m, scan.name)
            usable += 1
        except BadInput as bad:
            problem = problem or bad
    if problem is not None and not usable:
        raise problem
    return scans


def pages(inputs: Mapping[str, Any], model: RegisteredModel) -> list[Page]:
    from tasks.registration.picture import draw_model

    points_m, station = cloud_sample(store.current().path(model.cloud))
    title = f"### {len(model.stations)} stations, {model.points:,} points"
    left_out = "".join(f"\n- left out: **{one.item}**, {one.what}" for one in model.left_out)
    picture = markdown_of(draw_model(model, points_m, station), "the model, coloured by station")
    rows = [
        {
            "source": pair.source,
            "target": pair.target,
            "overlap_%": round(100 * pair.overlap),
            "rmse_mm": round(1000 * pair.rmse_m, 2),
            "inliers": pair.inliers,
        }
        for pair in model.pairs
    ]
    shown = [Page(key="registered-model", markdown=f"{title}\n{left_out}\n\n{picture}")]
    return [*shown, Page(key="registered-pairs", table=rows)] if rows else shown


@stage(pages=pages)
def register(scans: tuple[Scan, ...], settings: RegistrationSettings) -> RegisteredModel:
    """Tie the scans together in one world frame and merge them into one cloud."""
    from tasks.registration.merged_model import write_model
    from tasks.registration.register import register as register_scans

    here = store.current()
    found = register_scans([(scan, here.path(scan.file)) for scan in scans], settings, progress)
    low_m, high_m = found.model.points_m.min(axis=0), found.model.points_m.max(axis=0)
    with here.scratch() as folder:
        write_model(found.model, folder / "model.ply")
        cloud = here.put(folder / "model.ply")
    return RegisteredModel(
        cloud=cloud,
        origin_m=(float(found.origin_m[0]), float(found.origin_m[1]), float(found.origin_m[2])),
        stations=found.stations,
        pairs=found.pairs,
        points=len(found.model.points_m),
        min_m=(float(low_m[0]), float(low_m[1]), float(low_m[2])),
        max_m=(float(high_m[0]), float(high_m[1]), float(high_m[2])),
        left_out=found.left_out,
    )
