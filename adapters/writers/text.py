"""What writers share: lossless numbers, unique names, masses with placeholders, and the parts that
a format cannot hold.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.errors import KincheckError
from ...core.joints import Distance
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import Bushing
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import Array
from ..shared.poses import direction
from ..shared.tree_plan import CHAINS

# Simulators require mass and inertia of every moving body [kg, kg m^2].
STAND_IN = 1e-6
PLAIN = "Masses and inertias are placeholders."
LOADED = (
    f"Masses are in kg; {STAND_IN:g} kg and {STAND_IN:g} kg m^2 are placeholders for missing ones."
)


def require_known(mechanism: Mechanism, title: str) -> None:
    """Refuse joints without a counterpart.

    Raises:
        KincheckError: a joint is neither a chain of links nor a distance.
    """
    for joint in mechanism.joints:
        if type(joint) not in CHAINS and type(joint) is not Distance:
            raise KincheckError(
                f"{joint} has no counterpart in {title} here; write an equivalent of known joints"
                " instead"
            )


def facts(mechanism: Mechanism, sprung: Collection[str], gravity: bool) -> tuple[str, str]:
    """Return sentences on the masses of a file, and on the loads that it cannot hold.

    Args:
        sprung: names of the force elements in the file.
        gravity: whether the file has gravity.
    """
    if not mechanism.has_loads:
        return PLAIN, ""
    return LOADED, left_out(mechanism, sprung, gravity)


def own_law(mechanism: Mechanism, sprung: Collection[str], title: str) -> str:
    """Return a sentence on the bushings in a file whose law is the format's own."""
    names = [str(f) for f in mechanism.forces if isinstance(f, Bushing) and f.name in sprung]
    if not names:
        return ""
    law = f"By {title}'s own law, equal to first order in displacement and angle"
    return f" {law}: {', '.join(names)}."


def plain_bushing(each: Bushing) -> bool:
    """Return whether a bushing has neither curve nor preload, which formats lack."""
    return not each.curve and not any(each.preload)


def add_text(
    parent: ET.Element, tag: str, text: str, options: Mapping[str, str] | None = None
) -> None:
    """Add an element that holds a text."""
    ET.SubElement(parent, tag, dict(options or {})).text = text


def numbers(values: Iterable[Any]) -> str:
    """Return the shortest text of the same doubles, with up to 17 digits."""
    # minus zero looks like a mistake
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in values)


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


def mass_of(body: Body) -> float:
    """Return the mass of a body, or its placeholder [kg]."""
    return body.mass or STAND_IN


def center_of(body: Body) -> Vector:
    """Return the centre of mass, global at design [m]."""
    return body.center_of_mass or body.origin


def inertia_of(body: Body, missing: float = STAND_IN) -> Array:
    """Return the inertia about the centre of mass, global axes at design [kg m^2], shape (3, 3).

    Args:
        missing: principal moments of a body without one.
    """
    return missing * np.eye(3) if body.inertia is None else inertia_matrix(body.inertia)


def own_inertia(body: Body) -> Array:
    """Return the inertia about the centre of mass in the body's axes [kg m^2], shape (3, 3)."""
    turn = np.column_stack([direction(body, axis) for axis in np.eye(3).tolist()])
    return turn @ inertia_of(body) @ turn.T


def six(matrix: Array) -> list[float]:
    """Return the entries xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [float(0.5 * (matrix[pair] + matrix[pair[::-1]])) for pair in pairs]


def inertia_at_origin(body: Body) -> Array:
    """Return the inertia about the body's origin, global axes at design [kg m^2], shape (3, 3)."""
    arm = np.subtract(center_of(body), body.origin)
    moved = arm @ arm * np.eye(3) - np.outer(arm, arm)
    return inertia_of(body) + mass_of(body) * moved


def left_out(mechanism: Mechanism, names: Collection[str], gravity: bool) -> str:
    """Return a sentence on the loads that a format cannot hold.

    Args:
        names: force elements in the file.
        gravity: whether the file has gravity.
    """
    missing = [str(each) for each in mechanism.forces if each.name not in names]
    missing += [f"{each}, a joint in its place" for each in mechanism.bushings]
    if any(mechanism.gravity) and not gravity:
        missing.insert(0, f"gravity {[*mechanism.gravity]} m/s^2")
    return f" Left out: {', '.join(missing)}." if missing else ""
