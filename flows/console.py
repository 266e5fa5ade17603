"""What the terminal shows of a run: a line for each stage, bars for long ones, a line for a problem."""

import sys
from collections import Counter
from threading import Lock

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from tasks.run import Event

out = Console(highlight=False, soft_wrap=True)
err = Console(stderr=True, highlight=False, soft_wrap=True)


class StageLines:
    """Listens to a run. In a terminal stages under way are bars; elsewhere each ends as one plain line."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=out, transient=True
        )
        self._bars: dict[tuple[str, str], TaskID] = {}
        self._open: str = ""  # stage whose items are being counted
        self._counts: Counter[str] = Counter()
        self._last_detail = ""
        self._broken: set[str] = set()  # stages that end the run, whatever other items come to
        self._lock = Lock()

    def __enter__(self) -> "StageLines":
        if sys.stdout.isatty():
            self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._close()
        if self._progress.live.is_started:
            self._progress.stop()

    def __call__(self, event: Event) -> None:
        with self._lock:
            if event.outcome in ("started", "progress"):
                self._show(event)
                return
            if event.outcome == "noted":
                out.print(f"  [yellow]![/yellow] {plain(event.detail)}")
                return
            bar = self._bars.pop((event.stage, event.item), None)
            if bar is not None:
                self._progress.remove_task(bar)
            if event.outcome == "broke":
                self._broken.add(event.stage)
            if event.outcome in ("failed", "broke"):
                out.print(f"  [red]✗[/red] {_readable(event.stage)}: {plain(event.detail)}")
                return
            if event.stage != self._open:
                self._close()
                self._open = event.stage
            self._counts[event.outcome] += 1
            self._last_detail = event.detail or self._last_detail

    def _show(self, event: Event) -> None:
        key = (event.stage, event.item)
        if event.stage and event.stage != self._open:
            self._close()
            self._open = event.stage
            if not sys.stdout.isatty():
                out.print(f"  … {_readable(event.stage)}")
        if key not in self._bars:
            self._bars[key] = self._progress.add_task(_label(event), total=1.0)
        self._progress.update(self._bars[key], completed=event.fraction)

    def _close(self) -> None:
        """Print the line of the stage whose items have all come."""
        if not self._counts:
            return
        ran, cached, will = self._counts["ran"], self._counts["cached"], self._counts["will run"]
        items = f" ×{ran + cached + will}" if ran + cached + will > 1 else ""
        words = []
        if ran:
            words.append(self._last_detail if not items else f"{ran} ran")
        if cached:
            words.append("cached" if cached == 1 and not (ran or will) else f"{cached} cached")
        if will:
            words.append(f"{will if will > 1 else ''} will run: {self._last_detail}".strip())
        mark = "→" if will else "[green]✓[/green]"
        if self._open not in self._broken:
            out.print(f"  {mark} {_readable(self._open)}{items}: {plain(', '.join(words))}")
        self._open, self._counts, self._last_detail = "", Counter(), ""


def _readable(stage: str) -> str:
    return stage.replace("_", " ")


def _label(event: Event) -> str:
    return plain(f"{_readable(event.stage)} {event.item}".strip())


def plain(text: str) -> str:
    """A text as it stands: without the console's markup, and what a terminal would obey or cannot show (of a
    file's name, mostly) as an escape."""
    shown = (c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text)
    return "".join(shown).replace("[", r"\[")
