"""A scene of the simulator: true geometry, how its faces look, and the equipment that looks at it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from threading import Lock

import numpy as np

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin
from schemas.simulation import Marker
from tasks.simulation.crack import CrackShape
from tasks.simulation.face import Face, FaceArrays
from tasks.simulation.light import Daylight, LightMap, light_map
from tasks.simulation.skin import Skin

_baking = Lock()  # two photos at a time may want the same face

INSPECTED_LIGHT_M, OTHER_LIGHT_M = 0.03, 0.15


@dataclass(frozen=True)
class Scene:
    name: str
    seed: int
    faces: tuple[Face, ...]
    inspected: tuple[str, ...]  # names of the faces that carry cracks
    cracks: dict[str, tuple[CrackShape, ...]]  # by face
    markers: tuple[Marker, ...]
    bake: Callable[[Face], Skin]
    daylight: Daylight
    camera: Camera  # as calibrated: what the inspection is told
    gsd_mm_px: float  # that the photos are planned for
    stations_m: tuple[Vector3, ...] = ()  # of the laser scanner
    curved: tuple[str, ...] = ()  # parts whose faces, named part-…, are facets of one curved surface
    origin: GeoOrigin | None = None
    gain: float | None = None  # a locked exposure; None: automatic

    @cached_property
    def arrays(self) -> FaceArrays:
        return FaceArrays.of(self.faces)

    @cached_property
    def true_camera(self) -> Camera:
        """What the camera truly is: no calibration is perfect."""
        rng = np.random.default_rng([self.seed, 0x43616D])
        cx, cy = self.camera.principal_px
        return self.camera.model_copy(
            update={
                "focal_px": self.camera.focal_px * (1.0 + float(rng.normal(0.0, 5e-4))),
                "cx_px": cx + float(rng.normal(0.0, 1.0)),
                "cy_px": cy + float(rng.normal(0.0, 1.0)),
                "k1": self.camera.k1 + float(rng.normal(0.0, 2e-3)),
            }
        )

    def face(self, name: str) -> Face:
        return next(f for f in self.faces if f.name == name)

    @cached_property
    def _looks(self) -> dict[int, tuple[Skin, LightMap]]:
        return {}

    def look(self, index: int) -> tuple[Skin, LightMap]:
        """Skin of a face and the light on it, made when first seen."""
        with _baking:
            return self._look(index)

    def _look(self, index: int) -> tuple[Skin, LightMap]:
        if index not in self._looks:
            face = self.faces[index]
            texel_m = INSPECTED_LIGHT_M if face.name in self.inspected else OTHER_LIGHT_M
            if min(face.width_m, face.height_m) > 5.0:
                texel_m *= 4
            light = light_map(face, self.arrays, self.daylight, texel_m)
            self._looks[index] = (self.bake(face), light)
        return self._looks[index]
