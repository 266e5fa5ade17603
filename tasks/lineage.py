"""Which result of a run came from which task run: the edges of the graph in the dashboard.

Prefect finds edges by the identity of any value it meets, so that two photos with one camera, or with one
surface's name, look as if the second came from the first. Here only contracts count, and what came from
outside is known as such.
"""

from collections.abc import Iterator
from typing import Any

from schemas.contract import Contract


class Lineage:
    """`enter` the inputs of a stage before it runs, and `leave` its result after."""

    def __init__(self) -> None:
        # by identity; the contract is kept beside its source so that no other takes its identity over
        self._known: dict[int, tuple[Contract, Any]] = {}

    def enter(self, inputs: Any) -> list[Any]:
        """The sources of these inputs, in their order; whatever has none came from outside."""
        sources: list[Any] = []
        for contract in self._top(inputs):
            source = self._known.setdefault(id(contract), (contract, None))[1]
            if source is not None and source not in sources:
                sources.append(source)
        return sources

    def leave(self, result: Any, source: Any) -> None:
        """Every contract within this result that is not known yet comes from here."""
        for contract in _contracts(result):
            self._known.setdefault(id(contract), (contract, source))

    def _top(self, value: Any) -> Iterator[Contract]:
        """Contracts within a value, not looking into those that some stage made."""
        for contract in _roots(value):
            yield contract
            if self._known.get(id(contract), (contract, None))[1] is None:
                yield from self._top(list(contract.__dict__.values()))


def _contracts(value: Any) -> Iterator[Contract]:
    for contract in _roots(value):
        yield contract
        yield from _contracts(list(contract.__dict__.values()))


def _roots(value: Any) -> Iterator[Contract]:
    if isinstance(value, Contract):
        yield value
    elif isinstance(value, dict):
        yield from _roots(list(value.values()))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _roots(part)
