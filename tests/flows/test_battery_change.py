"""A plan of two batteries: a vehicle stands still until somebody runs again; a rehearsal flies both."""

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from flows import battery_change, collect_images, inspect_bridge, running
from flows.battery_change import WaitingForBattery, wait_for_battery
from flows.command_line import EXIT_WAITING_FOR_FLIGHT
from flows.opening import OpenRun
from tasks.simulation.vehicle import start_vehicle
from tests.flight.test_battery_flights import PLAN

Run = Callable[[str], tuple[int, str]]


@pytest.fixture
def run(
    prefect_server: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Run:
    """Runs an inspection with this connection, or a rehearsal without one, whose plan is PLAN; gives its exit
    code and what it printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(collect_images, "plan", lambda inspection, structure: PLAN)
    monkeypatch.setattr(inspect_bridge, "inspect", collected_alone)

    def run_it(connection: str) -> tuple[int, str]:
        flight = f"flight: vehicle\nconnection: {connection}" if connection else "flight: simulated"
        camera = "camera: {width_px: 1632, height_px: 1224, focal_px: 4000}"
        Path("inspection.yaml").write_text(f"name: two\n{flight}\n{camera}\n")
        code = running.run_inspection("inspection.yaml", None, (), None, ())
        return code, capsys.readouterr().out

    return run_it


def collected_alone(run: OpenRun) -> None:
    structure = SimpleNamespace(surfaces=())
    run.save_collected(collect_images.collect(run.inspection, run.base, structure, run.save_plan))  # type: ignore[arg-type]


def test_a_vehicle_flies_one_battery_a_run(run: Run, tmp_path: Path) -> None:
    archives = tmp_path / "runs/two/flight"
    with start_vehicle(PLAN, 3) as url:
        code, printed = run(url)
        assert code == EXIT_WAITING_FOR_FLIGHT == 3
        assert "Battery 1 of 2 is flown" in printed
        assert "hairline run inspection.yaml" in printed
        assert re.search(r"✓ fly: \d+\.\d s", printed)
        assert not archives.exists()
        code, printed = run(url)
        assert code == 0
        assert "✓ fly ×2: 1 ran, 1 cached" in printed
        assert sorted(path.name for path in archives.glob("*.mcap")) == ["flight-2.mcap", "flight.mcap"]
    code, printed = run(url)  # the vehicle is gone
    assert (code, "✓ fly ×2: 2 cached" in printed) == (0, True)


def test_a_rehearsal_flies_every_battery_in_one_run(run: Run) -> None:
    code, printed = run("")
    assert (code, "✓ fly ×2: 2 ran" in printed) == (0, True)


def test_a_run_of_the_dashboard_is_suspended_until_somebody_resumes_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[object] = []
    monkeypatch.setattr(battery_change, "deployed", lambda: True)
    monkeypatch.setattr(battery_change, "publish", lambda page: said.append(page.markdown))
    monkeypatch.setattr(battery_change, "suspend_flow_run", lambda key, timeout: said.append(key))
    wait_for_battery(2, 3)
    assert said[1] == "battery-2"
    assert "Battery 2 of 3 is flown" in str(said[0])
    monkeypatch.setattr(battery_change, "deployed", lambda: False)
    with pytest.raises(WaitingForBattery, match="Battery 2 of 3"):
        wait_for_battery(2, 3)
