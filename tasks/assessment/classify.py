"""What kind of crack it is, and how severe."""

from collections import Counter

from schemas.crack import Crack
from schemas.settings import AssessSettings
from schemas.surface import Surface

ALONG_DEG = 22.5  # of the member's axis: longitudinal; of the direction across it: transverse
MAP_BRANCHES = 4  # so many joined cracks are a net
MAP_SPREAD_DEG = 45.0  # whose directions differ by this much


def classified(
    cracks: tuple[Crack, ...], surface: Surface | None, settings: AssessSettings
) -> tuple[Crack, ...]:
    """The cracks of one surface with their kind and, where the scale is known, their severity."""
    axis_deg = member_axis_deg(surface)
    nets = map_networks(cracks)
    return tuple(
        crack.model_copy(
            update={
                "kind": "map" if crack.network in nets else kind(crack.orientation_deg, axis_deg),
                "severity": severity(crack.width_max_mm, settings),
            }
        )
        for crack in cracks
    )


def member_axis_deg(surface: Surface | None) -> float:
    """Direction of the member's long side: 0 along the surface's u, 90 along its v; u where unknown."""
    if surface is None:
        return 0.0
    u0, v0, u1, v1 = surface.bounds_m
    return 90.0 if v1 - v0 > u1 - u0 else 0.0


def kind(orientation_deg: float, axis_deg: float) -> str:
    """Longitudinal, transverse or diagonal to the member's axis."""
    away = angle_between_deg(orientation_deg, axis_deg)
    if away <= ALONG_DEG:
        return "longitudinal"
    return "transverse" if away >= 90.0 - ALONG_DEG else "diagonal"


def severity(width_mm: float | None, settings: AssessSettings) -> str | None:
    """By the crack's largest width (an upper bound counts as the width: the safe side)."""
    if width_mm is None:
        return None
    limits = ((settings.fine_mm, "hairline"), (settings.medium_mm, "fine"), (settings.wide_mm, "medium"))
    return next((name for limit, name in limits if width_mm < limit), "wide")


def map_networks(cracks: tuple[Crack, ...]) -> frozenset[int]:
    """Networks of many joined cracks in many directions."""
    joined = Counter(crack.network for crack in cracks)
    return frozenset(
        network
        for network, count in joined.items()
        if count >= MAP_BRANCHES and _spread_deg(network, cracks) >= MAP_SPREAD_DEG
    )


def angle_between_deg(a_deg: float, b_deg: float) -> float:
    """Between two undirected lines, 0..90."""
    apart = abs(a_deg - b_deg) % 180.0
    return min(apart, 180.0 - apart)


def _spread_deg(network: int, cracks: tuple[Crack, ...]) -> float:
    directions = [crack.orientation_deg for crack in cracks if crack.network == network]
    return max(angle_between_deg(a, b) for a in directions for b in directions)
