"""Default classes of MJCF: attributes of elements beyond their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from ...io.document import shown
from .attributes import ORIENTATION
from .elements import Element

MAIN = "main"
READ = ("joint", "site", "equality", "geom", "tendon")
"""Kinds of elements whose defaults matter."""


@dataclass(frozen=True)
class Classes:
    """Attributes by class name and kind of element."""

    attributes: Mapping[str, Mapping[str, Mapping[str, str]]] = field(
        default_factory=lambda: {MAIN: {}}
    )

    def complete(self, element: Element, kind: str, childclass: str) -> Element:
        """The element with the attributes of its class, or of the class of the body around it,
        added if it has none.
        """
        name = element.attributes.get("class", childclass)
        if name not in self.attributes:
            raise element.unknown_name("class", name, self.attributes, "a default class")
        return replace(
            element, attributes=_over(self.attributes[name].get(kind, {}), element.attributes)
        )


def _over(inherited: Mapping[str, str], own: Mapping[str, str]) -> dict[str, str]:
    """Attributes, the own ones first; an orientation takes the place of another, however either is
    written.
    """
    turned = any(key in own for key in ORIENTATION)
    return {
        **{key: value for key, value in inherited.items() if not (turned and key in ORIENTATION)},
        **own,
    }


def read_classes(root: Element) -> Classes:
    """The classes of a model.

    Raises:
        CaseError: one without a name inside another, or one given twice.
    """
    found: dict[str, dict[str, dict[str, str]]] = {MAIN: {}}

    def read(element: Element, name: str, inherited: Mapping[str, Mapping[str, str]]) -> None:
        own = {kind: dict(values) for kind, values in inherited.items()}
        for child in element.children:
            if child.tag in READ:
                own[child.tag] = _over(own.get(child.tag, {}), child.attributes)
        found[name] = own
        for child in element.only("default"):
            below = child.attributes.get("class", "")
            if not below or below in found:
                problem = "missing" if not below else f"found {shown(below)} again"
                raise child.fault(f"class: {problem}, expected a name of its own; name the class")
            read(child, below, own)

    for top in root.only("default"):
        top.choice("class", (MAIN,), MAIN)
        read(top, MAIN, found[MAIN])
    return Classes(found)
