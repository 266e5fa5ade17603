"""The photos in an inspection's folders, and what is known of each before it is opened."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from artifacts import store
from flows.inspection_file import existing
from flows.photo_files import photo_files
from schemas.camera import Camera, CameraPose
from schemas.contract import Vector3
from schemas.file import File, FolderEntry
from schemas.flight_log import FlightLog
from schemas.inspection import Inspection, PhotoSet
from schemas.problem import BadInput, LeftOut
from tasks.photos.task import assign


@dataclass(frozen=True)
class PhotoSource:
    """A photo file and what is known of it before it is opened."""

    file: File
    name: str
    surface: str
    stitch: bool = True
    gsd_mm_px: float | None = None
    camera: Camera | None = None
    pose: CameraPose | None = None
    position_sigma_m: float = 5.0
    velocity_m_s: Vector3 | None = None


def given_photos(
    inspection: Inspection, base: Path, log: FlightLog | None
) -> tuple[list[PhotoSource], list[LeftOut]]:
    """The photos in the inspection's folders; those of a logged flight with their surface and pose. And the
    files that cannot be read, or are not taken; BadInput where none can.

    A photo is called by its file's name; where several folders have one of that name, by folder/name."""
    camera = inspection.camera.camera() if inspection.camera else None
    folders = [existing(base, photo_set.folder, "photos").resolve() for photo_set in inspection.photos]
    listed = [
        photo_files(folder, s.folder, others=folders)
        for folder, s in zip(folders, inspection.photos, strict=True)
    ]
    paths = [one.paths for one in listed]
    bearers = Counter(path.name for of_folder in paths for path in of_folder)
    found: list[tuple[PhotoSet, str, Path, File]] = []
    problems: list[BadInput] = []
    for photo_set, label, of_folder in zip(inspection.photos, _labels(folders), paths, strict=True):
        for path in of_folder:
            try:
                found.append((photo_set, f"{label}/{path.name}", path, store.current().put(path)))
            except BadInput as problem:
                problems.append(problem)
    if problems and not found:
        raise problems[0]
    flown = [FolderEntry(name=name, file=file) for s, name, _, file in found if s.surface is None]
    shots = {a.name: a.shot for a in assign(tuple(flown), log)} if log is not None and flown else {}
    sources = []
    for photo_set, name, path, file in found:
        shot = shots.get(name) if photo_set.surface is None else None
        sources.append(
            PhotoSource(
                file=file,
                name=path.name if bearers[path.name] == 1 else name,
                surface=(shot.surface if shot else None) or photo_set.surface or path.parent.name,
                stitch=photo_set.stitch,
                gsd_mm_px=_stated_gsd_mm_px(photo_set, camera),
                camera=camera,
                pose=shot.pose if shot else None,
                position_sigma_m=position_sigma_m(inspection) if shot else 5.0,
                velocity_m_s=shot.velocity_m_s if shot else None,
            )
        )
    not_taken = [left for one in listed for left in one.not_taken]
    return sources, [*not_taken, *(LeftOut.because("photos", problem) for problem in problems)]


def position_sigma_m(inspection: Inspection) -> float:
    return float((inspection.vehicle.position_bias_m**2 + inspection.vehicle.position_jitter_m**2) ** 0.5)


def _labels(folders: Sequence[Path]) -> list[str]:
    """The last parts of each folder's path: as many as tell the folders apart."""
    parts, labels = 1, [folder.name for folder in folders]
    while len(set(labels)) < len(set(folders)):
        parts += 1
        labels = ["/".join(folder.parts[-parts:]) for folder in folders]
    return labels


def _stated_gsd_mm_px(photo_set: PhotoSet, camera: Camera | None) -> float | None:
    if photo_set.gsd_mm_px is not None or photo_set.stand_off_m is None:
        return photo_set.gsd_mm_px
    if camera is None:
        raise BadInput(
            photo_set.folder,
            "stand_off_m needs a camera",
            "Give the key 'camera' its size and lens, or gsd_mm_px",
        )
    return camera.gsd_mm_px(photo_set.stand_off_m)
