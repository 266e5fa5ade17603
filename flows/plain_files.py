"""What the commands of single stages share: reading plain files, a temporary store, warnings."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir
from typing import Annotated, TypeVar

from cyclopts import Parameter
from pydantic import BaseModel, ValidationError

from flows.console import StageLines, err, plain
from flows.console import out as console
from flows.explain import explain
from flows.inspection_file import read_camera_file
from flows.output_folder import make_output_folder, told_when_full
from flows.yaml_file import read_yaml
from schemas.camera import Camera
from schemas.control import Control
from schemas.problem import BadInput, LeftOut

Model = TypeVar("Model", bound=BaseModel)
Many = Parameter(consume_multiple=True)
OutFolder = Annotated[Path, Parameter(name="--out")]


@contextmanager
def working(folder: Path) -> Iterator[Callable[[float], None]]:
    """A temporary store and progress for a stage; the output's folder exists."""
    from artifacts import store
    from tasks import run

    make_output_folder(folder)
    with (
        told_when_full(folder, Path(gettempdir())),
        store.temporary(),
        StageLines() as lines,
        run.running(run.Run(listener=lines)),
    ):
        yield lambda fraction: lines(run.Event("", "progress", fraction=fraction))


def warn(left_out: list[LeftOut] | tuple[LeftOut, ...]) -> None:
    """One line for each reason, with the items that it concerns."""
    items: dict[tuple[str, str], list[str]] = {}
    for left in left_out:
        items.setdefault((left.what, left.remedy), []).append(left.item)
    for (what, remedy), names in items.items():
        text = f"Warning: left out: {', '.join(names)}: {what}. {remedy}".rstrip()
        err.print(f"[yellow]{plain(text)}[/yellow]")


def refuse_unless_file(path: Path, instead_of_a_folder: str = "Name a file in it") -> None:
    if path.is_dir():
        raise BadInput(str(path), "is a folder", instead_of_a_folder)
    if not path.is_file():
        raise BadInput(str(path), "no such file", "Correct the path")


def read_contract(path: Path, contract: type[Model]) -> Model:
    """A schema from the JSON that another command wrote."""
    try:
        return contract.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        raise BadInput(str(path), "no such file", "Give the JSON that an earlier command wrote") from None
    except IsADirectoryError:
        raise BadInput(
            str(path), "is a folder", "Name the JSON file in it that an earlier command wrote"
        ) from None
    except OSError as problem:
        raise BadInput(str(path), f"cannot be read ({problem.strerror})", "Give a JSON file") from None
    except ValidationError as problem:
        raise explain(str(path), problem, contract) from None


def read_camera(path: Path) -> Camera:
    """CAMERA.yaml: width_px, height_px, and focal_px or focal_mm with sensor_width_mm; k1…, shutter_s."""
    return read_camera_file(path).camera()


def read_control(path: Path) -> Control:
    """CONTROL.yaml: targets or scale_bars, and the marks or tags that photos show them by."""
    wanted = "targets or scale_bars, and the marks or tags that photos show them by"
    content = read_yaml(path, "control's YAML file", f"Give a YAML file with {wanted}")
    try:
        return Control.model_validate(content)
    except ValidationError as problem:
        raise explain(str(path), problem, Control) from None


def one_by_one(
    paths: list[Path], call: Callable[[Path], Model | tuple[Model, ...]]
) -> tuple[list[Model], list[LeftOut]]:
    """The results of the usable files; the others by name. BadInput where none is usable."""
    good: list[Model] = []
    problems: list[BadInput] = []
    for path in paths:
        try:
            result = call(path)
            good.extend(result if isinstance(result, tuple) else (result,))
        except BadInput as problem:
            problems.append(problem)
    if not good:
        raise problems[0]
    return good, [LeftOut.because("reading", problem) for problem in problems]


def photos_in(path: Path, *, mosaics: bool = False) -> list[Path]:
    """An image, or the photos in a folder; what else is there is said. mosaics: Hairline's own ones may be
    what the folder holds."""
    from flows.photo_files import photo_files

    if path.is_file():
        return [path]
    if not path.is_dir():
        raise BadInput(str(path), "no such file or folder", "Correct the path")
    listed = photo_files(path, str(path if path.name else path.resolve()), mosaics=mosaics)
    warn(listed.not_taken)
    return listed.paths


def say(text: str) -> None:
    console.print(plain(text))
