"""How a lens bends rays: Brown's model for ordinary lenses, Kannala and Brandt's for fisheyes.

Image coordinates are normalised: (0, 0) is the principal point, 1 is one focal length. Ideal ones are where a
pinhole would show a ray, (x/z, y/z); distorted ones where the lens shows it. Coefficients are OpenCV's.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

STEPS = 30  # of Newton's method; a real lens takes four to six
EXACT = 1e-13  # in normalised coordinates: far below a thousandth of a pixel
STEEPEST_RAD = np.radians(89.0)  # off the axis: beyond, a ray has no place in an ideal image


class Distortion(Protocol):
    def distort(self, xy: Array) -> Array:
        """(N, 2) distorted from (N, 2) ideal coordinates."""

    def undistort(self, xy: Array) -> Array:
        """(N, 2) ideal from (N, 2) distorted coordinates; NaN where the lens sends no ray."""

    def slope(self, xy: Array) -> Array:
        """(N, 2, 2) of the distorted by the ideal coordinates, at (N, 2) ideal ones."""

    def by_k1(self, xy: Array) -> Array:
        """(N, 2) of the distorted coordinates by k1."""


@dataclass(frozen=True)
class Brown:
    """x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²), and alike for y (Brown 1971)."""

    k1: float
    k2: float
    p1: float
    p2: float
    k3: float

    def distort(self, xy: Array) -> Array:
        x, y = xy.T
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return np.column_stack(
            [
                x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x),
                y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y,
            ]
        )

    def undistort(self, xy: Array) -> Array:
        """By Newton's method from the distorted place, which for a lens that bends one way comes from one
        side and never passes the answer."""
        if not any((self.k1, self.k2, self.p1, self.p2, self.k3)):
            return xy.copy()
        ideal = xy.copy()
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                missing = xy - self.distort(ideal)
                step = _solved(self.slope(ideal), missing)
                ideal = ideal + step
                if not np.nanmax(np.abs(step), initial=0.0) > EXACT:
                    break
            slope = self.slope(ideal)  # symmetric
            folded = ~((np.linalg.det(slope) > 0) & (np.trace(slope, axis1=1, axis2=2) > 0))
            off = ~(np.abs(xy - self.distort(ideal)).max(axis=1) < 1e3 * EXACT)
        ideal[folded | off] = np.nan
        return ideal

    def slope(self, xy: Array) -> Array:
        x, y = xy.T
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        bend = 2 * (self.k1 + r2 * (2 * self.k2 + 3 * r2 * self.k3))  # of radial by x, over x
        slope = np.empty((len(x), 2, 2))
        slope[:, 0, 0] = radial + x * x * bend + 2 * self.p1 * y + 6 * self.p2 * x
        slope[:, 0, 1] = slope[:, 1, 0] = x * y * bend + 2 * self.p1 * x + 2 * self.p2 * y
        slope[:, 1, 1] = radial + y * y * bend + 6 * self.p1 * y + 2 * self.p2 * x
        return slope

    def by_k1(self, xy: Array) -> Array:
        return np.asarray(xy * (xy**2).sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Fisheye:
    """A ray θ off the axis lies θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) from the principal point
    (Kannala & Brandt 2006)."""

    k1: float
    k2: float
    k3: float
    k4: float

    def distort(self, xy: Array) -> Array:
        r = np.hypot(*xy.T)
        return np.asarray(xy * self._shrink(r)[:, None])

    def undistort(self, xy: Array) -> Array:
        """By Newton's method on the angle alone."""
        reach = np.hypot(*xy.T)
        theta = reach.copy()
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                step = (self._bent(theta) - reach) / self._bent_slope(theta)
                theta = theta - step
                if not np.nanmax(np.abs(step), initial=0.0) > EXACT:
                    break
            seen = (np.abs(self._bent(theta) - reach) < 1e3 * EXACT) & (self._bent_slope(theta) > 0)
            seen &= (theta >= 0) & (theta < STEEPEST_RAD)
            stretch = np.where(reach > 0, np.tan(theta) / np.where(reach > 0, reach, 1.0), 1.0)
        return np.asarray(xy * np.where(seen, stretch, np.nan)[:, None])

    def slope(self, xy: Array) -> Array:
        r2 = (xy**2).sum(axis=1)
        r = np.sqrt(r2)
        shrink = self._shrink(r)
        theta = np.arctan(r)
        near = r < 1e-4  # there the quotient loses its digits, and its limit is good to 1e-8
        safe = np.where(near, 1.0, r2)
        bend = np.where(
            near, 2 * (self.k1 - 1 / 3), (self._bent_slope(theta) / (1 + r2) - shrink) / safe
        )  # of shrink by r, over r
        return np.asarray(
            shrink[:, None, None] * np.eye(2) + bend[:, None, None] * xy[:, :, None] * xy[:, None, :]
        )

    def by_k1(self, xy: Array) -> Array:
        r = np.hypot(*xy.T)
        return np.asarray(xy * (np.arctan(r) ** 3 / np.where(r > 0, r, 1.0))[:, None])

    def _bent(self, theta: Array) -> Array:
        t2 = theta * theta
        return np.asarray(theta * (1 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4)))))

    def _bent_slope(self, theta: Array) -> Array:
        t2 = theta * theta
        return np.asarray(1 + t2 * (3 * self.k1 + t2 * (5 * self.k2 + t2 * (7 * self.k3 + t2 * 9 * self.k4))))

    def _shrink(self, r: Array) -> Array:
        """Distorted over ideal distance from the principal point."""
        return np.where(r > 1e-12, self._bent(np.arctan(r)) / np.where(r > 1e-12, r, 1.0), 1.0)


def _solved(slopes: Array, sides: Array) -> Array:
    """(N, 2) x of (N, 2, 2) A x = b (N, 2); infinite or NaN where A is singular."""
    (a, b), (c, d) = np.moveaxis(slopes, 0, -1)
    p, q = sides.T
    return np.asarray(np.column_stack([d * p - b * q, a * q - c * p]) / (a * d - b * c)[:, None])
