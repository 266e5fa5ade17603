"""The key of a stage's result: its name, its code and the content of its inputs.

Code is the AST, without docstrings, of every module of ours that the stage's own module reaches by
imports, the data files these name (DATA_FILES), and the installed versions of the distributions they
import: an edit to an algorithm changes the key, an edit to a comment does not.
"""

import ast
import hashlib
import importlib.metadata
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic_core import to_json

ROOT = Path(__file__).parents[1]
PARSING = Lock()  # CPython 3.11 counts the depth of a tree for all threads at once, and raises SystemError
OURS = ("artifacts", "flows", "schemas", "tasks")
# The mechanism of caching and what only shows results cannot change a result.
WITHOUT_INFLUENCE = (
    "tasks.stage",
    "tasks.content_key",
    "tasks.run",
    "artifacts.store",
    "artifacts.page",
    "artifacts.picture",
)


def digest_inputs(inputs: Mapping[str, Any]) -> dict[str, str]:
    """A SHA-256 for each input; Files count by their content, never by path or time."""
    return {name: hashlib.sha256(to_json(value)).hexdigest() for name, value in inputs.items()}


@cache
def digest_code(module: str) -> dict[str, str]:
    """A digest for each module and data file of ours that `module` reaches, a version for each distribution.

    The keys are file names relative to the repository, or distribution names."""
    parts: dict[str, str] = {}
    imported: set[str] = set()
    waiting, seen = [module], set(WITHOUT_INFLUENCE)
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        digests, targets = _module(name)
        parts |= digests
        for target in targets:
            if target.split(".")[0] in OURS:
                waiting.append(target)
            else:
                imported.add(target.split(".")[0])
    return dict(sorted(parts.items())) | _versions(imported)


@cache
def _module(name: str) -> tuple[Mapping[str, str], tuple[str, ...]]:
    """The digests of a module of ours and its data files, and what it imports; stages share most of them."""
    path = _source(name)
    if path is None:
        return {}, ()
    with PARSING:
        tree = ast.parse(path.read_bytes())
    tree = _without_docstrings(tree)
    digests = {path.relative_to(ROOT).as_posix(): _sha(ast.dump(tree).encode())}
    for data in _data_files(tree):
        file = path.parent / data
        digests[file.relative_to(ROOT).as_posix()] = _sha(file.read_bytes())
    return digests, tuple(_imports(tree))


@cache
def digest_of_look() -> str:
    """Of the modules that draw pages: they do not change a result, but how it is shown."""
    sources = [_source(name) for name in WITHOUT_INFLUENCE if name.startswith("artifacts.")]
    return _sha(b"".join(path.read_bytes() for path in sources if path is not None))[:16]


def content_key(stage: str, code: Mapping[str, str], inputs: Mapping[str, str], redo: str | None) -> str:
    """The cache key, readable in its first part: `<stage>-<64 hex digits>`."""
    return f"{stage}-{_sha(to_json([stage, dict(code), dict(inputs), redo]))}"


def _sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _source(module: str) -> Path | None:
    base = ROOT.joinpath(*module.split("."))
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if path.is_file():
            return path
    return None


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = node.body[1:]
    return tree


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            # `from tasks.planning import astar` names a module, `from … import Plane` does not
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _data_files(tree: ast.Module) -> list[str]:
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(
            isinstance(target, ast.Name) and target.id == "DATA_FILES" for target in node.targets
        ):
            return list(ast.literal_eval(node.value))
    return []


@cache
def _distributions() -> Mapping[str, list[str]]:
    return importlib.metadata.packages_distributions()


def _versions(packages: set[str]) -> dict[str, str]:
    third_party = packages - set(sys.stdlib_module_names)
    names = {name for package in third_party for name in _distributions().get(package, [])}
    return {name: importlib.metadata.version(name) for name in sorted(names)}
