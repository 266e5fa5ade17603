"""The orbitable view holds the scene as it is, and a browser draws it."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

from artifacts.orbit import MOST_CLOUD_POINTS, orbit_view
from artifacts.view3d import Scene, is_ground
from tests.artifacts.bridge import Shelf, flight, structure

CHROMIUM = shutil.which("chromium")


def layer(view: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    one = next(layer for layer in view["layers"] if layer["name"] == name)
    positions = np.frombuffer(base64.b64decode(one["positions"]), "<f4").reshape(-1, 3)
    return positions, np.frombuffer(base64.b64decode(one["colours"]), np.uint8).reshape(-1, 3)


def test_the_triangles_cover_each_surface_once(tmp_path: Path) -> None:
    built = structure(Shelf(tmp_path))
    view = orbit_view(Scene(built))
    assert view is not None
    corners, colours = layer(view, "Surfaces")
    assert len(colours) == len(corners)
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2).astype(float)
    area_m2 = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    outlined = [s for s in built.surfaces if not is_ground(s)]
    truth_m2 = sum(shapely.Polygon(s.outline_m, s.holes_m).area for s in outlined)
    assert area_m2 == pytest.approx(truth_m2, rel=1e-5)
    assert [label["text"] for label in view["labels"]] == [s.name for s in outlined]


def test_what_is_far_from_the_origin_stays_exact_and_a_large_cloud_is_thinned() -> None:
    rng = np.random.default_rng(1)
    points_m = np.array([500_000.0, 4_000_000.0, 100.0]) + rng.uniform(-5, 5, (300_000, 3))
    view = orbit_view(Scene(), (points_m, np.zeros(len(points_m), dtype=np.intp)))
    assert view is not None
    positions, _ = layer(view, "Cloud by station")
    assert 0.9 * MOST_CLOUD_POINTS < len(positions) <= MOST_CLOUD_POINTS
    apart = points_m[::5] - points_m[0]
    assert np.abs((positions - positions[0]) - apart).max() < 1e-5


def test_a_frustum_is_drawn_for_each_shot(tmp_path: Path) -> None:
    shelf = Shelf(tmp_path)
    plan, _log = flight(shelf, structure(shelf))
    view = orbit_view(Scene(plan=plan))
    assert view is not None
    assert len(layer(view, "What each photo sees")[0]) == 16 * len(plan.shooting_points)


def test_an_empty_scene_has_no_view() -> None:
    assert orbit_view(Scene()) is None


@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium: apt-get install chromium")
def test_a_browser_draws_it(bridge_report: Path, tmp_path: Path) -> None:
    """The view alone on a page of its own: each layer is drawn, and the picture is not empty."""
    text = (bridge_report / "index.html").read_text(encoding="utf-8")
    figure = re.search(r'<figure class="orbit">.*?</figure>', text, re.DOTALL)
    style = re.search(r"<style>.*?</style>", text, re.DOTALL)
    script = re.findall(r"<script>.*?</script>", text, re.DOTALL)[-1]
    assert figure and style
    page = tmp_path / "orbit.html"
    page.write_text(f"<!DOCTYPE html>{style[0]}<body>{figure[0]}{script}</body>", encoding="utf-8")
    shown = sum(one["shown"] for one in json.loads(re.search(r"json\">(.*?)</script>", text)[1])["layers"])
    words = [str(CHROMIUM), "--headless", "--no-sandbox", "--use-angle=swiftshader", "--hide-scrollbars"]
    words += ["--enable-unsafe-swiftshader", "--virtual-time-budget=2000", "--window-size=1000,700"]
    drawn = subprocess.run([*words, "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=120)
    assert f'data-drawn="{shown}"' in drawn.stdout
    subprocess.run(
        [*words, f"--screenshot={tmp_path / 'a.png'}", page.as_uri()], capture_output=True, timeout=120
    )
    pixels = np.asarray(Image.open(tmp_path / "a.png").convert("RGB"))[:620]
    assert (pixels < 200).any(axis=2).mean() > 0.1
