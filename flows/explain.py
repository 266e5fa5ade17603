"""What is wrong in a file that a person wrote, in words: every mistake, the key nearest to an unknown one."""

from collections.abc import Sequence
from datetime import date
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from schemas.inspection import Inspection
from schemas.problem import BadInput

WANTED = {  # by pydantic's name of the error
    "tuple_type": "a list",
    "model_type": "keys with values",
    "dict_type": "keys with values",
    "string_type": "text in quotes",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "invalid_key": "text in quotes",
}
FORMS = {  # of texts, by their key
    "name": "letters, digits, dots, dashes and underscores, a letter or digit first",
    "utm_zone": "a zone such as 32N",
}


def explain(item: str, problem: ValidationError, contract: type[BaseModel]) -> BadInput:
    """All that keeps a file's content from being what it is read as, as one error."""
    what: dict[str, None] = {}  # in order, each once
    remedies = ["Correct that"]
    errors = problem.errors()
    for error in errors:
        key = _path(error["loc"])
        if error["type"] == "extra_forbidden":
            *above, own = error["loc"]
            known = _keys_at(contract, above)
            near = get_close_matches(str(own), known, 1)
            what[f"unknown key {key!r}" + (f" (is it {near[0]!r}?)" if near else "")] = None
            if not near:
                remedies.append(f"The keys of {_path(above)} are {', '.join(known)}")
        elif error["type"] == "json_invalid":
            what[f"is not valid JSON ({error['msg'].removeprefix('Invalid JSON: ')})"] = None
        elif error["type"] == "missing":
            what[f"key {key!r} is missing"] = None
        else:
            wanted = [_wanted(other) for other in errors if _path(other["loc"]) == key]  # of a union each way
            said = " or ".join(dict.fromkeys(wanted))
            what[f"key {key!r} cannot be {_shown(error['input'])} ({said})"] = None
    if contract is Inspection:
        remedies.append("The comments in the file that `hairline init` writes explain the keys")
    return BadInput(item, "; ".join(what), ". ".join(dict.fromkeys(remedies)))


def _wanted(error: ErrorDetails) -> str:
    wanted = WANTED.get(error["type"])
    if error["type"] == "string_pattern_mismatch":
        wanted = FORMS.get(str(error["loc"][-1]))
    return f"give {wanted}" if wanted else error["msg"].removeprefix("Value error, ")


def _shown(value: Any) -> str:
    """As it stands in the file, nearly."""
    return str(value) if isinstance(value, date) else repr(value)


def _path(keys: Sequence[int | str]) -> str:
    """A key as a person finds it, without the ways to read it among which pydantic chose: tuple[str, ...]."""
    named = [str(key) for key in keys if not (key == "str" or str(key).startswith("tuple["))]
    return ".".join(named) or "the file"


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
