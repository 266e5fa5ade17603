"""The report holds everything there is, leaves out what is not, and can be trusted with any name."""

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from artifacts.report import write_report
from schemas.crack_report import CrackReport
from schemas.inspection import Inspection
from schemas.problem import LeftOut
from tests.artifacts.bridge import Shelf, flight, structure
from tests.artifacts.inspected import Inspected, crack_report, inspected_photos, mosaic_of
from tests.artifacts.page_reader import PageReader

HOSTILE = '"><script>alert(1)</script><img src=x onerror=alert(2)>&amp;{{7*7}}\x07'
EXTERNAL = re.compile(r"""(https?:)?//(?!www\.w3\.org/2000/svg)[\w.-]+\.\w+|@import|url\(""")


def written(inspected: Inspected, folder: Path) -> PageReader:
    write_report(folder, **inspected.report_inputs())
    return PageReader((folder / "index.html").read_text(encoding="utf-8"))


def outside_pictures(text: str) -> str:
    return re.sub(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/=]+", "", text)


def test_page_is_well_formed_and_every_link_in_it_leads_somewhere(bridge_report: Path) -> None:
    page = PageReader((bridge_report / "index.html").read_text(encoding="utf-8"))
    assert len(page.ids) == len(set(page.ids))
    inside = {reference[1:] for reference in page.references if reference.startswith("#")}
    assert inside <= set(page.ids), inside - set(page.ids)


def test_page_needs_nothing_from_outside(bridge_report: Path) -> None:
    text = (bridge_report / "index.html").read_text(encoding="utf-8")
    page = PageReader(text)
    for reference in page.references:
        assert reference.startswith(("#", "data:image/")) or reference in ("cracks.csv", "cracks.json")
    assert not EXTERNAL.search(outside_pictures(text))
    assert not {"link", "iframe", "object", "embed", "base"} & set(page.tags)


def test_every_crack_stands_in_the_table_on_its_sheet_and_from_near(
    bridge: Inspected, bridge_report: Path
) -> None:
    text = (bridge_report / "index.html").read_text(encoding="utf-8")
    page = PageReader(text)
    assert len(bridge.report.cracks) == 6
    for number, crack in enumerate(bridge.report.cracks, start=1):
        assert f"crack-{number}" in page.ids
        assert text.count(f">{crack.id}</a></td>") == 1
        assert f'aria-label="Close-up of {crack.id}"' in text
        assert f'aria-label="Width along {crack.id}"' in text
    labels = re.findall(r'<a href="#crack-(\d+)"><rect', text)
    assert sorted(labels) == [str(n) for n in range(1, 7)]


def test_page_says_what_an_engineer_asks_first(bridge_report: Path) -> None:
    text = PageReader((bridge_report / "index.html").read_text(encoding="utf-8")).text
    assert "6 cracks found on 32.5 m² inspected (3 surfaces). The widest is wall-01-C001" in text
    assert "The flight was simulated" in text
    for left_out in ("holds no finite point", "planned but not shot", "Shoot it again"):
        assert left_out in text
    for part in (
        "Planned against flown",
        "station-3.ply on station-2.ply 52 % 3.5",
        "global 125",
        "Signature",
    ):
        assert part in text
    assert "wall-01-005.jpg: placed, too few matches; wall-01-006.jpg: rejected, blurred" in text


def test_figures_have_no_more_digits_than_their_uncertainty(bridge: Inspected, bridge_report: Path) -> None:
    text = PageReader((bridge_report / "index.html").read_text(encoding="utf-8")).text
    widest = bridge.report.cracks[0]
    assert widest.width_max_mm is not None  # σ is 0.48 mm
    assert f"width max {widest.width_max_mm:.1f} ± 0.5 mm" in text
    assert f"length {widest.length_mm:.0f} ± 12 mm" in text
    assert "≤ 0.3 mm" in text  # only a bound of the narrowest is known


def test_same_inputs_give_the_same_bytes_in_another_process(
    bridge: Inspected, bridge_report: Path, tmp_path: Path
) -> None:
    (tmp_path / "inputs.pickle").write_bytes(pickle.dumps(bridge))
    program = (
        "import pickle, sys; from pathlib import Path; from artifacts.report import write_report;"
        "here = Path(sys.argv[1]); inspected = pickle.loads((here / 'inputs.pickle').read_bytes());"
        "(here / 'again').mkdir(); write_report(here / 'again', **inspected.report_inputs())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "4711", "OMP_NUM_THREADS": "1", "TZ": "Asia/Tokyo"}
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True, cwd=root, env=environment)
    for name in ("index.html", "cracks.csv", "cracks.json"):
        assert (tmp_path / "again" / name).read_bytes() == (bridge_report / name).read_bytes(), name


