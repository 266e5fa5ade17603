"""What a run lays out for people under names that stay."""

import json
from pathlib import Path

from artifacts import store
from artifacts.run_folder import remove_stale
from flows.results import lay_out_mosaic
from schemas.settings import DetectSettings, PatternSettings
from tasks.detection.task import detect
from tasks.patterns.task import remove_patterns
from tasks.photos.task import ingest
from tasks.stitching.task import single
from tests.small_inspection import photograph_crack


def test_photos_called_alike_by_two_cards_have_a_folder_each_that_the_next_run_keeps(tmp_path: Path) -> None:
    names = ["card1/DJI_0001.jpg", "card2/DJI_0001.jpg"]
    with store.temporary():
        for seed, name in enumerate(names):
            photograph_crack(tmp_path / f"{seed}.jpg", seed)
            file = store.current().put(tmp_path / f"{seed}.jpg")
            mosaic = single.bare(ingest.bare(file, name, "deck", None, None, 5.0), 0.5)
            patterns = remove_patterns.bare(mosaic, PatternSettings())
            detection = detect.bare(mosaic, patterns, DetectSettings(method="ridge"), None)
            lay_out_mosaic(tmp_path / "run", mosaic, patterns, detection)
        for stage in ("mosaics", "detection"):
            remove_stale(tmp_path / "run" / stage, names)
            assert len(list((tmp_path / "run" / stage).iterdir())) == 2
        told = [json.loads(p.read_text())["name"] for p in (tmp_path / "run/mosaics").glob("*/stitch.json")]
    assert sorted(told) == names
