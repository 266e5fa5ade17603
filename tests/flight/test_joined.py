"""Several flights of one plan as one log."""

from schemas.camera import CameraPose
from schemas.file import File
from schemas.flight_log import FlightLog, Shot, TrackError, TrackPoint, joined


def a_log(digit: str, photo: str) -> FlightLog:
    pose = CameraPose(position_m=(1.0, 2.0, 3.0), yaw_deg=0.0, pitch_deg=0.0)
    return FlightLog(
        archive=File(sha256=digit * 64, size=1, suffix=".mcap"),
        vehicle="simulated",
        duration_s=100.0,
        track=(TrackPoint(time_s=5.0, position_m=(0.0, 0.0, 1.0), yaw_deg=0.0),),
        shots=(Shot(photo=photo, surface="wall-01", time_s=50.0, pose=pose),),
        errors=(TrackError(what="flight", rms_m=0.1, largest_m=0.2),),
        missed=(f"{photo}-missed",),
    )


def test_one_flight_stays_as_it_is() -> None:
    log = a_log("1", "a")
    assert joined([log]) is log


def test_flights_follow_each_other_and_nothing_is_lost() -> None:
    both = joined([a_log("1", "a"), a_log("2", "b")])
    assert both.duration_s == 200.0
    assert [(s.photo, s.time_s) for s in both.shots] == [("a", 50.0), ("b", 150.0)]
    assert [point.time_s for point in both.track] == [5.0, 105.0]
    assert both.missed == ("a-missed", "b-missed")
    assert [error.what for error in both.errors] == ["flight 1: flight", "flight 2: flight"]
    assert [file.sha256[0] for file in (both.archive, *both.later_archives)] == ["1", "2"]


def test_a_photo_that_a_later_flight_took_is_not_missed() -> None:
    again = a_log("2", "b").model_copy(update={"shots": a_log("2", "a-missed").shots})
    both = joined([a_log("1", "a"), again])
    assert [s.photo for s in both.shots] == ["a", "a-missed"]
    assert both.missed == ("b-missed",)
