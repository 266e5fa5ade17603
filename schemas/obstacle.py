"""What is left of the cloud when the surfaces are out: things not to fly into (paper, eq. 2)."""

from schemas.contract import Contract, Vector3


class Obstacle(Contract):
    name: str
    points: int
    min_m: Vector3  # axis-aligned extent in the world
    max_m: Vector3
    hull_m: tuple[Vector3, ...]  # vertices of the convex hull (or its points where it is flat)
