"""Light that each photosite gathers: the scene seen through a lens by a moving camera.

Each photosite looks through its own colour filter only. Its value is the mean over samples spread over its
area, the lens's blur and the motion during the exposure. Plain places take SAMPLES samples, places with
sharp marks or edges FINE_SAMPLES. Rows are exposed one after the other (rolling shutter).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numba
import numpy as np
import numpy.typing as npt
from scipy.special import erf

from schemas.camera import Camera, CameraPose
from tasks.simulation.face import Array, FaceArrays
from tasks.simulation.light import LightMap
from tasks.simulation.marks import CELL_M
from tasks.simulation.raycast import cast, first_hit
from tasks.simulation.skin import Skin

Floats = npt.NDArray[np.float32]

SAMPLES = 13
FINE_SAMPLES = 55
BLUR_SIGMA_PX = 0.55  # of the lens in the middle of the image, beside the photosite's own area
CORNER_BLUR = 0.25  # grows by this share towards the corners
READOUT_S = 0.015  # of a small drone's camera
SKY_RADIANCE = 0.8
COARSE_PX = 16  # grid of the rays that find out which faces a photo shows
GRAIN_SECOND = 1.27  # scale of the grain's second, turned layer
GRAIN_SHARE = 0.7 / 127.0  # relative brightness of a count; two layers of 0.7 add up to one
TEXELS = 4194304.0  # a multiple of the tile, so that indices are positive


@dataclass(frozen=True)
class Motion:
    """During the exposure: velocity in the world, turning about the camera's axes."""

    velocity_m_s: Array  # (3,)
    turn_rad_s: Array  # (3,) right-handed about x right, y down, z forward
    readout_s: float = READOUT_S  # from the first row's exposure to the last one's; 0: a global shutter

    def rows_s(self, camera: Camera) -> Array:
        """(height,) when each row is exposed, the middle one at 0."""
        return np.asarray((np.arange(camera.height_px) / camera.height_px - 0.5) * self.readout_s)


@lru_cache(maxsize=4)
def _rays(camera: Camera) -> Array:
    """(height + 1, width + 1, 2) ideal image coordinates of every pixel centre and one beyond."""
    x, y = np.meshgrid(np.arange(camera.width_px + 1.0), np.arange(camera.height_px + 1.0))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    ideal = camera.undistort((pixels - camera.principal_px) / camera.focal_px)
    return np.ascontiguousarray(ideal.reshape(camera.height_px + 1, camera.width_px + 1, 2))


@lru_cache(maxsize=4)
def spread(count: int) -> Array:
    """(count, 3): x, y in pixels of points distributed as a photosite's area blurred by the lens, and the
    instant in −½..½ of the exposure. A Fibonacci lattice through the inverse of that distribution."""
    grid = np.linspace(-4, 4, 8001)
    s = BLUR_SIGMA_PX * np.sqrt(2)
    density = erf((grid + 0.5) / s) - erf((grid - 0.5) / s)
    share = np.cumsum(density) / density.sum()
    step, turn = {SAMPLES: (8, 6), FINE_SAMPLES: (34, 32)}[count]  # Fibonacci: well spread for these
    k = np.arange(count)
    variance = BLUR_SIGMA_PX**2 + 1 / 12  # midpoints of equal shares lose some of it
    first = np.interp((k + 0.5) / count, share, grid)
    first *= np.sqrt(variance / first.var())
    return np.column_stack([first, first[(k * step) % count], ((k * turn) % count + 0.5) / count - 0.5])


