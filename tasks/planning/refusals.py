"""What a plan that cannot be says, and what would make it possible."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from schemas.contract import Vector3
from schemas.flight_plan import SurfaceCoverage
from schemas.problem import BadInput, LeftOut
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import Block
from tasks.planning.viewpoints import NO_FLY, OUTSIDE, UNSEEN, Views

SHORT = 0.9  # less of a surface covered than this is said
SHORT_TWICE = 0.97  # and less of what can be reached, by two photos, in 95 of 100 flights

REMEDIES = {
    "gimbal": "allow a wider gimbal range or a larger plan.max_incidence_deg",
    "closer": "lower vehicle.radius_m, vehicle.clearance_m or the position error (RTK), or ask for a coarser"
    " plan.gsd_mm_px",
    UNSEEN: "scan from more places, or state air that is free in plan.free_m (hairline plan --free)",
    OUTSIDE: "widen plan.fence_m so that it holds the shooting points with the margin",
    NO_FLY: "make plan.no_fly_m smaller",
    "lower": "lower plan.min_altitude_m",
    "higher": "raise plan.max_altitude_m",
    "hidden": "allow a larger plan.max_incidence_deg, or photograph it by hand",
}


def nothing_to_shoot(found: dict[str, Views], airspace: Airspace) -> BadInput:
    why = sum((each.refused for each in found.values()), Counter())
    told = (
        "; ".join(f"{count} × {reason}" for reason, count in why.most_common(3)) or "no free way leads there"
    )
    helps = [text for reason, _ in why.most_common(3) for key, text in REMEDIES.items() if key in reason]
    places = np.array([place for each in found.values() for place in each.wanted_m])
    box = ""
    if any(OUTSIDE in reason for reason in why) and airspace.allowed is not None:
        grown = airspace.allowed.margin_m + 2 * airspace.allowed.voxel_m
        low, high = places.min(axis=0) - grown, places.max(axis=0) + grown
        box = f" They lie within east {low[0]:.0f} to {high[0]:.0f} m, north {low[1]:.0f} to {high[1]:.0f} m."
    remedy = "; or ".join(helps) or "Give another home_m."
    return BadInput(
        "plan.fence_m" if box else "plan",
        f"none of the shooting points can be flown: {told}",
        remedy[0].upper() + remedy[1:] + "." + box,
    )


def no_way(home_m: Vector3, airspace: Airspace) -> BadInput:
    return BadInput(
        "home_m",
        f"no way leads from ({home_m[0]:g}, {home_m[1]:g}, {home_m[2]:g}) to any shooting point"
        f" {airspace.inflation_m:.2f} m away from everything",
        "Give another home_m, state more free air in plan.free_m, or lower vehicle.clearance_m or the"
        " position error.",
    )


def no_way_up(home_m: Vector3, block: Block, airspace: Airspace) -> BadInput:
    elsewhere = "Give a place on open ground, or leave home_m out and one is found."
    near = f"something is closer than {airspace.inflation_m:.2f} m (radius, clearance and position error)"
    why, remedy = {
        Block.LOW: ("all above it is lower than plan.min_altitude_m", "Lower plan.min_altitude_m."),
        Block.HIGH: ("all above it is higher than plan.max_altitude_m", "Raise plan.max_altitude_m."),
        Block.UNKNOWN: (
            "it leads through or beside air that no scanner saw",
            "Where you see that it is free, state it in plan.free_m (hairline plan --free), or give another"
            " home_m.",
        ),
        Block.FENCE: (f"it is {OUTSIDE}", "Give another home_m, or widen plan.fence_m."),
        Block.NO_FLY: (f"it is {NO_FLY}", "Give another home_m, or make plan.no_fly_m smaller."),
    }.get(block, (near, elsewhere))
    at = f"({home_m[0]:g}, {home_m[1]:g}, {home_m[2]:g})"
    return BadInput("home_m", f"there is no free way up from {at}: {why}", remedy)


def left_out(coverage: Sequence[SurfaceCoverage]) -> tuple[LeftOut, ...]:
    """Surfaces that are not seen whole, or not surely twice."""
    items = [
        LeftOut(
            item=c.surface,
            stage="planning",
            what=f"only {c.covered:.0%} of it will be seen: {'; '.join(c.not_reached)}",
            remedy="Photograph the rest by hand, or change vehicle, gimbal, clearance or GSD.",
        )
        for c in coverage
        if c.covered < SHORT
    ]
    items += [
        LeftOut(
            item=c.surface,
            stage="planning",
            what=f"with this position error, one flight of twenty shows less than {c.twice_p05:.0%} of what"
            " can be reached in two photos",
            remedy="Raise plan.overlap, or position more exactly (RTK).",
        )
        for c in coverage
        if c.covered >= SHORT and c.twice_p05 is not None and c.twice_p05 < SHORT_TWICE
    ]
    return tuple(items)
