"""Drawings inside a page. Built as a tree, so that no name can break out of its place."""

import re
from collections.abc import Iterable, Mapping
from typing import Any
from xml.etree import ElementTree

from markupsafe import Markup

CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")  # not allowed in XML


def drawing(width: float, height: float, label: str, **attributes: Any) -> ElementTree.Element:
    """An empty drawing in its own units; as wide as its place allows."""
    return ElementTree.Element(
        "svg",
        {
            "viewBox": f"0 0 {number(width)} {number(height)}",
            "role": "img",
            "aria-label": CONTROL.sub("", label),
            **_named(attributes),
        },
    )


def add(parent: ElementTree.Element, tag: str, /, **attributes: Any) -> ElementTree.Element:
    """Append an element; `_` in attribute names stands for `-`, a trailing one is dropped (class_)."""
    return ElementTree.SubElement(parent, tag, _named(attributes))


def write(parent: ElementTree.Element, words: str, /, **attributes: Any) -> None:
    """Append a text."""
    add(parent, "text", **attributes).text = CONTROL.sub("", words)


def text_of(element: ElementTree.Element) -> Markup:
    return Markup(ElementTree.tostring(element, encoding="unicode"))  # escaped by ElementTree


def number(value: float) -> str:
    """Two decimals are finer than any screen or printer."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def minus(figure: str) -> str:
    """With a true minus sign instead of a hyphen."""
    return figure.replace("-", "−")


def points(xy: Iterable[Iterable[float]]) -> str:
    """The `points` attribute of (N, 2) positions."""
    return " ".join(f"{number(float(x))},{number(float(y))}" for x, y in xy)


def _named(attributes: Mapping[str, Any]) -> dict[str, str]:
    return {
        name.rstrip("_").replace("_", "-"): CONTROL.sub("", value)
        if isinstance(value, str)
        else number(value)
        for name, value in attributes.items()
    }
