"""A vehicle flies one battery a run: before it takes off again, somebody must have given it another one."""

from prefect import suspend_flow_run

from artifacts.page import Page
from flows.external_flight import deployed
from tasks.stage import publish


class WaitingForBattery(Exception):
    """A flight of the plan is flown, and another battery has to be put in before the next one."""

    def __init__(self, flown: int, batteries: int) -> None:
        super().__init__(f"Battery {flown} of {batteries} is flown, and the vehicle stands still.")
        self.flown = flown


def wait_for_battery(flown: int, batteries: int) -> None:
    """End the run after the flight `flown` (from 1). The next run finds it in the cache and flies the next;
    a deployed run is suspended, and goes on so when it is resumed in the dashboard."""
    waiting = WaitingForBattery(flown, batteries)
    if not deployed():
        raise waiting
    told = f"**{waiting}** Change the battery, stand clear, then resume this run: it takes off at once."
    publish(Page(key="battery-change", markdown=told))
    suspend_flow_run(key=f"battery-{flown}", timeout=24 * 3600)
