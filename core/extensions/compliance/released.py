"""Mechanisms with bushings in place of their joints, and rods with rubber at their ends as bodies
without mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...algebra import vec
from ...errors import MechanismError
from ...joints import Distance, Joint, PerpendicularAxes, Spherical
from ...joints.base import triad
from ...mechanism.body import Body
from ...mechanism.loads import Bushing, TorsionSpringDamper
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import JointDriver
from ...mechanism.rods import end_of

# An axis of a bushing is across the rod if less than this part of it is along: round-off.
ACROSS = 1e-12


def released(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with the bushings of joints as force elements in their place.

    A rod with bushings, a distance joint, is a body without mass.

    Raises:
        MechanismError: a coupler or a torsional spring needs such a joint.
    """
    soft = {bushing.joint for bushing in mechanism.bushings}
    needed = {joint: str(each) for each in mechanism.couplers for joint in each.joints}
    needed |= {
        each.joint: str(each) for each in mechanism.forces if isinstance(each, TorsionSpringDamper)
    }
    for name in soft & set(needed):
        raise MechanismError(
            f"{needed[name]} needs joint {name!r}, which gives way to its bushings. Put it on"
            " another joint, or remove the bushings",
            f"joints.{name}.bushings",
        )
    joints = [
        each
        for each in (*mechanism.joints, *mechanism.grounded)
        if mechanism.given_name(each.name) not in soft
    ]
    bodies, bushings = [*mechanism.bodies], list[Bushing]()
    for name in dict.fromkeys(each.joint for each in mechanism.bushings):
        own = [each for each in mechanism.bushings if each.joint == name]
        if isinstance(rod := mechanism.joint(name), Distance):
            body, others, own = rod_in_rubber(rod, own)
            bodies.append(body)
            joints += others
        bushings += (replace(each, joint="") for each in own)
    return replace(
        mechanism,
        bodies=bodies,
        joints=joints,
        grounded=(),
        drivers=[
            each
            for each in mechanism.drivers
            if not isinstance(each, JointDriver) or each.joint not in soft
        ],
        reduced=[each for each in mechanism.reduced if each.joint.name not in soft],
        forces=(*mechanism.forces, *bushings),
        bushings=(),
    )


def rod_in_rubber(
    rod: Distance, bushings: Sequence[Bushing]
) -> tuple[Body, list[Joint], list[Bushing]]:
    """Return a rod as a body without mass, its joints and its bushings.

    An end without a bushing is a ball joint. If no bushing resists turns about the rod, a row keeps
    it from turning, which carries no torque. Bushings along all axes alike that resist no turn are
    then exactly a spring between the ends, as stiff as both in series.

    Raises:
        MechanismError: a bushing does not fit the rod.
    """
    body = Body(f"rod {rod.name}", rod.points[0])
    ends = [end_of(rod, each) for each in bushings]
    soft = list[Bushing]()
    for k, each in zip(ends, bushings, strict=True):
        far = (rod.j, rod.i)[k]
        i, j = (body.name if name == far else name for name in each.bodies)
        soft.append(replace(each, i=i, j=j))
    neighbors = (rod.i, body.name), (body.name, rod.j)
    joints: list[Joint] = [
        Spherical(f"{rod.name} ball", *neighbors[k], rod.points[k]) for k in (0, 1) if k not in ends
    ]
    along = vec(rod.points[1]) - vec(rod.points[0])
    least = ACROSS * rod.design_distance
    if not any(
        k > 0.0 and abs(vec(axis) @ along) > least
        for each in soft
        for k, axis in zip(each.turning_stiffness, each.triad, strict=True)
    ):
        first, second, _ = triad([*along])
        axes = (first.x, first.y, first.z), (second.x, second.y, second.z)
        joints.append(PerpendicularAxes(f"{rod.name} spin", rod.i, body.name, axes))
    return body, joints, soft