@numba.njit(cache=True, nogil=True)
def _marked(u, v, shapes_from, shapes_to, items, kind, paint, p, rgb, channel):  # type: ignore[no-untyped-def]
    """(share of the surface's own brightness, colour instead of it) at one point."""
    own, colour, line = 1.0, 0.0, 1.0
    for k in range(shapes_from, shapes_to):
        i = items[k]
        if kind[i] == 0:
            du, dv = p[i, 2] - p[i, 0], p[i, 3] - p[i, 1]
            length2 = du * du + dv * dv
            t = ((u - p[i, 0]) * du + (v - p[i, 1]) * dv) / length2
            if t < -0.02 or t > 1.02:
                continue
            d = (du * (v - p[i, 1]) - dv * (u - p[i, 0])) / math.sqrt(length2)  # left is positive
            left = p[i, 4] + t * (p[i, 6] - p[i, 4])
            right = p[i, 5] + t * (p[i, 7] - p[i, 5])
            if -right < d < left and rgb[i, channel] < line:
                line = rgb[i, channel]
            continue
        if kind[i] == 1:
            inside = (u - p[i, 0]) ** 2 + (v - p[i, 1]) ** 2 < p[i, 2] ** 2
        else:
            a = (u - p[i, 0]) * p[i, 2] + (v - p[i, 1]) * p[i, 3]
            b = (v - p[i, 1]) * p[i, 2] - (u - p[i, 0]) * p[i, 3]
            inside = abs(a) < p[i, 4] and abs(b) < p[i, 5]
        if inside:
            if paint[i] == 1:
                own, colour = 0.0, rgb[i, channel]
            else:
                own *= rgb[i, channel]
                colour *= rgb[i, channel]
    return own * line, colour * line


@numba.njit(cache=True, nogil=True, inline="always")
def _bilinear(grid, r, c):  # type: ignore[no-untyped-def]
    r = min(max(r, 0.0), grid.shape[0] - 1.001)
    c = min(max(c, 0.0), grid.shape[1] - 1.001)
    r0, c0 = int(r), int(c)
    fr, fc = r - r0, c - c0
    return (grid[r0, c0] * (1 - fc) + grid[r0, c0 + 1] * fc) * (1 - fr) + (
        grid[r0 + 1, c0] * (1 - fc) + grid[r0 + 1, c0 + 1] * fc
    ) * fr


@numba.njit(cache=True, nogil=True)
def _owners(rays, R, position, origin, u, v, normal, size):  # type: ignore[no-untyped-def]
    """(height, width) index of the face that each pixel's own ray meets first, −1 for the sky."""
    height, width = rays.shape[0] - 1, rays.shape[1] - 1
    owner = np.empty((height, width), np.int16)
    for y in range(height):
        W, c = R[y], position[y]
        for x in range(width):
            a, b = rays[y, x, 0], rays[y, x, 1]
            owner[y, x], _ = first_hit(
                c[0], c[1], c[2],
                W[0, 0] * a + W[0, 1] * b + W[0, 2],
                W[1, 0] * a + W[1, 1] * b + W[1, 2],
                W[2, 0] * a + W[2, 1] * b + W[2, 2],
                origin, u, v, normal, size,
            )  # fmt: skip
    return owner


@numba.njit(cache=True, nogil=True)
def _sample_owners(ys, xs, points, wide, rays, R, position, origin, u, v, normal, size):  # type: ignore[no-untyped-def]
    """(n, len(points)): which face each sample of the pixels (ys, xs) meets first."""
    owner = np.empty((len(ys), len(points)), np.int16)
    for n in range(len(ys)):
        y, x = ys[n], xs[n]
        W, c = R[y], position[y]
        for k in range(len(points)):
            ox, oy = points[k, 0] * wide[y, x], points[k, 1] * wide[y, x]
            a = rays[y, x, 0] + ox * (rays[y, x + 1, 0] - rays[y, x, 0])
            b = rays[y, x, 1] + oy * (rays[y + 1, x, 1] - rays[y, x, 1])
            owner[n, k], _ = first_hit(
                c[0], c[1], c[2],
                W[0, 0] * a + W[0, 1] * b + W[0, 2],
                W[1, 0] * a + W[1, 1] * b + W[1, 2],
                W[2, 0] * a + W[2, 1] * b + W[2, 2],
                origin, u, v, normal, size,
            )  # fmt: skip
    return owner


@numba.njit(cache=True, nogil=True)
def _onto_relief(uv, o, relief, texel):  # type: ignore[no-untyped-def]
    """Move the point where a ray from `o` meets the flat face to where it meets the relief, in place; the
    relief is low and gentle against the ray, so that looking up its height again and again arrives."""
    u, v = uv[0], uv[1]
    for _ in range(6):
        rise = _bilinear(relief, uv[1] / texel, uv[0] / texel) / o[2]
        uv[0], uv[1] = u + rise * (o[0] - u), v + rise * (o[1] - v)


