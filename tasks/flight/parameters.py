"""Parameters of an ArduPilot vehicle, read and set by their names."""

from collections.abc import Sequence
from typing import Any

from tasks.flight.link import Link

ATTEMPTS, WAIT_S = 8, 0.5  # an unknown name is answered by silence


def read_parameters(link: Link, names: Sequence[Sequence[str]]) -> dict[str, Any]:
    """PARAM_VALUE messages by name. names: for each parameter what it is called, by age of the firmware: of
    these one answers at most. What nobody answers to is left out."""
    wanted = {name for called in names for name in called}
    found: dict[str, Any] = {}
    for _ in range(ATTEMPTS):
        missing = [called for called in names if found.keys().isdisjoint(called)]
        for name in (name for called in missing for name in called):
            link.mav.param_request_read_send(*link.target, name.encode(), -1)
        while any(found.keys().isdisjoint(called) for called in missing):
            message = link.expect(("PARAM_VALUE",), WAIT_S, lambda m: m.param_id in wanted)
            if message is None:
                break
            found[message.param_id] = message
    return found


def set_parameter(link: Link, as_read: Any, value: float) -> bool:
    """Give a parameter that was read another value; says whether the vehicle confirmed it."""
    name = as_read.param_id
    for _ in range(ATTEMPTS):
        link.mav.param_set_send(*link.target, name.encode(), value, as_read.param_type)
        message = link.expect(
            ("PARAM_VALUE",), WAIT_S, lambda m: m.param_id == name and abs(m.param_value - value) < 1e-3
        )
        if message is not None:
            return True
    return False
