"""Whether a scan fits in one place only. Structures repeat themselves: beside each of eleven equal piers a
scan of three of them fits as well, to the millimetre, and nothing in the fit itself says which it was."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import Cloud
from tasks.registration.world_frame import AGREE_M

STATED_M = 2.0  # around a measured position a station is looked for, and found there as it was measured
MOST_SEEN_THROUGH = 0.11  # see visibility.contradiction
MOST_AS_STATED = 0.3  # where it came to stand as it was measured: traffic between scans, not a wrong place
LEAST_ON = 0.25  # of a scan lies on another where nothing was in sight; of unrelated ones less, or all over
AS_CLOSE = 3.0  # times as far off surfaces may be where like parts are met; unlike ones are 3.5 and more
AS_FREE = 10.0  # times the doubt and more, by something that stands in one of the two places only
SPREAD_POINTS = 100  # of a cloud tell how far apart two of its places are


@dataclass(frozen=True, eq=False)
class Fit:
    """A place where the scan meets those placed before."""

    T_frame_local: Array
    rmse_m: float  # of the surfaces that meet
    share_on: float | None  # of all surfaces, those that meet; None where sight lines or a statement judge
    seen_through: float | None  # see visibility.contradiction
    doubt: float  # see visibility.doubt
    off_m: float  # from where the crew measured the scanner; infinity where it did not

    @property
    def as_stated(self) -> bool:
        return self.off_m < STATED_M

    @property
    def settled(self) -> bool:
        """No other place need be looked for."""
        return self.as_stated and (self.seen_through or 0.0) < MOST_SEEN_THROUGH

    @property
    def possible(self) -> bool:
        return (self.seen_through or 0.0) < (MOST_AS_STATED if self.as_stated else MOST_SEEN_THROUGH)

    @property
    def borne_out(self) -> bool:
        """Whether more than chance says that the scan is there."""
        return self.share_on is None or self.share_on >= LEAST_ON

    @property
    def misfit_m(self) -> float:
        """How far off surfaces are; without sight lines, those beside the others count too."""
        if self.share_on is None:
            return self.rmse_m
        return self.rmse_m * (1 - self.share_on) / max(self.share_on, 1e-3)

    @property
    def strays(self) -> int:
        """From what was stated: 0 agrees, 1 may be meant, 2 is elsewhere or nothing was stated."""
        return (self.off_m >= AGREE_M) + (self.off_m >= STATED_M)


def least_contradicted(fits: Sequence[Fit]) -> Fit | None:
    """The best of the possible fits, one as stated before all others; None where there is none."""
    possible = [fit for fit in fits if fit.possible]
    settled = [fit for fit in possible if fit.settled]
    if settled:
        return min(settled, key=lambda fit: (fit.strays, fit.doubt, fit.misfit_m))
    return min(possible, key=lambda fit: (fit.doubt, fit.misfit_m), default=None)


def rivals(best: Fit, fits: Sequence[Fit], cloud: Cloud, reach_m: float) -> dict[Fit, float]:
    """The places where the scan may stand as well, each once, and how far they are from the best.

    A rival is possible, strays no more from what was stated, meets the others about as closely, and what was
    seen speaks against it hardly more. Fits that move the points to within `reach_m` of each other on average
    are one place: alignment joins them.
    """
    points_m = cloud.points_m[:: max(1, len(cloud) // SPREAD_POINTS)]

    def apart_m(a: Fit, b: Fit) -> float:
        at_m, other_m = (transform(fit.T_frame_local, points_m) for fit in (a, b))
        return float(np.linalg.norm(at_m - other_m, axis=1).mean())

    near = [
        fit
        for fit in fits
        if fit.possible
        and fit.strays <= best.strays
        and fit.misfit_m < AS_CLOSE * best.misfit_m
        and fit.doubt < AS_FREE * best.doubt
    ]
    found: dict[Fit, float] = {}
    for fit in near:
        if all(apart_m(fit, other) > reach_m for other in (best, *found)):
            found[fit] = apart_m(fit, best)
    return found
