"""The same mechanism with joints of known types only, by the equivalents that joints declare."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from ..joints import Joint
from .mechanism import Body, Mechanism


def with_equivalents(mechanism: Mechanism, known: Collection[type[Joint]]) -> Mechanism:
    """Return the mechanism with joints of other types replaced by their equivalents.

    Bodies that are added have no mass. Joints without an equivalent stay. A driver or a coupler
    that names a joint needs a joint of this name among the equivalents.

    Args:
        known: exact types of the joints that stay.
    """
    if all(type(joint) in known for joint in mechanism.joints):
        return mechanism
    parts = [part for joint in mechanism.joints for part in _parts(joint, known)]
    added = [part for part in parts if isinstance(part, Body)]
    joints = [part for part in parts if isinstance(part, Joint)]
    if joints == list(mechanism.joints):
        return mechanism
    return replace(mechanism, bodies=[*mechanism.bodies, *added], joints=joints)


def replaced_joints(mechanism: Mechanism, known: Collection[type[Joint]]) -> dict[str, list[str]]:
    """Return the joints that have equivalents in place, by name: the types of those joints."""
    return {
        joint.name: [part.type for part in _parts(joint, known) if isinstance(part, Joint)]
        for joint in mechanism.joints
        if type(joint) not in known and declared_equivalent(joint) is not None
    }


def _parts(
    joint: Joint, known: Collection[type[Joint]], inside: tuple[type[Joint], ...] = ()
) -> Iterator[Body | Joint]:
    """Yield the bodies and joints in place of a joint, or the joint itself."""
    offered = None if type(joint) in (*known, *inside) else declared_equivalent(joint)
    if offered is None:
        yield joint
        return
    bodies, joints = offered
    yield from bodies
    for each in joints:
        yield from _parts(each, known, (*inside, type(joint)))


def declared_equivalent(joint: Joint) -> tuple[list[Body], list[Joint]] | None:
    """Return the equivalent of a joint; None if its type declares none.

    An equivalent is of the primitives beside it: a subclass with other primitives inherits none.
    """
    for cls in type(joint).__mro__:
        if "equivalent" in vars(cls):
            found = joint.equivalent()
            return None if found is None else ([*found[0]], [*found[1]])
        if "primitives" in vars(cls):
            return None
    return None
