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


def assigned(taken_s: dict[str, float | None], log: FlightLog) -> list[tuple[str, str]]:
    return [(one.name, one.shot.photo) for one in assign_shots(taken_s, log)]


def silent(*names: str) -> dict[str, float | None]:
    return dict.fromkeys(names)


def test_photos_named_as_planned_go_by_their_names() -> None:
    found = assigned(silent("b.jpg", "a.JPG", "holiday.jpg"), log_of(("a", 1), ("b", 2)))
    assert found == [("b.jpg", "b"), ("a.JPG", "a")]


def test_a_cameras_own_names_go_by_order() -> None:
    found = assigned(silent("DJI_0002.JPG", "DJI_0001.JPG"), log_of(("late", 5), ("early", 1)))
    assert found == [("DJI_0001.JPG", "early"), ("DJI_0002.JPG", "late")]


def test_ten_comes_after_nine() -> None:
    found = assigned(silent("IMG_10.JPG", "img_9.jpg", "IMG_11.JPG"), log_of(("a", 1), ("b", 2), ("c", 3)))
    assert found == [("img_9.jpg", "a"), ("IMG_10.JPG", "b"), ("IMG_11.JPG", "c")]


def test_a_counter_that_starts_anew_goes_by_the_cameras_clock() -> None:
    """The last two within the clock's second go by their numbers."""
    taken = {"DJI_0001.JPG": 102.0, "DJI_0002.JPG": 102.0, "DJI_9998.JPG": 100.0, "DJI_9999.JPG": 101.5}
    found = assigned(dict(taken), log_of(("a", 1), ("b", 2), ("c", 3), ("d", 4)))
    assert [name for name, _ in found] == ["DJI_9998.JPG", "DJI_9999.JPG", "DJI_0001.JPG", "DJI_0002.JPG"]


def test_folders_of_one_flight_are_filled_one_after_the_other() -> None:
    log = log_of(("a", 1), ("b", 2), ("c", 3))
    found = assigned(silent("101MEDIA/DJI_0998.JPG", "101MEDIA/DJI_0999.JPG", "100MEDIA/DJI_0001.JPG"), log)
    assert [name for name, _ in found][-1] == "100MEDIA/DJI_0001.JPG"
    timed = {"101MEDIA/DJI_0001.JPG": 9.0, "100MEDIA/DJI_0998.JPG": 7.0, "100MEDIA/DJI_0999.JPG": 8.0}
    assert [name for name, _ in assigned(dict(timed), log)][-1] == "101MEDIA/DJI_0001.JPG"


def test_one_photo_without_a_time_among_others_that_contradict_the_names_is_refused() -> None:
    log = log_of(("a", 1), ("b", 2), ("c", 3))
    assert len(assign_shots({"1.jpg": 5.0, "2.jpg": None, "3.jpg": 6.0}, log)) == 3
    with pytest.raises(BadInput, match=r"2\.jpg: does not say when it was taken"):
        assign_shots({"1.jpg": 6.0, "2.jpg": None, "3.jpg": 5.0}, log)


def test_a_count_that_does_not_fit_is_refused_rather_than_shifted() -> None:
    with pytest.raises(BadInput, match="3 photos but the flight log has 2 shots"):
        assign_shots(silent("1.jpg", "2.jpg", "3.jpg"), log_of(("a", 1), ("b", 2)))
