"""Real photos of a wall that is not quite plane, without any position."""

import pytest

from artifacts import store
from schemas.settings import StitchSettings
from tasks.photos.task import features, ingest
from tasks.stitching import solution
from tasks.stitching.task import stitch
from tests.development_data import development_data


def test_a_photo_of_what_stands_out_of_a_wall_takes_no_other_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two neighbours that cannot both lie on the plane .47 of the points are kept; without one, more of
    the other's."""
    monkeypatch.setattr(solution, "LEAST_KEPT", 0.5)
    folder = development_data("cracks/uav")
    rows = (row.split() for row in (folder / "groups.txt").read_text().splitlines())
    names = sorted(name for name, group in rows if group == "2")
    settings = StitchSettings()
    photos = tuple(
        ingest.bare(store.current().put(folder / "images" / name), name, "wall", None, None, 5.0)
        for name in names
    )
    mosaic = stitch.bare("wall", None, photos, tuple(features.bare(p, settings) for p in photos), settings)
    assert len(names) == 10
    assert len([p.name for p in mosaic.placements if p.status != "solved"]) == 1
