"""Surfaces and obstacles of a structure: what planning needs to know about the world."""

from schemas.contract import Contract, Vector3
from schemas.file import File
from schemas.obstacle import Obstacle
from schemas.problem import LeftOut
from schemas.surface import Surface


class Structure(Contract):
    surfaces: tuple[Surface, ...]
    obstacles: tuple[Obstacle, ...]
    occupied: File  # PLY, float32 metres: every point that a vehicle must not meet, voxelised
    min_m: Vector3  # extent of the scanned world
    max_m: Vector3
    stations_m: tuple[Vector3, ...] = ()  # where scanners stood; none where that is not known
    left_out: tuple[LeftOut, ...] = ()
