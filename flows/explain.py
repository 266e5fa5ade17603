"""What is wrong in a file that a person wrote, in words: every mistake, the key nearest to an unknown one."""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from schemas.inspection import Inspection
from schemas.problem import BadInput


def explain(item: str, problem: ValidationError, contract: type[BaseModel]) -> BadInput:
    """All that keeps a file's content from being what it is read as, as one error."""
    what: list[str] = []
    remedies = ["Correct that"]
    for error in problem.errors():
        key = _path(error["loc"])
        if error["type"] == "extra_forbidden":
            *above, own = error["loc"]
            known = _keys_at(contract, above)
            near = get_close_matches(str(own), known, 1)
            what.append(f"unknown key {key!r}" + (f" (is it {near[0]!r}?)" if near else ""))
            if not near:
                remedies.append(f"The keys of {_path(above)} are {', '.join(known)}")
        else:
            what.append(_of_known(key, error))
    if contract is Inspection:
        remedies.append("The comments in the file that `hairline init` writes explain the keys")
    return BadInput(item, "; ".join(what), ". ".join(dict.fromkeys(remedies)))


def _of_known(key: str, error: ErrorDetails) -> str:
    if error["type"] == "missing":
        return f"key {key!r} is missing"
    return f"key {key!r} cannot be {error['input']!r} ({error['msg'].removeprefix('Value error, ')})"


def _path(keys: Sequence[int | str]) -> str:
    return ".".join(str(key) for key in keys) or "the file"


def _keys_at(contract: type[BaseModel], above: Sequence[int | str]) -> list[str]:
    """The keys that may stand below others."""
    contracts = [contract]
    for key in above:
        fields = [one.model_fields[key] for one in contracts if key in one.model_fields]
        if fields:  # else the key is a list's number or a name that the user gives
            contracts = [inner for field in fields for inner in _contracts_in(field.annotation)]
    return list(dict.fromkeys(key for one in contracts for key in one.model_fields))


def _contracts_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [inner for part in get_args(annotation) for inner in _contracts_in(part)]
