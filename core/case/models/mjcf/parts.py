"""A model's tree and equalities as bodies, joints and couplers of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ....joints import (
    Coupler,
    Distance,
    Fixed,
    Gear,
    Joint,
    Polynomial,
    RackPinion,
    Revolute,
    Spherical,
    Translational,
)
from .driving import Driving
from .equalities import Connect, Equality, Relation, Rod
from .frames import Place, coordinates
from .rods import Spin
from .tree import ModelJoint, Tree

FREEDOMS = {"hinge": "rotation", "slide": "translation"}


@dataclass
class Parts:
    """Parts of a mechanism.

    Attributes:
        bodies: moving and held bodies, with their places.
        fixed: names of the held ones.
        left_out: omitted bodies and freedoms, in words.
    """

    bodies: dict[str, Place]
    fixed: set[str] = field(default_factory=set[str])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    couplers: dict[str, Coupler] = field(default_factory=dict[str, Coupler])
    left_out: list[str] = field(default_factory=list[str])

    def name(self, wanted: str) -> str:
        """Return an unused name: equalities, joints and bodies of a model may share names."""
        while wanted in self.joints or wanted in self.couplers or wanted in self.bodies:
            wanted += "'"
        return wanted


def parts_of(
    tree: Tree, equalities: Sequence[Equality], driving: Driving, spins: Mapping[str, Spin]
) -> Parts:
    """The parts of a model.

    Raises:
        CaseError: an equality for which there is no joint.
    """
    fixed = {tree.free.get(name, name) for name in driving.fixed}
    parts = Parts(dict(tree.moving), {name for name in fixed if name in tree.moving})
    replaced = {id(end.by) for spin in spins.values() if spin.is_rod for end in spin.ends}
    for name, spin in spins.items():
        if not spin.is_rod:
            continue
        body = spin.joint.inner
        del parts.bodies[body]
        parts.joints[name] = spin.as_distance()
        parts.left_out.append(
            f"body {body!r} and its turn about itself: it is a rod of constant length"
        )
    locked = _locked(equalities)
    for name, joint in tree.joints.items():
        if id(joint) not in replaced:
            parts.joints[name] = (
                Fixed(name, joint.outer, joint.inner)
                if name in locked or name in driving.fixed
                else _joint(joint)
            )
    for each in equalities:
        if isinstance(each, Relation):
            _couple(tree, parts, each)
        elif isinstance(each, Rod):
            name = parts.name(each.name)
            points = coordinates(each.points[0]), coordinates(each.points[1])
            parts.joints[name] = Distance(name, each.i, each.j, points)
        elif id(each) not in replaced:
            name = parts.name(each.name)
            parts.joints[name] = _closure(each, name)
    for spin in spins.values():
        if not spin.is_rod:
            name = parts.name(f"{spin.joint.inner}: no spin")
            parts.joints[name] = spin.lock(name)
            parts.left_out.append(
                f"turn of body {spin.joint.inner!r} about itself: it is a rod between balls"
            )
    return parts


def _closure(connect: Connect, name: str) -> Joint:
    """Return the joint of a connect or weld; a remaining gap is divided."""
    p, q = connect.points
    kind = Spherical if connect.turns is None else Fixed
    return kind(name, connect.i, connect.j, coordinates(0.5 * (p + q) if p != q else p))


def _locked(equalities: Sequence[Equality]) -> set[str]:
    """Return the joints locked by relations, alone or by other locked ones."""
    relations = [each for each in equalities if isinstance(each, Relation)]
    found: set[str] = set()
    while new := {
        name for each in relations for name in each.joints - found if len(each.joints - found) == 1
    }:
        found |= new
    return found


def _joint(joint: ModelJoint) -> Joint:
    ends, point, axis = (
        (joint.name, joint.outer, joint.inner),
        coordinates(joint.point),
        coordinates(joint.axis),
    )
    match joint.type:
        case "hinge":
            return Revolute(*ends, point, axis)
        case "slide":
            return Translational(*ends, point, axis)
        case _:
            return Spherical(*ends, point)


def require_coupled(equalities: Sequence[Equality]) -> None:
    """Refuse relations for which there is no coupler.

    Raises:
        CaseError: one ties more than two joints, or is a curve between sums of joints.
    """
    for each in equalities:
        if not isinstance(each, Relation):
            continue
        if len(each.joints) > 2:
            raise each.element.fault(
                f"couples {len(each.joints)} joints ({', '.join(sorted(each.joints))}), expected"
                " two; kincheck has no joint for more: remove the equality, and --hold or drive its"
                " joints"
            )
        if not each.linear and not len(each.driven) == len(each.driving) == len(each.joints) - 1:
            raise each.element.fault(
                "polycoef: is a curve between sums of joints, expected one joint on either side;"
                " there is no joint for others"
            )


def _couple(tree: Tree, parts: Parts, relation: Relation) -> None:
    joints = relation.joints
    # one is locked, none says nothing
    if len(joints) < 2 or all(isinstance(parts.joints[each], Fixed) for each in joints):
        return
    name = parts.name(relation.name)
    if not relation.linear:
        parts.couplers[name] = _polynomial(tree, relation, name)
        return
    (first, a), (second, b) = relation.weights.items()
    # a x + b y = 0, for x and y the changes of the two coordinates
    types = tree.joints[first].type, tree.joints[second].type
    if types == ("hinge", "hinge"):
        parts.couplers[name] = Gear(name, (first, second), -b / a)
    elif types == ("hinge", "slide"):
        parts.couplers[name] = RackPinion(name, (first, second), -a / b)
    elif types == ("slide", "hinge"):
        parts.couplers[name] = RackPinion(name, (second, first), -b / a)
    else:
        freedoms = "translation", "translation"
        parts.couplers[name] = Polynomial(name, (first, second), (0.0, -b / a), freedoms=freedoms)


def _polynomial(tree: Tree, relation: Relation, name: str) -> Polynomial:
    """Return a curve between two joints, by their changes since the pose of the tree."""
    ((driven, a),), ((driving, b),) = relation.driven.items(), relation.driving.items()
    curve = np.polynomial.Polynomial(relation.coefficients)
    # a (x0 + x) = p(b (y0 + y)), which holds at x = y = 0
    argument = np.polynomial.Polynomial([b * tree.joints[driving].moved, b])
    shifted = (curve(argument) / a).coef.tolist()
    first, second = (FREEDOMS[tree.joints[joint].type] for joint in (driven, driving))
    return Polynomial(name, (driven, driving), (0.0, *shifted[1:]), freedoms=(first, second))