@numba.njit(cache=True, nogil=True)
def _expose_face(  # type: ignore[no-untyped-def]
    light_sum, share, owner, edge, edge_owner, me, size, rays, offset, turned, wide, turn, drift, coarse,
    fine, tone, texel, relief, relief_texel, light, light_texel, grain, grain_texel, cos_turn, sin_turn,
    columns, rows, start, items, kind, paint, p, rgb,
):  # fmt: skip
    """Add what face `me` sends to each photosite to `light_sum`, and the share of its samples to `share`.

    edge: (height, width) −1, or a pixel's row in edge_owner, which says what each of its samples meets.
    offset: (height, 3) camera in the face's frame, turned: (height, 3, 3) its axes there, per image row.
    turn: pixels that the image turns, drift: metres that the camera moves in the face's frame, while exposed.
    """
    height, width = owner.shape
    mask = len(grain) - 1
    per_m = 1.0 / grain_texel
    cos_second, sin_second = cos_turn * per_m / GRAIN_SECOND, sin_turn * per_m / GRAIN_SECOND
    uv = np.empty((3, 2))
    for y in range(height):
        T, o = turned[y], offset[y]
        for x in range(width):
            at_edge = edge[y, x] >= 0
            if not at_edge and owner[y, x] != me:
                continue
            channel = 0 if (y % 2 == 0 and x % 2 == 0) else (2 if (y % 2 == 1 and x % 2 == 1) else 1)
            ahead = True
            for k in range(3):  # this pixel, its right and its lower neighbour
                a, b = rays[y + (k == 2), x + (k == 1), 0], rays[y + (k == 2), x + (k == 1), 1]
                down = T[2, 0] * a + T[2, 1] * b + T[2, 2]
                ahead = ahead and down * o[2] < -1e-4 * abs(o[2])
                reach = -o[2] / down if ahead else 0.0
                uv[k, 0] = o[0] + reach * (T[0, 0] * a + T[0, 1] * b + T[0, 2])
                uv[k, 1] = o[1] + reach * (T[1, 0] * a + T[1, 1] * b + T[1, 2])
                if relief.shape[0] > 0 and ahead:
                    _onto_relief(uv[k], o, relief, relief_texel)
            if not ahead:
                continue
            u0, v0 = uv[0, 0], uv[0, 1]
            jux, jvx, juy, jvy = uv[1, 0] - u0, uv[1, 1] - v0, uv[2, 0] - u0, uv[2, 1] - v0
            mu = drift[0] + drift[2] * (u0 - o[0]) / o[2] + turn[0] * jux + turn[1] * juy
            mv = drift[1] + drift[2] * (v0 - o[1]) / o[2] + turn[0] * jvx + turn[1] * jvy
            u0, v0 = min(max(u0, -1.0), size[0] + 1.0), min(max(v0, -1.0), size[1] + 1.0)
            cell = -1
            if len(items) > 0:
                cx = min(max(int(u0 / CELL_M), 0), columns - 1)
                cy = min(max(int(v0 / CELL_M), 0), rows - 1)
                cell = cy * columns + cx
                if start[cell] == start[cell + 1]:
                    cell = -1
            points = fine if (cell >= 0 or at_edge) else coarse
            own_sum, colour_sum, counted = 0.0, 0.0, 0
            for k in range(len(points)):
                if at_edge and edge_owner[edge[y, x], k] != me:
                    continue
                counted += 1
                ox, oy, when = points[k, 0] * wide[y, x], points[k, 1] * wide[y, x], points[k, 2]
                u = u0 + ox * jux + oy * juy + when * mu
                v = v0 + ox * jvx + oy * jvy + when * mv
                first = grain[int(v * per_m + TEXELS) & mask, int(u * per_m + TEXELS) & mask]
                turned_u, turned_v = cos_second * u + sin_second * v, cos_second * v - sin_second * u
                second = grain[int(turned_v + TEXELS) & mask, int(turned_u + TEXELS) & mask]
                rough = 1.0 + GRAIN_SHARE * (first + second)
                if cell >= 0:
                    own, colour = _marked(
                        u, v, start[cell], start[cell + 1], items, kind, paint, p, rgb, channel
                    )
                    own_sum += own * rough
                    colour_sum += colour
                else:
                    own_sum += rough
            n = len(points)
            shade = _bilinear(light, v0 / light_texel, u0 / light_texel)
            reflected = own_sum / n * _bilinear(tone[:, :, channel], v0 / texel, u0 / texel)
            light_sum[y, x] += shade * (reflected + colour_sum / n)
            share[y, x] += counted / n


