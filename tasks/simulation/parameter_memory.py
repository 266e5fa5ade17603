"""The parameters of the simulated vehicle: those of ArduCopter that a client may want, as delivered."""

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

DELIVERED = {
    "RTL_ALT": 1500.0,
    "RTL_CONE_SLOPE": 3.0,
    "RTL_CLIMB_MIN": 0.0,
    "RTL_ALT_TYPE": 0.0,
    "FS_THR_ENABLE": 1.0,
    "FS_GCS_ENABLE": 0.0,
    "BATT_FS_LOW_ACT": 0.0,
    "BATT_FS_CRT_ACT": 0.0,
    "FENCE_ENABLE": 0.0,
    "FENCE_ACTION": 1.0,
}
IN_METRES = {"RTL_ALT": "RTL_ALT_M", "RTL_CLIMB_MIN": "RTL_CLIMB_MIN_M"}  # from ArduCopter 4.7 on
REAL = ("RTL_CONE_SLOPE", *IN_METRES.values())


class ParameterMemory:
    """Answers PARAM_REQUEST_READ by name and PARAM_SET; says nothing where it does not know a name."""

    def __init__(
        self, mav: Any, send: Callable[[Any], None], in_metres: bool, other: tuple[tuple[str, float], ...]
    ) -> None:
        self.mav, self.send = mav, send
        values = DELIVERED | dict(other)
        self.values = (
            {IN_METRES.get(k, k): v / 100 if k in IN_METRES else v for k, v in values.items()}
            if in_metres
            else values
        )

    def on_param_request_read(self, message: Any) -> None:
        if message.param_id in self.values:
            self._tell(message.param_id)

    def on_param_set(self, message: Any) -> None:
        if message.param_id in self.values:
            self.values[message.param_id] = message.param_value
            self._tell(message.param_id)

    def _tell(self, name: str) -> None:
        kind = mavlink.MAV_PARAM_TYPE_REAL32 if name in REAL else mavlink.MAV_PARAM_TYPE_INT32
        index = list(self.values).index(name)
        self.send(
            self.mav.param_value_encode(name.encode(), self.values[name], kind, len(self.values), index)
        )
