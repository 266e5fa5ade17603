"""`hairline calibrate`: photos of a board become the camera file that the other commands read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from PIL import Image

from flows.command_line import app
from flows.plain_files import photos_in, say, warn
from schemas.problem import BadInput

if TYPE_CHECKING:
    from schemas.calibration import Calibration


@app.command
def calibrate(
    *photos: Path,
    out: Annotated[Path, Parameter(name="--out")],
    fisheye: Annotated[bool, Parameter(negative=())] = False,
    charuco: str | None = None,
    dictionary: str = "5X5_100",
    marker_share: float = 0.75,
) -> None:
    """Calibrate a camera from photos of a board: focal length, principal point, distortion, each with its 1σ.

    Writes the camera file, and beside it NAME.json (every figure) and NAME.png (where the corners lie). Take
    10 to 20 photos of a flat board with locked focus, near and far, into every corner of the frame, tilted by
    30 to 45° to all sides. The size of a chessboard is found, that of its squares does not matter.

    Parameters
    ----------
    photos:
        Photos of one board by one camera, or folders of them.
    out:
        Camera file to write: YAML with width_px, height_px, focal_px, cx_px, cy_px and k1, k2, ….
    fisheye:
        The lens is a fisheye (Kannala and Brandt's model with k1 to k4), not Brown's k1 to k3, p1, p2.
    charuco:
        The board is a ChArUco board of so many squares across and down, e.g. 12x9; a part of it is enough.
    dictionary:
        Of its markers, as OpenCV names it.
    marker_share:
        Side of a marker over the side of a square.
    """
    from flows.results import write_json
    from tasks.photos.task import calibrate as calibrated

    if out.suffix.lower() not in (".yaml", ".yml"):
        raise BadInput(str(out), "is no name of a camera file", "Give one that ends in .yaml")
    board = (_squares(charuco), dictionary, marker_share) if charuco else None
    paths = [path for given in photos for path in photos_in(given)]
    made, picture = calibrated(paths, "fisheye" if fisheye else "brown", board)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(camera_file(made), encoding="utf-8")
    except OSError as problem:
        raise BadInput(str(out), f"cannot be written ({problem.strerror})", "Give another --out") from None
    write_json(out.with_suffix(".json"), made)
    Image.fromarray(picture).save(out.with_suffix(".png"))
    for name, sigma in made.sigma.items():
        value = getattr(made.camera, name)
        say(
            f"  {name:9}{value:12.2f} ± {sigma:.2f}"
            if name.endswith("px")
            else f"  {name:9}{value:12.6f} ± {sigma:.6f}"
        )
    worst = max(view.rms_px for view in made.views)
    say(
        f"RMS {made.rms_px:.3f} px over {len(made.views)} photos (worst {worst:.3f});"
        f" undistortion within {made.undistortion_sigma_px:.2f} px between the corners,"
        f" {made.extrapolated_sigma_px:.2f} px beyond (1σ): {out}"
    )
    warn(made.left_out)


def _squares(text: str) -> tuple[int, int]:
    across, _, down = text.lower().partition("x")
    try:
        return int(across), int(down)
    except ValueError:
        raise BadInput(
            "--charuco", f"{text!r} is no board", "Give squares across and down, as 12x9"
        ) from None


def camera_file(made: "Calibration") -> str:
    """YAML that `--camera` and the key `camera` read; uncertainties stand in its comments."""
    camera = made.camera
    lines = [
        f"# Calibrated from {len(made.views)} photos of a board: RMS {made.rms_px:.3f} px,"
        f" undistortion within {made.undistortion_sigma_px:.2f} px between the corners,"
        f" {made.extrapolated_sigma_px:.2f} px beyond (1σ).",
        f"width_px: {camera.width_px}",
        f"height_px: {camera.height_px}",
        f"lens: {camera.lens}",
    ]
    lines += [f"{name}: {getattr(camera, name):.9g}  # ± {sigma:.2g}" for name, sigma in made.sigma.items()]
    return "\n".join(lines) + "\n"