def expose(
    camera: Camera,
    pose: CameraPose,
    motion: Motion,
    faces: FaceArrays,
    look: Callable[[int], tuple[Skin, LightMap]],
) -> Floats:
    """(height, width) float32 of linear light behind an RGGB filter, before any exposure setting.

    look(index) gives the skin of a face and the light on it."""
    rays = _rays(camera)
    rows_s = motion.rows_s(camera)
    position = np.asarray(pose.position_m) + rows_s[:, None] * motion.velocity_m_s
    R = pose.R_world_camera @ (np.eye(3) + rows_s[:, None, None] * _cross(motion.turn_rad_s))
    seen = visible_faces(camera, pose, faces)
    near = faces[seen]
    arrays = (near.origin, near.u, near.v, near.normal, near.size)
    owner = _owners(rays, R, position, *arrays)
    square = np.ones((5, 5), np.uint8)
    edges = cv2.dilate(owner, square) != cv2.erode(owner, square)
    ys, xs = np.nonzero(edges)
    edge = np.full(owner.shape, -1, np.int32)
    edge[ys, xs] = np.arange(len(ys))
    coarse, fine, wide = spread(SAMPLES), spread(FINE_SAMPLES), _blur(camera)
    edge_owner = _sample_owners(ys, xs, fine, wide, rays, R, position, *arrays)
    light_sum, share = (np.zeros(owner.shape, np.float32) for _ in range(2))
    share[ys, xs] = (edge_owner < 0).mean(axis=1)
    share[~edges & (owner < 0)] = 1.0
    light_sum += share * SKY_RADIANCE
    turn = motion.turn_rad_s[[1, 0]] * (1, -1) * camera.focal_px * camera.shutter_s
    for me, index in enumerate(seen):
        skin, light = look(int(index))
        axes = np.stack([near.u[me], near.v[me], near.normal[me]])
        marks, angle = skin.marks, np.radians(skin.turn_deg)
        _expose_face(
            light_sum, share, owner, edge, edge_owner, me, near.size[me], rays,
            (position - near.origin[me]) @ axes.T, axes @ R, wide,
            turn, axes @ motion.velocity_m_s * camera.shutter_s, coarse, fine,
            skin.tone, skin.texel_m, skin.relief_m, skin.relief_texel_m,
            light.irradiance, light.texel_m, skin.grain, skin.grain_texel_m,
            np.cos(angle), np.sin(angle), marks.columns, marks.rows, marks.start, marks.items,
            marks.kind, marks.paint, marks.p, marks.rgb,
        )  # fmt: skip
    return np.asarray(light_sum / np.maximum(share, 1e-3), dtype=np.float32)


def visible_faces(camera: Camera, pose: CameraPose, faces: FaceArrays) -> npt.NDArray[np.int64]:
    """Indices of the faces that a grid of rays, COARSE_PX apart, meets first."""
    rays = _rays(camera)
    rows = np.unique(np.r_[np.arange(0, camera.height_px, COARSE_PX), camera.height_px - 1])
    columns = np.unique(np.r_[np.arange(0, camera.width_px, COARSE_PX), camera.width_px - 1])
    xy = rays[rows][:, columns].reshape(-1, 2)
    directions = np.column_stack([xy, np.ones(len(xy))]) @ pose.R_world_camera.T
    index, _ = cast(pose.position_m, directions, faces)
    return np.unique(index[index >= 0]).astype(np.int64)


@lru_cache(maxsize=4)
def _blur(camera: Camera) -> Floats:
    """(height, width): factor on the spread of a photosite's samples, 1 in the middle."""
    y, x = np.mgrid[: camera.height_px, : camera.width_px].astype(np.float32)
    cx, cy = camera.principal_px
    r2 = ((x - cx) ** 2 + (y - cy) ** 2) / (cx * cx + cy * cy)
    return np.asarray(1.0 + CORNER_BLUR * r2, dtype=np.float32)


def _cross(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
