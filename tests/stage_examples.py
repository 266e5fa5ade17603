"""Small stages to test the contract with. `calls` counts how often each body really ran."""

from collections import Counter

from artifacts import store
from artifacts.page import Page
from schemas.file import File
from schemas.problem import BadInput, LeftOut
from tasks.stage import progress, stage

calls: Counter[str] = Counter()


@stage(unkeyed=("workers",), pages=lambda inputs, result: [Page(key="shout", markdown=f"# {result.what}")])
def shout(name: str, times: int, workers: int = 1) -> LeftOut:
    """Shout a name."""
    calls["shout"] += 1
    progress(0.5)
    if name == "nobody":
        raise BadInput(name, "cannot be shouted", "Give a name")
    return LeftOut(item=name, stage="shout", what=name.upper() * times)


@stage()
def copy_text(name: str, file: File) -> File:
    """Write the file's text in capitals."""
    calls["copy_text"] += 1
    with store.current().scratch() as folder:
        path = folder / "copy.txt"
        path.write_text(store.current().path(file).read_text().upper())
        return store.current().put(path)


@stage()
def flaky(name: str) -> LeftOut:
    """Fails the first time as a disk or a network does."""
    calls["flaky"] += 1
    if calls["flaky"] == 1:
        raise OSError("the disk was busy")
    return LeftOut(item=name, stage="flaky", what="worked")


@stage(effects=True)
def launch(name: str, mission: str) -> LeftOut:
    """Acts on the world; fails as a vehicle does."""
    calls["launch"] += 1
    raise OSError("link lost")


@stage()
def lies(name: str) -> LeftOut:
    """Returns what it did not promise."""
    return 3  # type: ignore[return-value]


@stage()
def join(name: str, parts: tuple[LeftOut, ...]) -> LeftOut:
    """Made of other results; it keeps the first of them, as a photo keeps its camera."""
    return LeftOut(item=name, stage=parts[0].stage, what=parts[0].what)
