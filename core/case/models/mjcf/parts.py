"""A model's tree and equalities as bodies, joints and couplers of a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ....joints import (
    Coupler,
    Distance,
    Fixed,
    Gear,
    Joint,
    RackPinion,
    Revolute,
    Spherical,
    Translational,
)
from ....mechanism.mechanism import GROUND
from .driving import Driving
from .equalities import Connect, Equality, Relation, Rod
from .frames import Place, coordinates
from .tree import ModelJoint, Tree


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


def parts_of(tree: Tree, equalities: Sequence[Equality], driving: Driving) -> Parts:
    """The parts of a model.

    Raises:
        CaseError: an equality for which there is no joint.
    """
    parts = Parts(
        dict(tree.moving), {tree.free[name] for name in driving.fixed if name in tree.free}
    )
    rods = _rods(tree, equalities, driving)
    replaced = {id(connect) for _, connect in rods.values()}
    for name, (rod, connect) in rods.items():
        del parts.bodies[rod.inner]
        ends = rod.outer, connect.j if connect.i == rod.inner else connect.i
        parts.joints[name] = Distance(
            name, *ends, (coordinates(rod.point), coordinates(connect.point))
        )
        parts.left_out.append(
            f"body {rod.inner!r} and its turn about itself: it is a rod of constant length"
        )
    locked = {
        name: each
        for each in equalities
        if isinstance(each, Relation) and len(each.weights) == 1
        for name in each.weights
    }
    for name, joint in tree.joints.items():
        if name not in rods:
            parts.joints[name] = (
                Fixed(name, joint.outer, joint.inner)
                if name in (*locked, *driving.fixed)
                else _joint(joint)
            )
    for each in equalities:
        if isinstance(each, Relation):
            _couple(tree, parts, each)
        elif isinstance(each, Rod):
            name = parts.name(each.name)
            parts.joints[name] = Distance(
                name, each.i, each.j, (coordinates(each.points[0]), coordinates(each.points[1]))
            )
        elif id(each) not in replaced:
            name = parts.name(each.name)
            kind = Fixed if each.weld else Spherical
            parts.joints[name] = kind(name, each.i, each.j, coordinates(each.point))
    return parts


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


def _rods(
    tree: Tree, equalities: Sequence[Equality], driving: Driving
) -> Mapping[str, tuple[ModelJoint, Connect]]:
    """Bodies between a ball joint and one connect, by the joint's name: they can turn about
    themselves, which nothing drives.
    """
    connects: dict[str, list[Connect]] = {}
    for each in equalities:
        if isinstance(each, Connect):
            connects.setdefault(each.i, []).append(each)
            connects.setdefault(each.j, []).append(each)
    outer = {joint.outer for joint in tree.joints.values()}
    found: dict[str, tuple[ModelJoint, Connect]] = {}
    inner: set[str] = set()
    for name, joint in tree.joints.items():
        held = connects.get(joint.inner, [])
        alone = (
            joint.type == "ball" and joint.inner not in outer and joint.outer not in tree.massless
        )
        if not alone or name in driving.fixed or len(held) != 1 or held[0].weld:
            continue
        other = held[0].j if held[0].i == joint.inner else held[0].i
        arm = held[0].point - joint.point
        # a rod to the body it hangs on moves nothing, and two of them end to end are a chain that
        # only bodies can carry
        if other != joint.outer and arm @ arm > 0.0 and other not in inner:
            found[name] = joint, held[0]
            inner.add(joint.inner)
    return found


def _couple(tree: Tree, parts: Parts, relation: Relation) -> None:
    if len(relation.weights) > 2:
        problem = (
            f"couples {len(relation.weights)} joints ({', '.join(relation.weights)}), expected two"
        )
        raise relation.element.fault(
            f"{problem}; kincheck has no joint for more: remove the equality, and --hold or drive"
            " its joints"
        )
    if len(relation.weights) < 2:  # one is locked, none says nothing
        return
    for joint in relation.weights:
        if isinstance(parts.joints[joint], Fixed):
            raise relation.element.fault(
                f"couples {joint!r}, which is locked by another equality; remove this one, and"
                " --hold its other joint"
            )
    (first, a), (second, b) = relation.weights.items()
    # a x + b y = 0, for x and y the changes of the two coordinates
    name, types = parts.name(relation.name), (tree.joints[first].type, tree.joints[second].type)
    if types == ("hinge", "hinge"):
        parts.couplers[name] = Gear(name, (first, second), -b / a)
    elif types == ("hinge", "slide"):
        parts.couplers[name] = RackPinion(name, (first, second), -a / b)
    elif types == ("slide", "hinge"):
        parts.couplers[name] = RackPinion(name, (second, first), -b / a)
    else:
        # two racks on a pinion that turns on the ground, by one radian for a metre of the first
        # slide; it stands at that slide
        pinion, other, at = (
            parts.name(f"{name}.pinion"),
            parts.name(f"{name}.rack"),
            tree.joints[first].point,
        )
        parts.bodies[pinion] = Place(at)
        parts.joints[pinion] = Revolute(pinion, GROUND, pinion, coordinates(at), (0.0, 0.0, 1.0))
        parts.couplers[name] = RackPinion(name, (pinion, first), 1.0)
        parts.couplers[other] = RackPinion(other, (pinion, second), -a / b)
