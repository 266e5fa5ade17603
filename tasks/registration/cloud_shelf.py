"""Clouds on disk: fifty stations do not fit into memory at once, the few at work do."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tasks.registration.station_cloud import Cloud

MOST_POINTS = 10_000_000  # in memory; with their search tree about 100 bytes each


class Shelf:
    """Keeps clouds in files of a folder, and those last used in memory too."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._at_hand: dict[int, Cloud] = {}  # the last used one last
        self._count = 0

    def put(self, cloud: Cloud) -> "Shelved":
        number, self._count = self._count, self._count + 1
        np.save(self._path(number), np.stack([cloud.points_m, cloud.normals]))
        self._keep(number, cloud)
        return Shelved(self, number, len(cloud))

    def take(self, number: int) -> Cloud:
        cloud = self._at_hand.pop(number, None)
        if cloud is None:
            points_m, normals = np.load(self._path(number))
            cloud = Cloud(points_m, normals)
        self._keep(number, cloud)
        return cloud

    def _keep(self, number: int, cloud: Cloud) -> None:
        self._at_hand[number] = cloud
        while len(self._at_hand) > 1 and sum(map(len, self._at_hand.values())) > MOST_POINTS:
            del self._at_hand[next(iter(self._at_hand))]

    def _path(self, number: int) -> Path:
        return self._folder / f"cloud-{number}.npy"


@dataclass(frozen=True)
class Shelved:
    shelf: Shelf
    number: int
    points: int

    def cloud(self) -> Cloud:
        return self.shelf.take(self.number)
