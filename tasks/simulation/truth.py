"""What is true of a scene, written beside its photos for whoever keeps the score."""

import numpy as np

from schemas.simulation import TrueCrack, Truth
from tasks.simulation.crack import CrackShape
from tasks.simulation.face import Face, vector
from tasks.simulation.scene import Scene


def truth(scene: Scene) -> Truth:
    faces = [scene.face(name) for name in scene.inspected]
    return Truth(
        scene=scene.name,
        seed=scene.seed,
        gsd_mm_px=scene.gsd_mm_px,
        camera=scene.true_camera,
        surfaces=tuple(f.surface() for f in faces),
        cracks=tuple(true_crack(c, f) for f in faces for c in scene.cracks[f.name]),
        markers=scene.markers,
        stations_m=scene.stations_m,
    )


def true_crack(crack: CrackShape, face: Face) -> TrueCrack:
    uv, width_m = crack.sampled()
    world = face.to_world(uv)
    in_surface = face.surface().to_surface(world)[:, :2]
    return TrueCrack(
        id=crack.id,
        parent=crack.parent,
        surface=face.name,
        polyline_uv_m=tuple((float(u), float(v)) for u, v in np.round(in_surface, 6)),
        polyline_world_m=tuple(vector(p) for p in np.round(world, 6)),
        widths_mm=tuple(float(w) for w in np.round(1e3 * width_m, 4)),
        length_mm=round(1e3 * crack.length_m, 3),
    )
