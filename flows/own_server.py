"""A Prefect server of one command's own, without a dashboard.

Prefect would start one too, but a Ctrl-C in the terminal ends that before the command could say how its run
ended, and a killed command leaves it behind."""

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import httpx

from schemas.problem import BadInput

START_S, STOP_S = 120.0, 10.0


def answers(url: str) -> bool:
    with contextlib.suppress(httpx.HTTPError):
        return httpx.get(f"{url}/health", timeout=2.0).status_code == 200
    return False


@contextlib.contextmanager
def own_server() -> Iterator[str]:
    """The URL of its API. It is apart from the terminal and ends when this process does, however it ends."""
    from prefect.settings import get_current_settings

    environment = os.environ | get_current_settings().to_environment_variables(exclude_unset=True)
    environment.pop("PREFECT_API_URL", None)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        url = f"http://127.0.0.1:{listening.getsockname()[1]}/api"
        server = subprocess.Popen(
            [sys.executable, "-m", "flows.own_server", str(listening.fileno())],
            env=environment,
            stdin=subprocess.PIPE,
            pass_fds=[listening.fileno()],
            start_new_session=True,
        )
    try:
        _wait_for(server, url)
        yield url
    finally:
        server.communicate()  # closes its standard input, which ends it


def _wait_for(server: "subprocess.Popen[bytes]", url: str) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until and server.poll() is None:
        if answers(url):
            return
        time.sleep(0.1)
    server.kill()
    remedy = "Start one by `hairline serve` in another terminal, which says more, then try again"
    raise BadInput("Prefect", "its server does not start", remedy)


def main(descriptor: int) -> None:
    """The server's process: serves on the socket until standard input ends."""
    import uvicorn
    from prefect.server.api.server import create_app

    app = create_app(ephemeral=True, final=True)
    server = uvicorn.Server(uvicorn.Config(app, log_level="critical", lifespan="on"))

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        server.should_exit = True
        time.sleep(STOP_S)
        os._exit(0)

    threading.Thread(target=end_with_parent, daemon=True).start()
    server.run(sockets=[socket.socket(fileno=descriptor)])


if __name__ == "__main__":
    main(int(sys.argv[1]))
