"""Which of a plan's battery flights a log is of: one log may hold several, and they come in any order."""

from collections.abc import Iterator
from dataclasses import replace

from schemas.flight_plan import FlightPlan
from tasks.flight.recording import Recording
from tasks.flight.track import Comparison, compare_with_plan

BATTERY_S = 60.0  # the motors stand still longer while a battery is changed; shorter stops are one flight


def flights_in(recording: Recording) -> Iterator[Recording]:
    """The log cut where the motors stood still for longer than it takes to change a battery."""
    spans: list[tuple[float, float]] = []
    for start, end in recording.armed_s:
        if spans and start - spans[-1][1] < BATTERY_S:
            spans[-1] = spans[-1][0], end
        else:
            spans.append((start, end))
    if len(spans) < 2:
        yield recording
        return
    for start, end in spans:
        fixes = [fix for fix in recording.fixes if start <= fix.time_s <= end]
        triggers = [t for t in recording.triggers if start <= t.fix.time_s <= end]
        if fixes:
            yield replace(recording, fixes=fixes, triggers=triggers, armed_s=[(start, end)])


def compare_with_flights(recording: Recording, plan: FlightPlan | None, name: str) -> list[Comparison]:
    """Each flight of the log against that flight of the plan of which it shot most, the nearer path counting
    where they are equal."""
    legs = plan.each_flight if plan is not None else (None,)
    if len(legs) == 1:
        return [compare_with_plan(recording, legs[0], name)]
    found = []
    for flight in flights_in(recording):
        tried = [compare_with_plan(flight, leg, name) for leg in legs]
        found.append(max(tried, key=_likeness))
    return found


def _likeness(found: Comparison) -> tuple[int, int, float]:
    reported = sum(shot.reported for shot in found.shots)
    off_m = next((error.rms_m for error in found.errors if error.what == "flight"), float("inf"))
    return reported, len(found.shots), -off_m
