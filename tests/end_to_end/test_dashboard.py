"""The dashboard as a user sees it: `hairline serve`, `prefect deployment run`, headless Chromium."""

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import httpx
import pytest

from tests.end_to_end.commands import HAIRLINE, PREFECT, REPOSITORY, environment
from tests.small_inspection import write_inspection

pytestmark = pytest.mark.slow
CHROMIUM = shutil.which("chromium")
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--virtual-time-budget=20000"),
]


@dataclass(frozen=True)
class Served:
    url: str
    reports: str
    folder: Path

    def ask(self, what: str) -> list[dict[str, Any]]:
        answer = httpx.post(f"{self.url}/api/{what}/filter", json={}, timeout=20)
        found: list[dict[str, Any]] = answer.json()
        return found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """`hairline serve` on free ports, and one finished run of inspect-bridge started through Prefect."""
    folder = tmp_path_factory.mktemp("served")
    write_inspection(folder / "site", photos=2)
    port, report_port = free_port(), free_port()
    log = folder / "serve.log"
    with log.open("w") as stream:
        words = [str(HAIRLINE), "serve", "--port", str(port), "--report-port", str(report_port)]
        server = subprocess.Popen(words, cwd=folder, env=environment(folder), stdout=stream, stderr=stream)
        try:
            here = Served(f"http://127.0.0.1:{port}", f"http://127.0.0.1:{report_port}", folder)
            wait(lambda: "Ctrl-C ends" in log.read_text(), log)
            wait(lambda: len(here.ask("deployments")) == 4, log)
            run_deployment(here)
            wait(lambda: [r["state_type"] for r in here.ask("flow_runs")] == ["COMPLETED"], log)
            yield here
        finally:
            server.terminate()
            server.wait(timeout=60)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def wait(done: Any, log: Path, limit_s: float = 180) -> None:
    until_s = time.monotonic() + limit_s
    while not done():
        assert time.monotonic() < until_s, log.read_text()[-3000:]
        time.sleep(0.5)


def run_deployment(here: Served) -> None:
    """In the repository's folder, where pyproject.toml switches Prefect's plugins on."""
    words = [
        "deployment",
        "run",
        "inspect-bridge",
        "--param",
        f"inspection={here.folder}/site/inspection.yaml",
    ]
    subprocess.run(
        [str(PREFECT), *words],
        cwd=REPOSITORY,
        env=environment(here.folder, PREFECT_API_URL=f"{here.url}/api"),
        check=True,
        capture_output=True,
        timeout=120,
    )


def test_the_four_flows_are_deployed(served: Served) -> None:
    names = sorted(deployment["name"] for deployment in served.ask("deployments"))
    assert names == ["collect-images", "detect-cracks", "inspect-bridge", "model-structure"]


def test_the_report_is_hosted_where_the_artifact_points(served: Served) -> None:
    page = httpx.get(f"{served.reports}/small/report/index.html").text
    assert "wall-1.jpg" in page
    [report] = [a for a in served.ask("artifacts") if a["key"] == "report"]
    assert f"{served.reports}/small/report/index.html" in report["data"]


@pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium: apt-get install chromium")
def test_the_run_its_graph_and_a_picture_appear_in_the_browser(served: Served, tmp_path: Path) -> None:
    [run] = served.ask("flow_runs")
    page = f"{served.url}/runs/flow-run/{run['id']}"
    assert run["name"] in dom(page, tmp_path)
    assert has_green_bars(screenshot(page, tmp_path))
    picture = next(a for a in served.ask("artifacts") if a["key"].startswith("detection-"))
    assert '<img src="data:image/' in dom(f"{served.url}/artifacts/artifact/{picture['id']}", tmp_path)


def chromium(tmp_path: Path, *words: str) -> str:
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [str(CHROMIUM), *FLAGS, profile, *words], capture_output=True, text=True, timeout=120, check=False
    )
    return done.stdout


def dom(url: str, tmp_path: Path) -> str:
    return chromium(tmp_path, "--dump-dom", url)


def screenshot(url: str, tmp_path: Path) -> Any:
    chromium(tmp_path, "--window-size=1400,900", f"--screenshot={tmp_path / 'page.png'}", url)
    return cv2.imread(str(tmp_path / "page.png"))


def has_green_bars(picture: Any) -> bool:
    """The graph draws each finished task as a green bar: some thousand pixels of that one colour."""
    hsv = cv2.cvtColor(picture, cv2.COLOR_BGR2HSV)
    green = (abs(hsv[..., 0].astype(int) - 68) < 12) & (hsv[..., 1] > 150) & (hsv[..., 2] > 100)
    return int(green[100:500].sum()) > 3000
