"""The key follows the code and the content, and nothing else."""

import ast
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from schemas.problem import LeftOut
from tasks import content_key
from tasks.content_key import digest_code, digest_inputs


def code_digest(source: str) -> str:
    return ast.dump(content_key._without_docstrings(ast.parse(source)))


def test_comments_and_docstrings_do_not_change_the_key_but_code_does() -> None:
    plain = code_digest("def f(x):\n    return x + 1\n")
    assert code_digest('"""Doc."""\ndef f(x):\n    """Adds one."""\n    return x + 1  # one\n') == plain
    assert code_digest("def f(x):\n    return x + 2\n") != plain


def test_code_reaches_through_imports_but_not_into_other_stages() -> None:
    parts = digest_code("tasks.surfaces.task")
    assert "tasks/surfaces/task.py" in parts
    assert "tasks/surfaces/ransac.py" in parts
    assert "schemas/surface.py" in parts
    assert not any(part.startswith("tasks/planning") for part in parts)
    assert "tasks/stage.py" not in parts


def test_versions_of_the_libraries_that_are_imported_count() -> None:
    assert "numpy" in digest_code("tasks.surfaces.task")
    assert "pymavlink" not in digest_code("tasks.surfaces.task")


def test_inputs_are_digested_by_content() -> None:
    one = LeftOut(item="a", stage="s", what="w")
    assert digest_inputs({"x": (one,)}) == digest_inputs({"x": (one.model_copy(),)})
    assert digest_inputs({"x": one}) != digest_inputs({"x": one.model_copy(update={"what": "v"})})


def test_threads_parse_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Together they raise SystemError now and then, in CPython 3.11."""
    parse, inside, most = ast.parse, [], []

    def watched(*given: Any) -> ast.Module:
        inside.append(1)
        most.append(len(inside))
        time.sleep(0.01)
        inside.pop()
        return parse(*given)

    monkeypatch.setattr(ast, "parse", watched)
    content_key._module.cache_clear()
    names = ["schemas.camera", "schemas.photo", "schemas.plane", "schemas.surface"]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(content_key._module, names))
    assert len(most) == 4 and max(most) == 1
