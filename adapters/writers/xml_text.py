"""XML text for writers: lossless numbers, unique names."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from typing import Any

from ...core.errors import KincheckError
from ..shared.joint_chains import Link


def numbers(values: Iterable[Any]) -> str:
    """Return the shortest text of the same doubles, with up to 17 digits."""
    # minus zero looks like a mistake
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)


def link_names(joint: str, links: Sequence[Link]) -> list[str]:
    """Return the names of a joint's coordinates: the joint's name if it has only one, else
    JOINT.rotation, JOINT.slide2, ...
    """
    if len(links) == 1:
        return [joint]
    return [f"{joint}.{link.name or f'{link.move}{k}'}" for k, link in enumerate(links, 1)]


def document(root: ET.Element, kinds: Sequence[Sequence[str]], reserved: Sequence[str] = ()) -> str:
    """Return the text of a document.

    Args:
        kinds: groups of element tags; names must be unique in each group.
        reserved: names reserved by the format.

    Raises:
        KincheckError: a name is used twice or reserved, which a reader would refuse or confuse.
    """
    for tags in kinds:
        names = [
            name
            for element in root.iter()
            if element.tag in tags and (name := element.get("name")) is not None
        ]
        taken = {name for name in names if names.count(name) > 1} | set(reserved).intersection(
            names
        )
        if taken:
            raise KincheckError(
                f"<{root.tag}>: the name {min(taken)!r} is taken in the file; rename what has it in"
                " the case"
            )
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
