from collections.abc import Iterator

import pytest

from artifacts import store


@pytest.fixture(scope="module", autouse=True)
def own_store() -> Iterator[store.Store]:
    with store.temporary() as fresh:
        yield fresh
