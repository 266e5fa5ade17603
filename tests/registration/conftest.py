"""The site's scans, made once a session."""

from pathlib import Path

import pytest

from tests.registration.site import BRIDGE, POSITIONS_M, YARD, points_seen, pose_of, write_ply


@pytest.fixture(scope="session")
def site_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """station0.ply … station3.ply of one bridge, mirror.ply (station 1 mirrored), yard.ply (elsewhere)."""
    folder = tmp_path_factory.mktemp("site")
    for k in range(len(POSITIONS_M)):
        write_ply(folder / f"station{k}.ply", points_seen(BRIDGE, pose_of(k), seed=k))
    write_ply(folder / "mirror.ply", points_seen(BRIDGE, pose_of(1), seed=8) * [-1, 1, 1])
    write_ply(folder / "yard.ply", points_seen(YARD, pose_of(1), seed=9))
    return folder
