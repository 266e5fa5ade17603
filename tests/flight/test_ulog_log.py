"""PX4's topics as pyulog gives them; a whole real log is in test_task."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tasks.flight.ulog_log import read_ulog


def read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, **topics: dict[str, Any]) -> Any:
    data = [
        SimpleNamespace(name=name, data={k: np.asarray(v) for k, v in columns.items()})
        for name, columns in topics.items()
    ]
    log = SimpleNamespace(data_list=data, msg_info_dict={})
    monkeypatch.setattr("tasks.flight.ulog_log.ULog", lambda stream, topics: log)
    path = tmp_path / "log.ulg"
    path.write_bytes(b"ULog")
    return read_ulog(path)


def test_heights_count_from_the_home_of_their_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """PX4 sets home where it stands after a landing whose altitude has drifted: 3 m here."""
    seconds = np.arange(10)
    recording = read(
        monkeypatch,
        tmp_path,
        vehicle_global_position={
            "timestamp": seconds * 1_000_000,
            "lat": np.full(10, 47.4),
            "lon": np.full(10, 8.5),
            "alt": [488.0, 490.0, 495.0, 495.0, 495.0, 494.0, 492.0, 491.0, 491.0, 491.0],
        },
        home_position={
            "timestamp": [0, 500_000, 8_500_000],
            "alt": [np.nan, 488.0, 491.0],
            "valid_alt": [0, 1, 1],
        },
        camera_capture={
            "timestamp": [3_000_000],
            "lat": [47.4],
            "lon": [8.5],
            "alt": [495.0],
            "seq": [1],
            "q[0]": [1.0],
            "q[1]": [0.0],
            "q[2]": [0.0],
            "q[3]": [0.0],
        },
    )
    heights = [fix.height_m for fix in recording.fixes]
    assert heights == pytest.approx([0.0, 2.0, 7.0, 7.0, 7.0, 6.0, 4.0, 3.0, 3.0, 0.0])
    assert recording.triggers[0].fix.height_m == pytest.approx(7.0)
