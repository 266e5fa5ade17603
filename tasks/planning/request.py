"""What is asked of a plan, refused where it cannot be: surfaces, ground sample distance."""

from collections.abc import Sequence

import numpy as np

from schemas.camera import Camera
from schemas.problem import BadInput
from schemas.structure import Structure
from schemas.surface import Surface
from schemas.vehicle import Vehicle

ROOM_M = 0.02  # a path cannot touch the inflation everywhere: roughness of the scanned surface


def chosen_surfaces(structure: Structure, names: Sequence[str] | None) -> tuple[Surface, ...]:
    """The surfaces to inspect: those named, else all but the ground."""
    known = {s.name: s for s in structure.surfaces}
    if not known:
        raise BadInput(
            "surfaces", "the structure has no surface", "Check the scans, or lower surfaces.min_area_m2."
        )
    if names is None:
        chosen = tuple(s for name, s in known.items() if not name.startswith("ground-"))
        if not chosen:
            raise BadInput(
                "plan.surfaces", "only ground was found", f"To inspect it, name it: {', '.join(known)}."
            )
        return chosen
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise BadInput(
            "plan.surfaces",
            f"there is no surface {', '.join(unknown)}" if unknown else "the list of surfaces is empty",
            f"The structure has: {', '.join(known)}.",
        )
    return tuple(known[name] for name in dict.fromkeys(names))


def check_camera(camera: Camera) -> None:
    """Refuse a distortion that folds the image onto itself before its corners: no ray belongs to them."""
    right, bottom = camera.width_px - 1.0, camera.height_px - 1.0
    corners = (
        np.array([(0, 0), (right, 0), (0, bottom), (right, bottom)]) - camera.principal_px
    ) / camera.focal_px
    with np.errstate(all="ignore"):
        back = camera.distort(camera.undistort(corners))
        unfolded = bool(np.all(np.abs(back - corners) * camera.focal_px < 0.5))
    if not unfolded:
        raise BadInput(
            "camera",
            "no ray leads to the corners of its image: its distortion (k1, k2, …) cannot be right",
            "Calibrate it again, or leave the distortion out.",
        )


def check_focus(stand_off_m: float, camera: Camera, vehicle: Vehicle) -> None:
    """Refuse a camera that is focused once, where the position error leaves its depth of field."""
    depth = camera.depth_of_field_m(stand_off_m)
    if camera.autofocus or depth is None or depth >= vehicle.position_error_m:
        return
    assert camera.f_number is not None
    needed = np.ceil(10 * camera.f_number * vehicle.position_error_m / depth) / 10
    raise BadInput(
        "camera.autofocus",
        f"focused once at {stand_off_m:.2f} m it is sharp within ±{1000 * depth:.0f} mm, and the position"
        f" errs by {1000 * vehicle.position_error_m:.0f} mm",
        f"Let it focus at each photo, take f/{needed:g} or more, a coarser plan.gsd_mm_px, or use RTK.",
    )


def planned_stand_off_m(gsd_mm_px: float, camera: Camera, vehicle: Vehicle) -> float:
    """The stand-off to fly: closer than the asked ground sample distance needs, by the position error, since
    the photos are judged at stand-off plus error.

    Refuses a ground sample distance whose stand-off less the error leaves no clearance, or one whose photos
    are smaller than what the position jitters."""
    error = vehicle.position_error_m
    farthest = camera.stand_off_m(gsd_mm_px)
    stand_off = farthest - error
    if stand_off < vehicle.inflation_m + ROOM_M:
        needed = vehicle.inflation_m + ROOM_M + error
        safe = np.ceil(camera.gsd_mm_px(needed) * 1000) / 1000
        longer = np.ceil(needed * 1000 / gsd_mm_px)
        raise BadInput(
            "plan.gsd_mm_px",
            f"{gsd_mm_px:g} mm/px takes this camera at most {farthest:.2f} m from the surface, so it is"
            f" planned {max(stand_off, 0.0):.2f} m away and may come {error:.2f} m closer (position error);"
            f" the vehicle must stay {vehicle.radius_m + vehicle.clearance_m:.2f} m away (radius"
            f" {vehicle.radius_m:g}, clearance {vehicle.clearance_m:g})",
            f"Ask for {safe:g} mm/px or coarser, take a lens of at least {longer:.0f} px focal length, or"
            " lower vehicle.clearance_m or the position error (RTK).",
        )
    footprint = min(camera.footprint_m(stand_off))
    if footprint < 3 * vehicle.position_jitter_m:
        wide_m = 3 * vehicle.position_jitter_m * camera.focal_px / min(camera.width_px, camera.height_px)
        enough = np.ceil(camera.gsd_mm_px(wide_m + error) * 1000) / 1000
        raise BadInput(
            "vehicle.position_jitter_m",
            f"a photo covers {footprint:.2f} m, less than three times the jitter of"
            f" {vehicle.position_jitter_m:g} m: neighbours would miss each other",
            f"Ask for {enough:g} mm/px or coarser, take a camera with more pixels, or position by RTK.",
        )
    check_focus(stand_off, camera, vehicle)
    return stand_off
