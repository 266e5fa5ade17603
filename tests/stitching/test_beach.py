"""Real drone photos over ground with trees: every photo has a place, at the scale that GPS tells."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artifacts import store
from schemas.settings import StitchSettings
from tasks.photos.task import features, ingest
from tasks.stitching.task import stitch
from tests.development_data import development_data


@pytest.mark.slow
def test_all_eighteen_photos_of_a_beach(tmp_path: Path) -> None:
    """At a fifth of their size. 40 m above ground with 2311 px of focal length: 17.3 mm/px, trees nearer.
    Their gimbals tell a yaw that is 180° off for a third of them."""
    photos, described = [], []
    settings = StitchSettings(features=1500)
    for path in sorted(development_data("photos/brighton_beach").glob("*.JPG")):
        with Image.open(path) as image:
            small = image.resize((800, 450), Image.Resampling.BOX)
            small.save(tmp_path / path.name, quality=95, exif=image.info["exif"], xmp=image.info["xmp"])
        photo = ingest.bare(store.current().put(tmp_path / path.name), path.name, "beach", None, None, 5.0)
        photos.append(photo)
        described.append(features.bare(photo, settings))
    mosaic = stitch.bare("beach", None, tuple(photos), tuple(described), settings)
    assert [p.name for p in mosaic.placements] == [p.name for p in photos]
    assert {p.status for p in mosaic.placements} == {"solved"}
    assert mosaic.scale_from == "GPS"
    assert mosaic.gsd_mm_px == pytest.approx(5 * 16.7, rel=0.04)
    assert mosaic.photos[0].camera.focal_px == pytest.approx(2311 / 5, rel=0.05)
    largest = max(np.ptp([1.0, p.gain]) for p in mosaic.placements)
    assert largest < 1.5
