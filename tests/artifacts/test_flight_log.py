import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from artifacts.flight_log import MAVLINK, FlightArchive, about, messages
from schemas.problem import BadInput

SECOND = 1_000_000_000


def write(path: Path, count: int = 3000) -> list[tuple[str, int, bytes]]:
    rng = np.random.default_rng(4)
    frames = [(MAVLINK, i * SECOND // 30, rng.bytes(int(rng.integers(8, 280)))) for i in range(count)]
    with FlightArchive(path, {"vehicle": "test"}) as archive:
        for i, (_, time_ns, raw) in enumerate(frames):
            archive.frame(time_ns, raw)
            if i % 3 == 0:
                archive.location(time_ns, -35.1, 149.2, 590.5)
                archive.pose(time_ns, (1.0, 2.0, 3.0), yaw_deg=30.0)
    return frames


def frames_of(path: Path) -> list[tuple[str, int, bytes]]:
    return [m for m in messages(path) if m[0] == MAVLINK]


def test_frames_come_back_byte_for_byte(tmp_path: Path) -> None:
    frames = write(tmp_path / "a.mcap")
    assert frames_of(tmp_path / "a.mcap") == frames
    assert about(tmp_path / "a.mcap", "a.mcap") == {"vehicle": "test"}


def test_equal_content_has_equal_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 300)
    write(tmp_path / "b.mcap", 300)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_viewers_find_foxglove_messages_and_checksums(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 30)
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        decoded = list(reader.iter_decoded_messages(topics=["/location", "/pose"]))
        summary = reader.get_summary()
    assert summary is not None
    assert {s.name for s in summary.schemas.values()} == {"foxglove.LocationFix", "foxglove.PoseInFrame"}
    fix, pose = decoded[2].decoded_message, decoded[3].decoded_message
    assert (fix.latitude, fix.longitude, fix.altitude) == (-35.1, 149.2, 590.5)
    assert fix.timestamp.nanos == SECOND // 10
    assert (pose.pose.position.x, pose.pose.position.y, pose.pose.position.z) == (1.0, 2.0, 3.0)


@settings(max_examples=40)
@given(yaw=st.floats(0, 360), pitch=st.floats(-90, 90))
def test_the_pose_points_where_the_lens_does(
    tmp_path_factory: pytest.TempPathFactory, yaw: float, pitch: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "pose.mcap"
    with FlightArchive(path, {}) as archive:
        archive.pose(0, (0.0, 0.0, 0.0), yaw, pitch, of="/camera")
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        q = next(reader.iter_decoded_messages()).decoded_message.pose.orientation
    assert math.hypot(q.x, q.y, q.z, q.w) == pytest.approx(1.0)
    forward = (1 - 2 * (q.y**2 + q.z**2), 2 * (q.x * q.y + q.w * q.z), 2 * (q.x * q.z - q.w * q.y))
    y, p = math.radians(yaw), math.radians(pitch)
    assert forward == pytest.approx(
        (math.sin(y) * math.cos(p), math.cos(y) * math.cos(p), math.sin(p)), abs=1e-9
    )


@pytest.mark.parametrize("share", [0.0005, 0.1, 0.5, 0.9, 0.999])
def test_a_truncated_file_gives_its_whole_chunks(tmp_path: Path, share: float) -> None:
    frames = write(tmp_path / "a.mcap")
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(len(whole) * share)])
    found = frames_of(tmp_path / "cut.mcap")
    assert found == frames[: len(found)]
    assert len(found) >= len(frames) * share - 100  # three chunks of a second at 30 frames


def test_an_altered_chunk_is_left_out_and_the_others_kept(tmp_path: Path) -> None:
    frames = write(tmp_path / "a.mcap")
    data = bytearray((tmp_path / "a.mcap").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (tmp_path / "a.mcap").write_bytes(data)
    found = frames_of(tmp_path / "a.mcap")
    assert set(found) <= set(frames)
    assert len(frames) - 70 <= len(found) < len(frames)


def test_a_killed_process_loses_about_a_second(tmp_path: Path) -> None:
    script = (
        "import sys, time; from pathlib import Path; from artifacts.flight_log import FlightArchive\n"
        "archive = FlightArchive(Path(sys.argv[1]), {})\n"
        "for i in range(3000): archive.frame(i * 33_000_000, b'x' * 40)\n"
        "print('written', flush=True); time.sleep(60)"
    )
    path = tmp_path / "killed.mcap"
    root = str(Path(__file__).parents[2])
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(path)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": root},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"written\n"
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert len(frames_of(path)) >= 3000 - 32


def test_another_mcap_file_is_refused(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with (tmp_path / "other.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.finish()
    with pytest.raises(BadInput, match=r"other\.mcap.*no flight that Hairline archived"):
        about(tmp_path / "other.mcap", "other.mcap")


@pytest.mark.parametrize("inside", [None, OSError(28, "while flying")])
def test_a_full_disk_tells_what_went_wrong_first(
    inside: OSError | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: object) -> None:
        raise OSError(28, "at the end")

    with pytest.raises(OSError, match="at the end" if inside is None else "while flying"):  # noqa: SIM117
        with FlightArchive(tmp_path / "a.mcap", {}) as archive:
            monkeypatch.setattr(archive._writer, "finish", lambda: full(archive))
            if inside is not None:
                raise inside
