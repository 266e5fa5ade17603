"""A measured crack in millimetres, in its surface's frame and in the world, where the scale is known."""

import numpy as np

from schemas.crack import Crack, WidthSample
from schemas.mosaic import Mosaic
from tasks.measurement.centreline import Points, simplify
from tasks.measurement.measure import MeasuredCrack

LINE_TOLERANCE_PX = 0.25  # of the polyline that is handed on
SAMPLE_PX = 5.0  # between the width samples that are handed on
WIDEST_QUANTILE = 0.95  # one chipped edge is no width
SCALE_SIGMA = 0.005  # relative, of the ground sample distance, be it ever so well told: relief and lens
END_SIGMA_PX = 5.0  # how well the end of a crack that tapers to nothing can be placed, each end


def crack_of(measured: MeasuredCrack, crack_id: str, mosaic: Mosaic, photo: str | None) -> Crack:
    """The crack's contract; fields in millimetres and metres stay None where the mosaic has no scale."""
    width, sigma = measured.widths.width_px, measured.widths.sigma_px
    line = simplify(measured.centreline, LINE_TOLERANCE_PX)
    median_px, widest_px = float(np.median(width)), float(np.quantile(width, WIDEST_QUANTILE))
    crack = Crack(
        id=crack_id,
        surface=mosaic.name,
        polyline_px=tuple((float(x), float(y)) for x, y in np.round(line, 2)),
        length_px=measured.length_px,
        width_median_px=median_px,
        width_max_px=widest_px,
        width_is_upper_bound=measured.widths.is_upper_bound,
        orientation_deg=measured.orientation_deg,
        photo=photo,
        network=measured.network,
    )
    gsd = mosaic.gsd_mm_px
    if gsd is None:
        return crack
    scale_sigma = float(np.hypot(SCALE_SIGMA, mosaic.scale_sigma or 0.0))
    length_mm = measured.length_px * gsd
    at = np.arange(0, len(width), max(1, round(SAMPLE_PX)))
    middle = np.array([measured.middle_px])
    scaled = {
        "length_mm": length_mm,
        "length_sigma_mm": float(np.hypot(np.sqrt(2) * END_SIGMA_PX * gsd, scale_sigma * length_mm)),
        "width_median_mm": median_px * gsd,
        "width_max_mm": widest_px * gsd,
        "width_sigma_mm": float(np.hypot(np.median(sigma), scale_sigma * median_px)) * gsd,
        "widths": tuple(
            WidthSample(
                s_mm=round(float(measured.along_px[n]) * gsd, 2),
                width_mm=round(float(width[n]) * gsd, 4),
                sigma_mm=round(float(np.hypot(sigma[n], scale_sigma * width[n])) * gsd, 4),
            )
            for n in at
        ),
    }
    if mosaic.surface is not None:
        uv_m = _uv_m(middle, mosaic)
        world = mosaic.surface.to_world(_uv_m(line, mosaic))
        scaled |= {
            "position_uv_m": (float(uv_m[0, 0]), float(uv_m[0, 1])),
            "position_m": tuple(float(n) for n in mosaic.surface.to_world(uv_m)[0]),
            "polyline_world_m": tuple((float(x), float(y), float(z)) for x, y, z in np.round(world, 5)),
        }
    return crack.model_copy(update=scaled)


def _uv_m(points_px: Points, mosaic: Mosaic) -> Points:
    """(N, 2) coordinates in the surface's frame of mosaic pixels: v is up, y down."""
    per_px = (mosaic.gsd_mm_px or 0.0) / 1000.0
    return np.asarray(np.asarray(mosaic.origin_uv_m) + points_px * (per_px, -per_px))
