"""Where a laser scanner looked, and where it did not."""

from schemas.contract import Contract, Vector2


class ScanWindow(Contract):
    """Directions in the world, degrees. The default is all of them."""

    blind_deg: tuple[Vector2, ...] = ()  # from, to: azimuths counter-clockwise from east, 0 to below 360
    lowest_deg: float = -90.0  # elevations
    highest_deg: float = 90.0
