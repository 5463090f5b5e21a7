"""Values in elements of URDF and SDF: numbers in texts, rotations by roll, pitch and yaw."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from ....algebra import Quat, Vec3, X, Y, Z
from ....errors import remedy, similar, with_article
from ...io.document import decimal, shown, usable
from ..mjcf.elements import ALIKE, Element
from ..mjcf.frames import unit_vector


def roll_pitch_yaw(angles: Sequence[float]) -> Quat:
    """Return the rotation about the fixed axes x, y, z, in this order [rad]."""
    roll, pitch, yaw = (
        Quat(math.cos(0.5 * angle), math.sin(0.5 * angle) * axis)
        for angle, axis in zip(angles, (X, Y, Z), strict=True)
    )
    return yaw * pitch * roll


def direction(element: Element, numbers: Sequence[float]) -> Vec3:
    """Return a unit vector along three numbers.

    Raises:
        CaseError: they are zero.
    """
    if math.hypot(*numbers) < 1e-10:  # as in MJCF: shorter axes point anywhere
        raise element.fault("xyz: found zero, expected the direction of an axis; correct it")
    return unit_vector(numbers)


def numbers_of(
    element: Element, counts: Sequence[int], default: Sequence[float] | None = None
) -> tuple[float, ...]:
    """Return the numbers in the text of an element, in one of the allowed counts.

    Raises:
        CaseError: a wrong count, or an unusable number.
    """
    if not element.text and default is not None:
        return tuple(default)
    try:
        found = tuple(map(decimal, element.text.split()))
    except ValueError:
        found = (math.nan,)
    if len(found) not in counts or not all(map(usable, found)):
        expected = f"{' or '.join(map(str, counts))} numbers"
        raise element.fault(f"found {shown(element.text)}, expected {expected}; correct the text")
    return found


def value_of(element: Element, tag: str, count: int) -> tuple[float, ...]:
    """Return the numbers of the child of a tag, in its text or its attribute; zeros without one.

    Raises:
        CaseError: a wrong count, or an unusable number.
    """
    child = only_child(element, tag)
    if child is not None and "value" in child.attributes:
        return child.numbers("value", (count,))
    return numbers_of(child, (count,), (0.0,) * count) if child else (0.0,) * count


def require_children(element: Element, known: Sequence[str], *, closed: bool = False) -> None:
    """Refuse a mistyped element, which would silently be left out.

    Args:
        closed: others are no extensions but unknown, unless they have a prefix.

    Raises:
        CaseError: an element is unknown, or almost one of the known ones.
    """
    for child in element.children:
        if child.tag in known:
            continue
        prefix, colon, name = child.tag.rpartition(":")
        alike = [
            each.removeprefix(prefix + colon)
            for each in known
            if each.startswith(prefix + colon) and (colon or ":" not in each)
        ]
        if (closed and not colon) or similar(name, alike, ALIKE):
            raise child.fault(f"unknown in <{element.tag}>; {remedy(name, alike)}")


def only_child(element: Element, tag: str) -> Element | None:
    """Return the element of a tag; None without one.

    Raises:
        CaseError: there are several.
    """
    found = [*element.only(tag)]
    if len(found) > 1:
        raise found[1].fault("found again, expected one; remove the others")
    return found[0] if found else None


def required(element: Element, name: str, known: Sequence[str] = ()) -> str:
    """Return a required attribute.

    Args:
        known: other attributes of the element.

    Raises:
        CaseError: it is missing or empty, or another one is unknown.
    """
    if known:
        element.require_known((name, *known), "URDF")
    if not (found := element.attributes.get(name)):
        raise element.fault(f"{name}: missing, expected a name; add the attribute")
    return found


def named(element: Element, key: str, name: str, known: Collection[str], what: str) -> str:
    """Return a name, one of the known ones.

    Raises:
        CaseError: it is not.
    """
    if name not in known:
        expected = with_article(what)
        raise element.unknown_name(key, name, known, expected)
    return name
