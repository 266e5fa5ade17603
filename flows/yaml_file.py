"""Reading the YAML files that people write."""

from pathlib import Path
from typing import Any

import yaml

from schemas.problem import BadInput


def read_yaml(path: Path, what: str, remedy: str) -> Any:
    """What stands in it. BadInput where it cannot be read: what: the kind of file, as a person names it;
    remedy: what to do where there is none."""
    try:
        return yaml.load(path.read_text(encoding="utf-8"), Loader=_UniqueKeys)
    except FileNotFoundError:
        raise BadInput(str(path), "no such file", remedy) from None
    except IsADirectoryError:
        raise BadInput(str(path), "is a folder", f"Name the {what} itself") from None
    except OSError as problem:
        raise BadInput(str(path), f"cannot be read ({problem.strerror})", remedy) from None
    except (UnicodeDecodeError, yaml.reader.ReaderError):
        raise BadInput(str(path), "is not plain text in UTF-8", "Save it as UTF-8 in your editor") from None
    except _KeyTwice as twice:
        raise BadInput(str(path), str(twice), "Give each key once") from None
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        where = f" at line {mark.line + 1}" if mark else ""
        raise BadInput(
            str(path), f"is not valid YAML{where}", "Correct the indentation or quotes there"
        ) from None
    except ValueError as problem:  # what looks like a date and is none
        raise BadInput(str(path), f"is not valid YAML ({problem})", "Put that in quotes") from None


class _KeyTwice(Exception):
    """A mapping has two values under one key, of which YAML's own reader would drop one."""


class _UniqueKeys(yaml.SafeLoader):
    def compose_mapping_node(self, anchor: Any) -> Any:
        node = super().compose_mapping_node(anchor)
        seen: set[str] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen:
                    line = key.start_mark.line + 1
                    raise _KeyTwice(f"gives the key {key.value!r} twice, the second time at line {line}")
                seen.add(key.value)
        return node
