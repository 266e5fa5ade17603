"""Targets of a survey: spheres, checkerboards, reflective marks, seen in scans, known on the site."""

from schemas.contract import Contract, Vector3


class SeenTarget(Contract):
    """A target as somebody or some program found it in one scan."""

    name: str
    position: Vector3  # of its centre, in the coordinates and the unit of the scan's file


class SiteTarget(Contract):
    """A target whose place on the site was surveyed."""

    name: str
    position_m: Vector3  # in the site's datum, east north up
    check: bool = False  # True: it judges the model and is never fitted to


class TargetResidual(Contract):
    """How a sighting of a target lies to its surveyed place."""

    name: str
    station: str
    check: bool
    used: bool  # in the fit; False for check points, and for control that contradicts the rest
    residual_m: Vector3  # model minus survey, along the datum's axes
