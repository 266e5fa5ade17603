"""`hairline serve`: the Prefect server if none runs, the deployments, and the host of the reports."""

import functools
import http.server
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import cast

from flows.console import out
from flows.own_server import answers
from schemas.problem import BadInput


def serve_everything(port: int, report_port: int) -> int:
    from flows.dead_runs import mark_dead_runs

    url = f"http://127.0.0.1:{port}/api"
    os.environ["PREFECT_API_URL"] = url
    os.environ["PREFECT_LOGGING_LEVEL"] = "INFO"  # the dashboard shows the log of each run
    os.environ["HAIRLINE_REPORT_URL"] = f"http://127.0.0.1:{report_port}"
    host = host_reports(Path("runs"), report_port)
    server = None if answers(url) else _start_server(port, url)
    try:
        mark_dead_runs()
        out.print(f"Dashboard: http://127.0.0.1:{port}   Reports: http://127.0.0.1:{report_port}")
        serve_deployments()
    finally:
        host.shutdown()
        if server is not None:
            server.terminate()
            server.wait(timeout=20)
    return 0


def serve_deployments() -> None:
    """The four flows as deployments, run by this process when somebody asks; blocks until interrupted."""
    from prefect import serve
    from prefect.deployments.runner import RunnerDeployment

    from flows.collect_images import collect_images
    from flows.detect_cracks import detect_cracks
    from flows.inspect_bridge import inspect_bridge
    from flows.model_structure import model_structure

    flows = (model_structure, collect_images, detect_cracks, inspect_bridge)
    out.print("Deployments: " + ", ".join(flow.name for flow in flows) + ". Ctrl-C ends.")
    deployments = [flow.to_deployment(name=flow.name) for flow in flows]
    serve(*cast(list[RunnerDeployment], deployments), limit=1)


def host_reports(folder: Path, port: int) -> http.server.ThreadingHTTPServer:
    """Serve a folder's files on 127.0.0.1, from a thread."""
    folder.mkdir(parents=True, exist_ok=True)
    handler = functools.partial(_QuietHandler, directory=str(folder))
    try:
        host = http.server.ThreadingHTTPServer(("127.0.0.1", port), handler)
    except OSError as problem:
        raise BadInput(
            f"port {port}", f"cannot be used ({problem.strerror})", "Give another --report-port"
        ) from None
    threading.Thread(target=host.serve_forever, daemon=True).start()
    return host


class _QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


def _start_server(port: int, url: str) -> "subprocess.Popen[bytes]":
    out.print("Starting the Prefect server …")
    environment = os.environ | {"PREFECT_UI_API_URL": url}
    environment.pop("PREFECT_API_URL")
    server = subprocess.Popen(
        [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1", "--port", str(port)],
        env=environment,
        stdout=subprocess.DEVNULL,
    )
    for _ in range(240):
        if answers(url):
            return server
        if server.poll() is not None:
            break
        time.sleep(0.5)
    server.terminate()
    raise BadInput(f"port {port}", "the Prefect server did not start there", "Give another --port")
