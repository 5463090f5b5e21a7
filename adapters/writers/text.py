"""What writers share: lossless numbers, unique names, masses with placeholders, and the parts that
a format cannot hold.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np

from ...core.errors import KincheckError
from ...core.extensions.exports.model_writer import Ranges, Zeros
from ...core.extensions.trees.robot_elements import BUSHING_LAW, STRUT, STRUT_LAW
from ...core.extensions.trees.tree import BETWEEN, STAND_IN
from ...core.joints import Distance
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import Bushing, ForceElement, Law, SpringDamper
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.trajectory import Array
from ..shared.tree_plan import CHAINS
from .poses import direction

# Simulators require mass and inertia of every moving body. A point mass has an inertia far below
# that about joints some centimetres away, per mass [m^2].
POINT = 1e-10
DRAKE = "http://drake.mit.edu"
PLAIN = "Masses and inertias are placeholders."


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


SMALL = (BETWEEN[1], BETWEEN[1], BETWEEN[1], 0.0, 0.0, 0.0)


def link_between(name: str, point: Vector, mechanism: Mechanism) -> Body:
    """Return the frame of a link between the freedoms of a joint."""
    if not mechanism.has_loads:
        return Body(name, point)
    return Body(name, point, mass=BETWEEN[0], center_of_mass=point, inertia=SMALL)


def weighs_all(frames: Iterable[Body]) -> bool:
    """Return whether every moving link has a mass."""
    return all(body.mass or body.fixed or body.name == GROUND for body in frames)


def facts(
    mechanism: Mechanism,
    sprung: Collection[str],
    frames: Iterable[Body],
    title: str,
    *,
    gravity: bool = True,
    law: Law | None = None,
) -> tuple[str, str]:
    """Return sentences on the masses of a file, and on the loads that it cannot hold or holds by
    another law.

    Args:
        sprung: names of the force elements in the file.
        frames: of the links in the file, with their masses.
        title: of the simulator whose law of bushings the file has.
        gravity: whether the file has gravity.
        law: of bushings that is the simulator's.
    """
    if not mechanism.has_loads:
        return PLAIN, ""
    lacks = left_out(mechanism, sprung, gravity)
    bushings = [each for each in mechanism.forces if isinstance(each, Bushing)]
    if names := [str(f) for f in bushings if f.name in sprung and f.law is not law]:
        how = f"By {title}'s own law, equal to first order in displacement and angle"
        lacks += f" {how}: {', '.join(names)}."
    return weights(frames), lacks


def weights(frames: Iterable[Body]) -> str:
    """Return a sentence on the masses of links."""
    found = [*frames]
    masses = "Masses are in kg"
    if not weighs_all(found):
        mass, moment = STAND_IN
        masses += f"; {mass:g} kg and {moment:g} kg m^2 are placeholders for missing ones"
    if any((body.mass, body.inertia) == (BETWEEN[0], SMALL) for body in found):
        masses += f"; other links have {BETWEEN[0]:g} kg"
    return f"{masses}."


def add_note(root: ET.Element, text: str) -> None:
    """Begin a document with a comment, in which XML has no two hyphens in line."""
    root.insert(0, ET.Comment(text.replace("--", "- -")))


def plain_bushing(each: ForceElement) -> TypeGuard[Bushing]:
    """Return whether an element is a bushing without curve and preload, which formats lack."""
    return isinstance(each, Bushing) and not each.curve and not any(each.preload)


def without_curves(mechanism: Mechanism) -> list[ForceElement]:
    """Return the force elements without curves, which formats lack."""
    return [each for each in mechanism.forces if not getattr(each, "curve", None)]


def strut(force: SpringDamper, local: Callable[[str, Vector], Iterable[float]]) -> dict[str, str]:
    """Return the texts of Drake's spring between two points, by tag.

    Args:
        local: returns a point in the axes of a link.
    """
    found = dict[str, str]()
    for side, end, link, P in zip("AB", "PQ", force.bodies, force.points, strict=True):
        found[f"{STRUT}_body_{side}"] = link
        found[f"{STRUT}_p_{side}{end}"] = numbers(local(link, P))
    return found | {f"{STRUT}_{key}": numbers(getattr(force, key)) for key in STRUT_LAW}


def bushing_law(each: Bushing) -> dict[str, tuple[float, ...]]:
    """Return the numbers of Drake's bushing by its keys."""
    return {
        key: getattr(each, key.replace("torque_", "turning_").removeprefix("force_"))
        for key in BUSHING_LAW
    }


def add_text(
    parent: ET.Element, tag: str, content: Any, options: Mapping[str, str] | None = None
) -> None:
    """Add an element that holds a text, or numbers."""
    text = content if isinstance(content, str) else numbers(content)
    ET.SubElement(parent, tag, dict(options or {})).text = text


def numbers(values: Iterable[Any] | float) -> str:
    """Return the shortest text of the same doubles, with up to 17 digits."""
    # minus zero looks like a mistake
    every = values if isinstance(values, Iterable) else [values]
    return " ".join(repr(float(value) + 0.0).removesuffix(".0") for value in every)


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
    return body.mass or STAND_IN[0]


def inertia_of(body: Body) -> Array:
    """Return the inertia about the centre of mass, or its placeholder, global axes at design
    [kg m^2], shape (3, 3).
    """
    if body.inertia is None:
        return (POINT * body.mass or STAND_IN[1]) * np.eye(3)
    return inertia_matrix(body.inertia)


def own_inertia(body: Body) -> Array:
    """Return the inertia about the centre of mass in the body's axes [kg m^2], shape (3, 3)."""
    if body.inertia is None:  # the same in all axes, without round-off
        return inertia_of(body)
    turn = np.column_stack([direction(body, axis) for axis in np.eye(3).tolist()])
    return turn @ inertia_of(body) @ turn.T


def six(matrix: Array) -> list[float]:
    """Return the entries xx, yy, zz, xy, xz, yz of a symmetric matrix."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [float(0.5 * (matrix[pair] + matrix[pair[::-1]])) for pair in pairs]


def inertia_at_origin(body: Body) -> Array:
    """Return the inertia about the body's origin, global axes at design [kg m^2], shape (3, 3)."""
    arm = np.subtract(body.center, body.origin)
    moved = arm @ arm * np.eye(3) - np.outer(arm, arm)
    return inertia_of(body) + mass_of(body) * moved


def zeros_of(zeros: Zeros) -> str:
    """Return a sentence on coordinates of the case with another zero than the file's, to a
    picometre.
    """
    told = ", ".join(
        f"{joint} {freedom} {value:.12g}"
        for (joint, freedom), value in zeros.items()
        if round(value, 12)
    )
    return f" Where coordinates are zero, those of the case are {told}." if told else ""


def lost_limits(ranges: Ranges, kept: Collection[tuple[str, str]] = ()) -> str:
    """Return a sentence on limits of coordinates, by joint and freedom, that a file lacks."""
    lost = ", ".join(joint for joint, freedom in ranges if (joint, freedom) not in kept)
    return f" Left out: limits of {lost}." if lost else ""


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
