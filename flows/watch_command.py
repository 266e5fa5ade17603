"""`hairline watch`: photos are judged as they arrive: a missing or blurred one is known before landing."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from flows.command_line import EXIT_WAITING_FOR_FLIGHT, app
from flows.console import err, plain
from flows.console import out as console
from flows.photo_files import PHOTO_SUFFIXES, holds_photos, is_hidden
from flows.plain_files import read_camera, read_contract, say
from schemas.arrival import Arrival
from schemas.problem import BadInput

if TYPE_CHECKING:
    from schemas.camera import Camera
    from schemas.flight_plan import FlightPlan
    from schemas.photo import Photo

POLL_S = 0.5  # a look at the folder costs little, and works on network shares too
STILL_S = 1.0  # without a change for this long, a file is taken for written
PATIENCE_S = 15.0  # a file that cannot be read may be one whose writing has stopped for a while


@app.command
def watch(folder: Path, *, plan: Path | None = None, camera: Path | None = None) -> int:
    """Watch a folder while photos arrive: says of each within seconds whether it is good, and what lacks.

    A photo is good that can be read, is sharp (against those before), well exposed, no duplicate and, with a
    plan, taken at one of its shooting points. Ends when every shooting point has a good photo, or on Ctrl-C.

    Exit codes: 0 no shooting point lacks a photo, 3 some do.

    Parameters
    ----------
    folder:
        Where the photos arrive; those that are there already are judged first.
    plan:
        The plan.json of `hairline plan`.
    camera:
        Camera file, where a photo of another camera is to be told.
    """
    from schemas.flight_plan import FlightPlan

    if not folder.is_dir():
        raise BadInput(str(folder), "no such folder", "Name the folder that the photos arrive in")
    flight = read_contract(plan, FlightPlan) if plan else None
    lens = read_camera(camera) if camera else None
    session = Session(folder, flight, lens)
    console.print(f"Watching {folder} (Ctrl-C ends)", markup=False)
    for path in sorted(folder.iterdir()):
        if path.is_dir() and holds_photos(path):
            text = f"{path} holds photos too, and is not watched: watch it instead, or in another window"
            console.print(f"[yellow]{plain(text)}[/yellow]")
    try:
        for arrival in session.arrivals():
            _tell(arrival, session)
            if flight and not session.missing:
                break
    except KeyboardInterrupt:
        console.print()
    return _summary(session)


@dataclass
class Session:
    """The photos that have arrived in a folder so far."""

    folder: Path
    plan: "FlightPlan | None"
    camera: "Camera | None"
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep
    photos: "dict[str, Photo]" = field(default_factory=dict)
    unreadable: dict[str, Arrival] = field(default_factory=dict)
    judged: dict[str, Arrival] = field(default_factory=dict)
    missing: tuple[str, ...] = ()  # shooting points without a good photo

    def __post_init__(self) -> None:
        self._judge()

    def arrivals(self) -> Iterator[Arrival]:
        """Each new photo's status, and that of an earlier one whose status has changed; never ends by
        itself."""
        seen: dict[str, tuple[tuple[int, int], float]] = {}  # size and time of writing, and since when
        while True:
            busy = False
            for path in _photos(self.folder):
                try:
                    stat = path.stat()
                except OSError:  # renamed or taken away between two looks
                    continue
                state, now = (stat.st_size, stat.st_mtime_ns), self.clock()
                if path.name not in seen or seen[path.name][0] != state:
                    seen[path.name] = state, now
                    self.unreadable.pop(path.name, None)  # it is being written after all
                still_s = now - seen[path.name][1]
                done = path.name in self.photos or path.name in self.unreadable
                if done or still_s < STILL_S or not self._read(path, still_s):
                    continue
                busy = True
                yield from self._changes()
            if not busy:
                self.sleep(POLL_S)

    def _read(self, path: Path, still_s: float) -> bool:
        """Whether the photo has been read, or given up."""
        from artifacts import store
        from tasks.photos.task import ingest

        try:
            with store.temporary():
                photo = ingest.bare(store.current().put(path), path.name, "watched", self.camera, None, 5.0)
        except (BadInput, OSError) as problem:
            if still_s < PATIENCE_S:
                return False
            what = problem.what if isinstance(problem, BadInput) else f"cannot be read ({problem.strerror})"
            self.unreadable[path.name] = Arrival(name=path.name, faults=(what,))
            return True
        self.photos[path.name] = photo
        return True

    def _changes(self) -> list[Arrival]:
        before = dict(self.judged)
        self._judge()
        return [arrival for name, arrival in self.judged.items() if before.get(name) != arrival]

    def _judge(self) -> None:
        from tasks.photos.task import judge

        arrivals, self.missing = judge(tuple(self.photos.values()), self.plan)
        self.judged = {arrival.name: arrival for arrival in arrivals} | self.unreadable


def _photos(folder: Path) -> list[Path]:
    """By the time of writing, then by name: as the camera took them."""
    try:
        found = [
            p
            for p in folder.iterdir()
            if p.suffix.lower() in PHOTO_SUFFIXES and not is_hidden(p.name) and p.is_file()
        ]
        return sorted(found, key=lambda p: (p.stat().st_mtime_ns, p.name))
    except OSError:  # a card pulled out, a file renamed just now: the next look tells
        return []


def _tell(arrival: Arrival, session: Session) -> None:
    mark = "[red]✗[/red]" if arrival.faults else "[green]✓[/green]"
    words = [*arrival.faults, *([arrival.note] if arrival.note else [])]
    words += [f"point {arrival.point}"] if arrival.point else []
    words += [f"{len(session.missing)} points to go"] if session.plan else []
    console.print(f"  {mark} {plain(arrival.name)}: {plain(', '.join(words) or 'good')}")


def _summary(session: Session) -> int:
    bad = [arrival for arrival in session.judged.values() if arrival.faults]
    say(f"{len(session.judged) - len(bad)} good photos, {len(bad)} to shoot again")
    if bad:
        table = Table("photo", "what is wrong", box=None, pad_edge=False)
        for arrival in bad:
            table.add_row(plain(arrival.name), plain("; ".join(arrival.faults)))
        console.print(table)
    waiting = [path.name for path in _photos(session.folder) if path.name not in session.judged]
    if waiting:
        err.print(f"[yellow]Not judged yet: {plain(', '.join(waiting))}[/yellow]")
    if session.plan is None:
        return 0
    if not session.missing:
        say("Every shooting point has its photo")
        return 0
    at = {w.photo: w for w in session.plan.shooting_points}
    table = Table("point", "surface", "east m", "north m", "up m", box=None, pad_edge=False)
    for name in session.missing:
        waypoint = at.get(name)
        if waypoint is not None:
            table.add_row(name, waypoint.surface or "", *(f"{x:.1f}" for x in waypoint.position_m))
    err.print(f"[yellow]{len(session.missing)} shooting points have no good photo:[/yellow]")
    console.print(table)
    return EXIT_WAITING_FOR_FLIGHT
