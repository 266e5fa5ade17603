"""A page of the dashboard, before Prefect knows of it."""

import hashlib
import re
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Page:
    """One artifact. `key`: lowercase letters, digits and dashes. Either markdown (pictures as data URIs:
    PNG or JPEG, no SVG) or a table (list of rows with the same keys) or a link."""

    key: str
    description: str = ""
    markdown: str | None = None
    table: list[dict[str, Any]] = field(default_factory=list)
    link: str | None = None


def page_key(stage: str, item: str) -> str:
    """A key from an item's name: what Prefect does not take in a key becomes a dash. A name in another
    alphabet, of which little would be left, carries eight hex digits of itself."""
    key = re.sub(r"[^a-z0-9]+", "-", f"{stage}-{item}".lower()).strip("-")
    if item.isascii():
        return key
    return f"{key}-{hashlib.sha256(item.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"
