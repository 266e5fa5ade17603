"""`hairline init`: the inspection file for what lies in a folder, each setting with its default explained."""

import inspect
import json
import re
import unicodedata
from pathlib import Path

from pydantic import BaseModel

from artifacts.whole_file import whole
from flows.photo_files import PHOTO_SUFFIXES, is_hidden
from schemas import settings
from schemas.inspection import Inspection
from schemas.problem import BadInput
from schemas.vehicle import Vehicle

SCAN_SUFFIXES = {".ply", ".pcd", ".xyz", ".csv", ".pts", ".ptx", ".e57", ".las", ".laz"}
LOG_SUFFIXES = {".tlog", ".bin", ".ulg", ".mcap"}
SECTIONS: dict[str, type[BaseModel]] = {
    "vehicle": Vehicle,
    "registration": settings.RegistrationSettings,
    "surfaces": settings.SurfaceSettings,
    "plan": settings.PlanSettings,
    "stitch": settings.StitchSettings,
    "patterns": settings.PatternSettings,
    "detect": settings.DetectSettings,
    "assess": settings.AssessSettings,
    "report": settings.ReportSettings,
}


def init_inspection(folder: Path, name: str | None) -> Path:
    """Write FOLDER/inspection.yaml; never over one that is there."""
    if not folder.is_dir():
        raise BadInput(str(folder), "is no folder", "Name the folder that holds the scans and photos")
    path = folder / "inspection.yaml"
    if path.exists():
        raise BadInput(str(path), "is there already", "Edit it, or move it away first")
    name = name or _name_after(folder.resolve())
    try:
        Inspection(name=name)
    except ValueError:
        raise BadInput(
            name, "is no name for a run's folder", "Use letters, digits, dots and dashes"
        ) from None
    scans = _found(folder, SCAN_SUFFIXES)
    photo_folders = sorted({p.parent for p in _found(folder, PHOTO_SUFFIXES)})
    logs = _found(folder, LOG_SUFFIXES)
    if not scans and not photo_folders:
        raise BadInput(str(folder), "holds neither scans nor photos", "Copy the crew's files there first")
    lines = [f"name: {_as_yaml(name)}  # also the folder under runs/"]
    lines += (
        _scan_lines(folder, scans) + _photo_lines(folder, photo_folders) + _flight_lines(folder, scans, logs)
    )
    for section, model in SECTIONS.items():
        lines += ["", f"# {section}:", *(f"#   {line}" for line in described(model))]
    try:
        with whole(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as problem:
        what = f"cannot be written to ({problem.strerror})"
        remedy = "Free space there or make it writable, or copy what it holds to another folder"
        raise BadInput(str(folder), what, remedy) from None
    return path


def described(model: type[BaseModel]) -> list[str]:
    """`key: default  # why`, the words taken from the comment on the field's own line."""
    source = re.sub(r"\bNone\b", "null", inspect.getsource(model))  # as YAML says it
    comments = dict(re.findall(r"^    (\w+): .*?  # (.*)$", source, flags=re.MULTILINE))
    lines = []
    for key, field in model.model_fields.items():
        comment = f"  # {comments[key]}" if key in comments else ""
        lines.append(f"{key}: {json.dumps(field.get_default())}{comment}")
    return lines


def _found(folder: Path, suffixes: set[str]) -> list[Path]:
    """Below the folder; what programs have hidden there, a thumbnail say, is nobody's."""
    there = (p for p in folder.rglob("*") if p.suffix.lower() in suffixes and p.is_file())
    return sorted(p for p in there if not any(map(is_hidden, p.relative_to(folder).parts)))


def _name_after(folder: Path) -> str:
    """The folder's name, in its own alphabet; what a run's folder cannot be called by becomes a dash."""
    called = unicodedata.normalize("NFC", folder.name)  # some systems take letters and their accents apart
    kept = (c if c.isalnum() or c in "._-" or unicodedata.category(c)[0] == "M" else "-" for c in called)
    return re.sub(r"-+", "-", "".join(kept)).strip("-._") or "inspection"


def _as_yaml(text: str) -> str:
    """In quotes: 007, no and 2024-05-01 are names too. BadInput where it is a name that is not UTF-8."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise BadInput(text, "its name is not in UTF-8", "Rename it, then try again") from None
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)


def _quoted(folder: Path, path: Path) -> str:
    return _as_yaml(path.relative_to(folder).as_posix() or ".")


def _scan_lines(folder: Path, scans: list[Path]) -> list[str]:
    if not scans:
        return []
    lines = [
        "",
        "scans:  # unit: m, cm, mm, ft or in; position_m: [east, north, up] of the scanner, where known",
    ]
    return lines + [f"  - {{file: {_quoted(folder, scan)}, unit: m}}" for scan in scans]


def _photo_lines(folder: Path, photo_folders: list[Path]) -> list[str]:
    if not photo_folders:
        return []
    lines = [
        "",
        "photos:  # a folder a surface; stitch: false: no overlap; add gsd_mm_px or stand_off_m",
    ]
    return lines + [f"  - {{folder: {_quoted(folder, photos)}, stitch: true}}" for photos in photo_folders]


def _flight_lines(folder: Path, scans: list[Path], logs: list[Path]) -> list[str]:
    lines = []
    if logs:
        named = [_quoted(folder, log) for log in logs]
        lines += ["", f"flight_log: {named[0] if len(named) == 1 else '[' + ', '.join(named) + ']'}"]
    if logs and scans:
        lines += ["flight: external  # flown by somebody else from the plan's mission files"]
    return [
        *lines,
        "",
        "# camera:  # needed to plan, and where photos lack EXIF: by focal_px, or by the lens,",
        "#   or the file of `hairline calibrate`, as in camera: camera.yaml",
        "#   {width_px: 8192, height_px: 5460, focal_mm: 35, sensor_width_mm: 35.9}",
        "# origin: {latitude_deg: 47.0, longitude_deg: 8.0, altitude_m: 400}  # WGS84 of (0, 0, 0)",
        "# utm_zone: 32N  # instead of origin, for scans in UTM whose files do not state it",
        "# anchors:  # or two points of the model whose place on the Earth is known, far from each other",
        "#   - {model_m: [0, 0, 0], latitude_deg: 47.0, longitude_deg: 8.0, altitude_m: 400}",
        "#   - {model_m: [85.2, 3.1, 0], latitude_deg: 47.0001, longitude_deg: 8.0011}",
    ]
