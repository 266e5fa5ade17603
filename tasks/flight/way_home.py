"""A failsafe's way home, made to fit the plan before take-off: ArduCopter's RTL knows nothing of bridges."""

from typing import Any

from schemas.flight_plan import FlightPlan
from tasks.flight.link import Link
from tasks.flight.parameters import read_parameters, set_parameter

HEIGHT = ("RTL_ALT", "RTL_ALT_M")  # centimetres; from ArduCopter 4.7 on metres
PRESUMED = {  # by tasks.planning.way_home, and as delivered
    ("RTL_CONE_SLOPE",): 3.0,
    ("RTL_CLIMB_MIN", "RTL_CLIMB_MIN_M"): 0.0,
    ("RTL_ALT_TYPE",): 0.0,
}
COMES_HOME = {  # values that begin RTL at once; 6: unless the mission has a DO_LAND_START, and ours has none
    "FS_THR_ENABLE": (1, 6),
    "FS_GCS_ENABLE": (1, 6),
    "BATT_FS_LOW_ACT": (2, 6),
    "BATT_FS_CRT_ACT": (2, 6),
}
FENCE, FENCE_COMES_HOME = ("FENCE_ENABLE", "FENCE_ACTION"), (1, 1)


class WayHome:
    """Sets the plan's return height on the vehicle; `give_back` sets its own again.

    told: what was changed, and what may still bring the vehicle home by another way, in words."""

    def __init__(self, link: Link, plan: FlightPlan) -> None:
        self.link = link
        self.told: list[str] = []
        self._own: Any = None
        if plan.return_height_m is None:
            self._doubt_failsafes()
        else:
            self._set_height(plan.return_height_m)

    def give_back(self) -> None:
        """On the ground again."""
        if self._own is None:
            return
        name, value = self._own.param_id, self._own.param_value
        if set_parameter(self.link, self._own, value):
            self.told.append(f"Landed: {name} is {value:g} again")
        else:
            self.told.append(f"{name} could not be set back to {value:g}: the vehicle keeps the plan's")
        self._own = None

    @property
    def left(self) -> str | None:
        """What is to be set again by hand where the flight is no longer followed."""
        if self._own is None:
            return None
        name, value = self._own.param_id, self._own.param_value
        return f"Its {name} is this flight's: set it back to {value:g} once it has landed"

    def _set_height(self, height_m: float) -> None:
        found = read_parameters(self.link, [HEIGHT, *PRESUMED])
        own = next((found[name] for name in HEIGHT if name in found), None)
        wanted = f"the plan's height, {height_m:g} m, at which its way home is known to be free"
        if own is None:
            self.told.append(f"The vehicle does not tell its RTL_ALT: see that it is {wanted}")
            return
        value = height_m if own.param_id.endswith("_M") else round(100.0 * height_m)
        if abs(own.param_value - value) > 1e-3:
            if set_parameter(self.link, own, value):
                self._own = own
                self.told.append(f"{own.param_id} set from {own.param_value:g} to {value:g}: {wanted}")
            else:
                is_now = f"{own.param_id} is {own.param_value:g} and cannot be set"
                self.told.append(f"{is_now}: a failsafe would not come home at {wanted}")
        for names, presumed in PRESUMED.items():
            for name in names:
                if name in found and abs(found[name].param_value - presumed) > 1e-3:
                    other = f"{name} is {found[name].param_value:g}"
                    self.told.append(f"{other}: the plan's way home was checked for {presumed:g}")

    def _doubt_failsafes(self) -> None:
        found = read_parameters(self.link, [(name,) for name in (*COMES_HOME, *FENCE)])
        told = {name: int(message.param_value) for name, message in found.items()}
        home = [f"{name} {told[name]}" for name, values in COMES_HOME.items() if told.get(name) in values]
        if tuple(told.get(name) for name in FENCE) == FENCE_COMES_HOME:
            home.append(f"{FENCE[1]} {FENCE_COMES_HOME[1]}")
        if home:
            self.told.append(
                f"The vehicle has {', '.join(home)}: that failsafe flies straight home, and at no height is"
                " that way known to be free; let it land, or fly back the way it came (SmartRTL)"
            )
