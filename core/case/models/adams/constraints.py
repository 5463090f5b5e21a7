"""Joints and couplers of a dataset: constraints of two markers, and relations of two joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ....joints import (
    ConstantVelocity,
    Coupler,
    Cylindrical,
    Distance,
    Fixed,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    Planar,
    Revolute,
    Screw,
    Spherical,
    Translational,
    Universal,
    linear_relation,
)
from ....joints.base import AxialJoint
from ...io.document import explained
from .assembly import ROWS, Link
from .dataset import Statement
from .forces import linear
from .model import Coordinate, Model
from .parts import coordinates

_AXIAL = {
    "REVOLUTE": Revolute,
    "TRANSLATIONAL": Translational,
    "CYLINDRICAL": Cylindrical,
    "PLANAR": Planar,
    "INLINE": Inline,
    "INPLANE": InPlane,
}
_TYPES = tuple(name for name in ROWS if name != "DISTANCE")
# What a rack may be off half the pitch diameter of its pinion, relative to it.
_OFF_PITCH = 0.1
# A turn or displacement below this is rounding.
_ROUNDED = 1e-9


def read_links(model: Model) -> list[Link]:
    """Read the constraints of two markers: JOINT, JPRIM and GCON.

    Raises:
        CaseError: a marker is missing, or the type or function is not read.
    """
    found: list[Link] = []
    for each in (*model.dataset.of("JOINT"), *model.dataset.of("JPRIM")):
        kind = each.choice(*_TYPES, "RACKPIN")
        if not kind:
            raise each.fault(f"found no type, expected one of {', '.join(_TYPES)}; state it")
        ends = model.ends(each)
        if kind == "HOOKE":
            model.require_x(each, *ends)
        if kind != "RACKPIN":
            found.append(Link(each, kind, *ends))
    for each in model.dataset.of("GCON"):
        constant, slope, _, ids = linear(each, "DM", "VR", "DM(I, J) - length")
        length = -constant / slope if slope else 0.0
        if not length > 0.0:
            raise each.fault(f"FUNCTION: found the length {length:g}, expected more; correct it")
        i, j = (model.marker(each, "FUNCTION", k) for k in ids)
        found.append(Link(each, "DISTANCE", i, j, model.units.length * length))
    return found


def joint_of(model: Model, link: Link) -> Joint:
    """Return a link as a joint: its first body carries J, its second one I, as Adams measures I
    relative to J.
    """
    name, kind = link.statement.name, link.kind
    bodies = model.body(link.j), model.body(link.i)
    one, other = model.frame(link.i), model.frame(link.j)
    point, axis = coordinates(one.origin), coordinates(other.z)
    with explained(link.statement.file, link.statement.label):
        if cls := _AXIAL.get(kind):
            return cls(name, *bodies, point, axis)
        match kind:
            case "SPHERICAL" | "ATPOINT":
                return Spherical(name, *bodies, point)
            case "FIXED":
                return Fixed(name, *bodies, point)
            case "UNIVERSAL":
                return Universal(name, *bodies, point, (axis, coordinates(one.z)))
            case "HOOKE":
                pair = coordinates(other.y), coordinates(one.x)
                return Universal(name, *bodies, point, pair)
            case "CONVEL":  # both z axes point away from the centre
                pair = coordinates(-other.z), coordinates(one.z)
                return ConstantVelocity(name, *bodies, point, pair)
            case "SCREW":
                lead = model.units.length * link.statement.one("PITCH")
                return Screw(name, *bodies, point, axis, lead)
            case "ORIENTATION":
                return OrientationLock(name, *bodies)
            case "PARALLEL_AXES":
                return ParallelAxes(name, *bodies, axis)
            case "PERPENDICULAR":
                return PerpendicularAxes(name, *bodies, (axis, coordinates(one.z)))
            case _:
                ends = coordinates(other.origin), coordinates(one.origin)
                return Distance(name, *bodies, ends, link.length)


def coordinates_of(
    model: Model, links: Sequence[Link], joints: Mapping[str, Joint]
) -> list[Coordinate]:
    """Return the coordinates of all joints, to be driven."""
    found: list[Coordinate] = []
    for link in links:
        joint = joints[link.statement.name]
        if not isinstance(joint, AxialJoint) or link.kind == "PLANAR":
            continue
        several = len(joint.freedoms) > 1
        for freedom in joint.freedoms:
            measure = model.turn if freedom == "rotation" else model.slide
            name = f"{joint.name}.{freedom}" if several else joint.name
            found.append(Coordinate(name, joint, freedom, measure(link.i, link.j)))
    return found


def read_couplers(model: Model, driven: Sequence[Coordinate]) -> list[Coupler]:
    """Read the relations of joints: COUPLER, GEAR and rack and pinion joints.

    Raises:
        CaseError: a joint has no such coordinate, or the geometry does not say how they couple.
    """
    found: list[Coupler] = []
    for each in model.dataset.of("COUPLER"):
        pair = _coupled(each, driven)
        scales = each.numbers("SCALES") if "SCALES" in each.values else []
        if len(scales) not in (len(pair) - 1, len(pair)) or not all(scales):
            raise each.fault(
                f"SCALES: found {scales or 'none'}, expected {len(pair) - 1} or {len(pair)} numbers"
                f" for {len(pair)} joints, not zero; a subroutine cannot be read: leave it out by"
                " --without COUPLER"
            )
        weights = [
            scale * (1.0 if one.turns else 1.0 / model.units.length)
            for scale, one in zip([1.0, *scales][-len(pair) :], pair, strict=True)
        ]
        found.append(_coupler(each, pair, weights))
        off = sum(w * one.value for w, one in zip(weights, pair, strict=True))
        if abs(off) > _ROUNDED * sum(map(abs, weights)):
            model.dataset.notes.append(
                f"{each.name}: the scaled sum of its joints' coordinates is {off:.6g} at the start,"
                " and stays so: joints are coupled from the start"
            )
    for each in model.dataset.of("GEAR"):
        pair = _coupled(each, driven)
        found.append(_coupler(each, pair, _gear_weights(each, model, pair)))
    for each in model.dataset.of("JOINT"):
        if "RACKPIN" in each.flags:
            found.append(_rack(each, model, driven))
    return found


def _coupled(statement: Statement, driven: Sequence[Coordinate]) -> list[Coordinate]:
    """Return the two coordinates of a gear, two or three of a coupler, named by its joints."""
    names = statement.ids("JOINTS")
    types = statement.values.get("TYPE", "").upper().replace(",", ":").split(":")
    if not 2 <= len(names) <= 2 + (statement.kind == "COUPLER"):
        raise statement.fault(f"JOINTS: found {len(names)}, expected two; correct it")
    found: list[Coordinate] = []
    for k, name in enumerate(names):
        wanted = {"T": "translation", "R": "rotation"}.get(
            types[k].strip()[:1] if types[k:] else ""
        )
        own = [
            each
            for each in driven
            if each.joint.name == f"JOINT_{name}" and wanted in (None, each.freedom)
        ]
        if statement.kind == "GEAR":
            own = [each for each in own if each.turns] or own
        if len(own) != 1:
            listed = ", ".join(each.freedom for each in own) or "no such coordinate"
            raise statement.fault(
                f"JOINTS: JOINT/{name} has {listed}, expected one that turns or slides; name"
                " another joint, or say which by TYPE = R:T"
            )
        found += own
    return found


def _coupler(statement: Statement, pair: Sequence[Coordinate], weights: Sequence[float]) -> Coupler:
    """Return the coupler for a constant weighted sum of coordinates [rad, m]."""
    named = {one.joint.name: weight for one, weight in zip(pair, weights, strict=True)}
    if len(named) < len(pair):
        raise statement.fault("JOINTS: found a joint twice, expected different ones; correct it")
    with explained(statement.file, statement.label):
        return linear_relation(statement.name, named, [one.freedom for one in pair])


def _gear_weights(
    statement: Statement, model: Model, pair: Sequence[Coordinate]
) -> tuple[float, float]:
    """Return weights with which both gears have one velocity along z of the marker CV."""
    marker = model.marker(statement, "CV")
    contact, carrier = model.frame(marker), model.body(marker)
    found: list[float] = []
    for one in pair:
        arm = contact.origin - np.array(one.joint.point)
        speed = np.cross(one.axis, arm) if one.turns else one.axis
        along = float(speed @ contact.z)
        if carrier not in one.joint.bodies or abs(along) <= 1e-6 * float(np.linalg.norm(speed)):
            raise statement.fault(
                f"CV = {marker.statement.id}: found on {carrier}, expected on the body that carries"
                f" both gears, its z axis along the common velocity and not across that of"
                f" {one.joint.name}; move or turn the marker"
            )
        found.append(along if carrier == one.joint.i else -along)
    return found[0], -found[1]


def _rack(statement: Statement, model: Model, driven: Sequence[Coordinate]) -> Coupler:
    """Return the coupler of a rack and pinion joint: the rack rolls on the pinion on the side where
    its marker lies.
    """
    pinion, rack = model.ends(statement)
    radius = 0.5 * model.units.length * abs(statement.one("PD"))
    one = _supported(statement, model.body(pinion), driven, "rotation")
    other = _supported(statement, model.body(rack), driven, "translation")
    arm = model.frame(rack).origin - np.array(one.joint.point)
    for axis in (one.axis, other.axis):
        arm = arm - axis * (axis @ arm)
    off = float(np.linalg.norm(arm))
    speed = float(np.cross(one.axis, arm) @ other.axis) * radius / (off or 1.0)
    if abs(off - radius) > _OFF_PITCH * radius or abs(speed) < 1e-6 * radius:
        raise statement.fault(
            f"the line of the rack's marker {rack} is {off:.6g} m off the pinion's axis, expected"
            f" half of PD, {radius:.6g} m, across it, which says on which side it rolls; move the"
            " marker, or give a COUPLER with SCALES"
        )
    for body, each in ((model.body(pinion), one), (model.body(rack), other)):
        speed = speed if body == each.joint.j else -speed
    model.dataset.notes.append(
        f"{statement.name}: the rack rolls on the side of the pinion where {rack} lies, whatever"
        " the sign of PD"
    )
    return _coupler(statement, (one, other), (-speed, 1.0))


def _supported(
    statement: Statement, body: str, driven: Sequence[Coordinate], freedom: str
) -> Coordinate:
    """Return the only coordinate of a freedom of a body."""
    own = [x for x in driven if x.freedom == freedom and body in x.joint.bodies]
    if len(own) != 1:
        listed = ", ".join(x.name for x in own) or "none"
        raise statement.fault(
            f"found {listed} as joints of {body} with a {freedom}, expected the one that carries"
            " it; give a COUPLER with SCALES"
        )
    return own[0]
