"""A photo file and the logged shot that took it."""

from schemas.contract import Contract
from schemas.flight_log import Shot


class AssignedShot(Contract):
    name: str  # of the photo's file
    shot: Shot