def test_hostile_names_stay_words(tmp_path: Path) -> None:
    shelf = Shelf(tmp_path / "in")
    shelf.folder.mkdir()
    seen = [mosaic_of(shelf, HOSTILE, None, [((100, 100), (600, 400), 3.0)], 1, 1.0)]
    left_out = LeftOut(item=HOSTILE, stage=HOSTILE, what=HOSTILE, remedy=HOSTILE)
    inspected = Inspected(shelf, Inspection(name="hostile"), crack_report(HOSTILE, seen, [left_out]), seen)
    out = tmp_path / "out"
    out.mkdir()
    page = written(inspected, out)
    assert page.tags.count("script") == 1  # our own
    assert not [name for name in page.attributes if name.startswith("on")]
    for reference in page.references:
        assert reference.startswith(("#", "data:image/", "cracks."))
    assert "49" not in re.findall(r"&amp;(\d+)", (out / "index.html").read_text(encoding="utf-8"))
    assert "<script>alert(1)</script>" in page.text  # as words


def test_photos_without_scale_are_reported_in_pixels(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    inspected = inspected_photos(tmp_path / "in", [((100, 100), (600, 400), 4.0)])
    page = written(inspected, tmp_path)
    assert "2 cracks found on 2 images; without a scale, sizes are in pixels." in page.text
    assert "No scale is known for these images" in page.text
    assert re.search(r"length \d+ px width max \d\.\d px", page.text)
    assert not {"flight", "registration", "map"} & set(page.ids)
    assert " mm " not in page.text.split("Method and limits")[1].split("Settings")[0]


def test_nothing_found_is_said_with_the_area_and_the_limit(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    page = written(inspected_photos(tmp_path / "in", [], count=1, gsd=2.0), tmp_path)
    assert "No cracks found on 1.86 m² inspected (1 image)." in page.text
    assert "at least as wide as about one pixel, 2.00 mm" in page.text
    assert (tmp_path / "cracks.csv").read_text().count("\n") == 1


def test_scans_and_a_plan_alone_make_a_report(tmp_path: Path) -> None:
    shelf = Shelf(tmp_path)
    built = structure(shelf)
    plan, _ = flight(shelf, built)
    empty = CrackReport(inspection="plan", method="hairline", surfaces=(), cracks=(), not_inspected=())
    out = tmp_path / "out"
    out.mkdir()
    page = written(Inspected(shelf, Inspection(name="plan"), empty, structure=built, plan=plan), out)
    assert "A flight of 63 photos is planned over 3 surfaces; nothing has been inspected yet." in page.text
    assert "Planned against flown" not in page.text
    assert not {"cracks", "surfaces", "registration"} & set(page.ids)


def test_an_empty_inspection_still_makes_a_report(tmp_path: Path) -> None:
    empty = CrackReport(inspection="none", method="hairline", surfaces=(), cracks=(), not_inspected=())
    page = written(Inspected(Shelf(tmp_path), Inspection(name="none"), empty), tmp_path)
    assert "Nothing has been inspected: there is no usable photo." in page.text


def test_photos_that_share_a_name_keep_their_own_cracks(tmp_path: Path) -> None:
    """Photos of one set that stand for themselves are all called after the set."""
    (tmp_path / "in").mkdir()
    inspected = inspected_photos(tmp_path / "in", [((100, 100), (600, 400), 4.0)], count=3)
    seen = [(m.model_copy(update={"name": "set"}), p, d, f) for m, p, d, f in inspected.seen]
    inspected.seen = seen
    page = written(inspected, tmp_path)
    sheets = (tmp_path / "index.html").read_text().split('class="sheet"')[1:]
    assert len(sheets) == 3
    for sheet in sheets:
        assert len(re.findall(r'<a href="#crack-\d+"><rect', sheet.split("</figure>")[0])) == 1
    assert {"crack-1", "crack-2", "crack-3"} <= set(page.ids)


@pytest.mark.slow
def test_many_cracks_stay_within_thirty_megabytes(tmp_path: Path) -> None:
    shelf = Shelf(tmp_path / "in")
    shelf.folder.mkdir()
    rng = np.random.default_rng(0)
    seen = []
    for number in range(20):
        lines = [
            (tuple(rng.uniform(50, 500, 2)), tuple(rng.uniform(50, 500, 2)), rng.uniform(1, 4))
            for _ in range(15)
        ]
        seen.append(mosaic_of(shelf, f"wall-{number:02d}", None, lines, number, 1.0))
    inspected = Inspected(shelf, Inspection(name="many"), crack_report("many", seen), seen)
    page = written(inspected, tmp_path)
    assert len([name for name in page.ids if name.startswith("crack-")]) == 300
    assert (tmp_path / "index.html").stat().st_size < 30e6
