"""The key follows the code and the content, and nothing else."""

import ast

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
