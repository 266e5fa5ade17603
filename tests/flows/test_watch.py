"""`hairline watch`, with files that appear while it runs."""

import shutil
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flows.command_line import EXIT_WAITING_FOR_FLIGHT
from flows.results import write_json
from flows.watch_command import PATIENCE_S, POLL_S, STILL_S, Session, watch
from schemas.problem import BadInput
from tests.flight.wall_plan import wall_plan


def picture(seed: int, blur: bool = False) -> Image.Image:
    noise = np.random.default_rng(seed).normal(0, 1, (24, 32) if blur else (240, 320))
    small = Image.fromarray(np.clip(128 + 40 * noise, 0, 255).astype(np.uint8))
    return small.resize((320, 240), Image.Resampling.BICUBIC).convert("RGB")


class Script:
    """Time that passes only by sleeping; what happens in the folder at which second."""

    def __init__(self, events: dict[float, Callable[[], object]], until_s: float) -> None:
        self.now_s, self.events, self.until_s = 0.0, events, until_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        for at_s in [t for t in self.events if t <= self.now_s]:
            self.events.pop(at_s)()
        if self.now_s > self.until_s:
            raise KeyboardInterrupt

    def run(self, session: Session) -> list[tuple[float, str, str]]:
        """(when, name, faults) of all that the session tells."""
        told = []
        with pytest.raises(KeyboardInterrupt):
            for arrival in session.arrivals():
                told.append((self.now_s, arrival.name, "; ".join(arrival.faults)))
        return told


def session(folder: Path, script: Script) -> Session:
    return Session(folder, None, None, clock=lambda: script.now_s, sleep=script.sleep)


def test_each_photo_is_told_within_seconds_of_its_arrival(tmp_path: Path) -> None:
    picture(0).save(tmp_path / "there.jpg")
    events: dict[float, Callable[[], object]] = {
        4.0: lambda: picture(1).save(tmp_path / "one.jpg"),
        6.0: lambda: picture(2).save(tmp_path / "two.jpg"),
        8.0: lambda: picture(3, blur=True).save(tmp_path / "shaken.jpg"),
        10.0: lambda: shutil.copy(tmp_path / "one.jpg", tmp_path / "again.jpg"),
        11.0: lambda: (tmp_path / "notes.txt").write_text("no photo"),
        12.0: lambda: Image.new("RGB", (320, 240), (255, 255, 255)).save(tmp_path / "white.jpg"),
    }
    script = Script(events, 20.0)
    told = script.run(session(tmp_path, script))
    assert [name for _, name, _ in told] == [
        "there.jpg",
        "one.jpg",
        "two.jpg",
        "shaken.jpg",
        "again.jpg",
        "white.jpg",
    ]
    for (at_s, *_), arrived_s in zip(told, [0.0, 4.0, 6.0, 8.0, 10.0, 12.0], strict=True):
        assert at_s - arrived_s <= STILL_S + 2 * POLL_S
    faults = {name: fault for _, name, fault in told}
    assert faults["one.jpg"] == faults["two.jpg"] == ""
    assert faults["shaken.jpg"].startswith("blurred")
    assert faults["again.jpg"] == "the same picture as one.jpg"
    assert faults["white.jpg"].startswith("overexposed")


def test_a_file_that_is_still_being_written_is_waited_for(tmp_path: Path) -> None:
    picture(0).save(tmp_path / "whole.jpg")
    content = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "whole.jpg").unlink()
    half = len(content) // 2
    path = tmp_path / "slow.jpg"

    def go_on() -> None:
        with path.open("ab") as file:
            file.write(content[half:])

    script = Script({1.0: lambda: path.write_bytes(content[:half]), 9.0: go_on}, 30.0)
    told = script.run(session(tmp_path, script))
    assert [(name, fault) for _, name, fault in told] == [("slow.jpg", "")]
    assert 9.0 < told[0][0] <= 9.0 + STILL_S + 2 * POLL_S


def test_a_file_that_stays_broken_is_told_and_forgiven_when_it_is_whole(tmp_path: Path) -> None:
    picture(0).save(tmp_path / "whole.jpg")
    content = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "whole.jpg").unlink()
    path = tmp_path / "torn.jpg"
    script = Script(
        {1.0: lambda: path.write_bytes(content[:500]), 40.0: lambda: path.write_bytes(content)}, 50.0
    )
    told = script.run(session(tmp_path, script))
    assert [name for _, name, _ in told] == ["torn.jpg", "torn.jpg"]
    assert "damaged" in told[0][2]
    assert told[0][0] == pytest.approx(1.0 + PATIENCE_S, abs=1.0)
    assert told[1][2] == ""


def test_the_command_ends_when_every_point_has_its_photo(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = wall_plan(columns=2, rows=1)
    write_json(tmp_path / "plan.json", plan)
    card = tmp_path / "card"
    card.mkdir()
    names = [w.photo for w in plan.shooting_points]

    def fly() -> None:
        for k, name in enumerate(names):
            time.sleep(0.3)
            picture(k).save(tmp_path / "new.jpg")
            (tmp_path / "new.jpg").rename(card / f"{name}.jpg")

    flight = threading.Thread(target=fly)
    flight.start()
    assert watch(card, plan=tmp_path / "plan.json") == 0
    flight.join()
    said = capsys.readouterr().out
    assert f"{names[-1]}.jpg" in said
    assert "0 points to go" in said
    assert "Every shooting point has its photo" in said


def test_interrupted_it_says_what_lacks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = wall_plan(columns=2, rows=1)
    write_json(tmp_path / "plan.json", plan)
    card = tmp_path / "card"
    card.mkdir()
    (card / "101MEDIA").mkdir()
    picture(1).save(card / "101MEDIA" / "1.jpg")
    picture(0).save(card / f"{plan.shooting_points[0].photo}.jpg")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    interrupt = threading.Timer(4 * STILL_S, signal.raise_signal, [signal.SIGINT])  # Ctrl-C
    interrupt.start()
    try:
        assert watch(card, plan=tmp_path / "plan.json") == EXIT_WAITING_FOR_FLIGHT
    finally:
        signal.signal(signal.SIGINT, before)
    said = capsys.readouterr()
    assert "2 shooting points have no good photo" in said.err
    assert plan.shooting_points[1].photo in said.out
    assert "101MEDIA holds photos too" in " ".join(said.out.split())
    assert "soffit-1" in said.out


def test_interrupted_it_names_the_photos_that_it_has_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    picture(0).save(tmp_path / "just-arrived.jpg")

    def interrupted(_: Session) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Session, "arrivals", interrupted)
    assert watch(tmp_path) == 0
    assert "Not judged yet: just-arrived.jpg" in capsys.readouterr().err


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no such folder"):
        watch(tmp_path / "nowhere")
