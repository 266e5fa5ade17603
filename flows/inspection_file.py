"""Reading the inspection file, with messages that name the key and say what to do."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flows.explain import explain
from flows.yaml_file import read_yaml
from schemas.inspection import CameraInput, Inspection
from schemas.problem import BadInput


def read_inspection(path: Path) -> Inspection:
    """The inspection that a YAML file describes. BadInput names the line or key that is wrong."""
    content = settings_in(path)
    if isinstance(content.get("camera"), str):
        content["camera"] = read_camera_file(existing(path.parent, content["camera"], "camera")).model_dump()
    try:
        inspection = Inspection.model_validate(content)
    except ValidationError as problem:
        raise explain(str(path), problem, Inspection) from None
    _check_photo_folders(path, inspection)
    return inspection


def _check_photo_folders(path: Path, inspection: Inspection) -> None:
    """A folder that is given twice for one surface would count its cracks twice; a file is none."""
    seen: set[tuple[Path, str]] = set()
    for photos in inspection.photos:
        folder = (path.parent / photos.folder).resolve()
        if folder.is_file():
            what = f"gives the file {photos.folder!r} as a folder of photos"
            raise BadInput(str(path), what, "Name the folder that it is in")
        given = folder, photos.surface or folder.name
        if given in seen:
            raise BadInput(str(path), f"gives the photos {photos.folder!r} twice", "Give each folder once")
        seen.add(given)


def settings_in(path: Path) -> dict[str, Any]:
    """What stands in a YAML file; BadInput where that is no settings."""
    content = read_yaml(path, "inspection's YAML file", "Write one with: hairline init FOLDER")
    if not isinstance(content, dict):
        raise BadInput(str(path), "holds no settings", "Write one with: hairline init FOLDER")
    return content


def read_camera_file(path: Path) -> CameraInput:
    """CAMERA.yaml: width_px, height_px, and focal_px or focal_mm with sensor_width_mm; lens, k1…, shutter_s.
    An inspection file that has a camera does too."""
    content = read_yaml(path, "camera's YAML file", "Give a YAML file with width_px, height_px, focal_px")
    if isinstance(content, dict) and "camera" in content:
        content = content["camera"]
        if isinstance(content, str):
            return read_camera_file(existing(path.parent, content, "camera"))
    if not isinstance(content, dict):
        raise BadInput(str(path), "holds no camera", "Write width_px, height_px and focal_px in it")
    try:
        return CameraInput.model_validate(content)
    except ValidationError as problem:
        raise explain(str(path), problem, CameraInput) from None


def existing(base: Path, name: str, key: str) -> Path:
    """A file or folder that the inspection names, relative to the inspection file's folder."""
    path = base / name
    if not path.exists():
        raise BadInput(name, f"named by key {key!r}, does not exist in {base.resolve()}", "Correct the path")
    return path
