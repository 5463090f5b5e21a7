"""Springs and dampers of a model's joints and tendons, as force elements.

A force element is linear. Others are listed as left out: polynomials, dead bands, springs of balls,
and those that MuJoCo's compiler tunes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from ....errors import CaseError, MechanismError
from ....joints import Revolute, Translational
from ....mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ....mechanism.mechanism import GROUND
from ...io.document import usable
from .classes import MAIN
from .driving import Driving
from .elements import Element, unlike
from .equalities import MOST_EQUALITIES
from .frames import coordinates
from .parts import Parts
from .tree import ModelJoint, Tree

# The spring of a slide acts on a point of its line so far behind it, in sizes of the model, that
# the slide never gets there: the distance less this is the displacement.
BEHIND = 100.0


def springs_of(
    root: Element, zero: Tree, tree: Tree, parts: Parts, driving: Driving, size: float
) -> list[ForceElement]:
    """Return the springs and dampers of a model; the tree counts those that are left out.

    Args:
        zero: the tree in the pose qpos0, where tendons have their rest length.
        tree: the tree in the start.
        size: of the model [m].
    """
    flags = [flag.attributes for option in root.only("option") for flag in option.only("flag")]
    acting = {
        what: not any({flag.get(switch), flag.get("passive")} & {"disable"} for flag in flags)
        for what, switch in (("stiffness", "spring"), ("damping", "damper"))
    }
    found: dict[str, ForceElement] = {}
    again = Counter[str]()
    for joint in tree.chain:
        try:
            law = _law(joint.element, acting)
            if any(law.values()) and (element := _of_joint(tree, parts, driving, joint, law, size)):
                found[joint.name] = element
        except (CaseError, MechanismError):
            for key, what in (("stiffness", "springs"), ("damping", "damping")):
                if {key, "springdamper"} & joint.element.attributes.keys():
                    tree.count(f"{what} of joints")
    for section in root.only("tendon"):
        for tendon in section.children:
            if len(found) > MOST_EQUALITIES:
                raise tendon.fault(
                    f"found more than the {MOST_EQUALITIES} springs that are read, expected fewer;"
                    " take out those that are not looked at"
                )
            name = unlike(tendon.attributes.get("name", "tendon"), found, again=again)
            try:
                found[name] = _of_tendon(name, zero, tree, parts, tendon, acting)
            except (CaseError, MechanismError):
                tree.count(f"{section.tag}: {tendon.tag}")
    return [*found.values()]


def _law(element: Element, acting: Mapping[str, bool]) -> dict[str, Any]:
    """Return stiffness and damping."""
    first, second = element.numbers("springdamper", (2,), (0.0, 0.0))
    if first > 0.0 and second > 0.0:
        raise element.fault("springdamper: is tuned by MuJoCo, expected stiffness and damping")
    law = {"stiffness": 0.0, "damping": 0.0}
    for key in law:
        linear, *more = element.numbers(key, (1, 2, 3), (0.0,))
        if acting[key]:
            if any(more) or linear < 0.0:
                raise element.fault(f"{key}: is no linear law, expected one positive number")
            law[key] = linear
    return law


def _of_joint(
    tree: Tree,
    parts: Parts,
    driving: Driving,
    joint: ModelJoint,
    law: Mapping[str, Any],
    size: float,
) -> ForceElement | None:
    """Return the force element of a joint; None of a locked one, whose spring does nothing."""
    (rest,) = joint.element.numbers("springref", (1,), (0.0,))
    match parts.joints.get(joint.name):
        case Revolute():
            rest = tree.compiler.angle(rest)
            return TorsionSpringDamper(joint.name, joint.name, **law, free_angle=rest - joint.value)
        case Translational():
            change = rest - joint.value
            travel = np.abs(np.subtract(driving.driven.get(joint.name, 0.0), joint.value)).max()
            behind = BEHIND * max(size, abs(change), float(travel))
            if not usable(behind):
                raise joint.element.fault("springref: is beyond all numbers, expected a length")
            points = coordinates(joint.point - behind * joint.axis), coordinates(joint.point)
            return SpringDamper(
                *(joint.name, joint.outer, joint.inner, points),
                **law,
                free_length=behind + change,
            )
        case _:
            if joint.type in ("ball", "free"):
                raise joint.element.fault("has a spring of three turns, expected one of an axis")
            return None


def _of_tendon(
    name: str, zero: Tree, tree: Tree, parts: Parts, tendon: Element, acting: Mapping[str, bool]
) -> SpringDamper:
    """Return the spring of a tendon.

    Raises:
        CaseError: it has none, or goes elsewhere than between two bodies of the mechanism.
    """
    tendon = tree.classes.complete(tendon, "tendon", MAIN)
    law = _law(tendon, acting)
    sites = [str(child.attributes.get("site")) for child in tendon.children]
    if tendon.tag != "spatial" or len(sites) != 2 or not {*sites} <= tree.sites.keys():
        raise tendon.fault("goes elsewhere than between two sites")
    (i, here), (j, there) = (tree.sites[site] for site in sites)
    ends = coordinates(here.at), coordinates(there.at)
    if i == j or not {i, j} <= {GROUND, *parts.bodies} or not any(law.values()):
        raise tendon.fault("is no spring between two bodies")
    shortest, longest = (2 * tendon.numbers("springlength", (1, 2), (-1.0,)))[:2]
    if shortest != longest:
        raise tendon.fault("springlength: is a dead band, expected one length")
    if shortest < 0.0:
        rest_pose = {"ref", "springref"}
        if law["stiffness"] and any(
            rest_pose & each.element.attributes.keys() for each in tree.chain
        ):
            raise tendon.fault("has the length of a rest pose of its own")
        shortest = math.dist(*(coordinates(zero.sites[site][1].at) for site in sites))
    return SpringDamper(name, i, j, ends, **law, free_length=shortest)
