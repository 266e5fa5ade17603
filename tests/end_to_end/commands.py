"""Running the real commands in a folder of their own, as a user does."""

import os
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
HAIRLINE = Path(sys.executable).with_name("hairline")
PREFECT = Path(sys.executable).with_name("prefect")


def environment(home: Path, **more: str) -> dict[str, str]:
    """The user's environment, with a Prefect home of its own and no server configured."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PREFECT_", "HAIRLINE_"))}
    return (
        clean | {"PREFECT_HOME": str(home / ".prefect"), "PREFECT_SERVER_ANALYTICS_ENABLED": "false"} | more
    )


def hairline(
    *words: str, cwd: Path, expect: int | None = 0, timeout_s: float = 600, **more: str
) -> "subprocess.CompletedProcess[str]":
    result = subprocess.run(
        [str(HAIRLINE), *words],
        cwd=cwd,
        env=environment(cwd, **more),
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )
    said = result.stdout + result.stderr
    assert "Traceback" not in said, said
    if expect is not None:
        assert result.returncode == expect, said
    return result
