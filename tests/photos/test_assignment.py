"""A photo goes to the shot that took it, or the user is told why not."""

import pytest

from schemas.camera import CameraPose
from schemas.file import File
from schemas.flight_log import FlightLog, Shot
from schemas.problem import BadInput
from tasks.photos.assignment import assign_shots


def log_of(*shots: tuple[str, float]) -> FlightLog:
    return FlightLog(
        archive=File(sha256="0" * 64, size=0, suffix=".mcap"),
        vehicle="test",
        duration_s=10.0,
        track=(),
        shots=tuple(
            Shot(
                photo=name,
                surface="wall",
                time_s=t,
                pose=CameraPose(position_m=(t, 0, 0), yaw_deg=0, pitch_deg=0),
            )
            for name, t in shots
        ),
        errors=(),
    )


def test_photos_named_as_planned_go_by_their_names() -> None:
    assigned = assign_shots(["b.jpg", "a.JPG", "holiday.jpg"], log_of(("a", 1), ("b", 2)))
    assert [(one.name, one.shot.time_s) for one in assigned] == [("b.jpg", 2), ("a.JPG", 1)]


def test_a_cameras_own_names_go_by_order() -> None:
    assigned = assign_shots(["DJI_0002.JPG", "DJI_0001.JPG"], log_of(("late", 5), ("early", 1)))
    assert [(one.name, one.shot.photo) for one in assigned] == [
        ("DJI_0001.JPG", "early"),
        ("DJI_0002.JPG", "late"),
    ]


def test_a_count_that_does_not_fit_is_refused_rather_than_shifted() -> None:
    with pytest.raises(BadInput, match="3 photos but the flight log has 2 shots"):
        assign_shots(["1.jpg", "2.jpg", "3.jpg"], log_of(("a", 1), ("b", 2)))
