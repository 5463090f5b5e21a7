"""A mechanism as a Python script that builds it in Exudyn, only from Exudyn's own objects. Writing
needs no Exudyn.

A moving body is a rigid-body node with Euler parameters, at its origin in the case and parallel to
the global axes at design, because Exudyn measures the angle of a joint from the pose of parallel
bodies. Joints are Exudyn's, mostly generic joints. Other joints are expanded with further bodies: a
constant-velocity joint is four hinges that turn alike in pairs, and a cross whose right angle a
table has rounded is a body on two hinges, because a generic joint would restore the right angle.
Relative markers measure coordinates that are related to one another. (The adapter's rows with
further unknowns are not objects of Exudyn.)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from ...core import joints as j
from ...core.algebra import triple, vec
from ...core.errors import KincheckError
from ...core.extensions.exports.model_writer import NO_RANGES, NO_ZEROS, Ranges, Zeros
from ...core.joints.base import unit
from ...core.mechanism.body import Body
from ...core.mechanism.loads import (
    Axes,
    Bushing,
    Force,
    ForceElement,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from ...core.mechanism.mechanism import GROUND, Mechanism
from ...core.trajectory import Array, BodyMotion
from ..shared.exudyn_joints import frame_along, objects_of
from ..shared.tree_plan import CHAINS, Relation, Terms, ends_of, relations
from . import text
from .poses import Displacement, displacements, link_coordinates, link_motions
from .text import require_known


def inertial(body: Body) -> tuple[float, list[float], list[float]]:
    """Return mass, centre of mass and inertia of a body, relative to its origin and parallel to the
    global axes at design; Exudyn puts the product yz first.
    """
    xx, yy, zz, xy, xz, yz = text.six(text.inertia_at_origin(body))
    center = np.subtract(body.center, body.origin)
    return text.mass_of(body), center.tolist(), [xx, yy, zz, yz, xz, xy]


def is_known(element: ForceElement) -> bool:
    """Return whether a script has the element: it has no curves."""
    return not getattr(element, "curve", None)


def load_options(element: ForceElement) -> dict[str, Any]:
    """Return the options of the object or load."""
    match element:
        case Force() | Torque():
            turns = element.frame is Axes.BODY
            return {"loadVector": element.vector, "bodyFixed": turns}
        case SpringDamper():
            own = {"referenceLength": element.free_length}
        case TorsionSpringDamper():
            own = {"offset": element.free_angle}
        case Bushing():
            turning = (element.turning_stiffness, element.turning_damping)
            own = {"preload": element.preload, "turning": turning, "law": str(element.law)}
        case _:
            raise NotImplementedError(f"{element}: give its options in Exudyn here")
    return {"stiffness": element.stiffness, "damping": element.damping, **own}


def script_head(mechanism: Mechanism) -> str:
    """Return the functions that the lines call; with masses and force elements if it has loads."""
    masses, body = text.PLAIN, PLAIN_BODY
    if mechanism.has_loads:
        masses, body = text.weights(mechanism.bodies), LOADED_BODY
    return BEGINNING.replace("MASSES", masses).replace("BODY", body)


PLAIN_BODY = """
def body(name, position, initial, frame):
    frames[name], reference = frame, [*position, 1, 0, 0, 0]
    node = NodeRigidBodyEP(
        name=name, referenceCoordinates=reference, initialCoordinates=initial
    )
    nodes[name] = mbs.AddNode(node)
    rigid = ObjectRigidBody(name=name, mass=1, inertia=[1, 1, 1, 0, 0, 0], nodeNumber=nodes[name])
    bodies[name] = mbs.AddObject(rigid)
"""
LOADED_BODY = '''
forces = {}


def body(name, position, initial, frame, mass, center, inertia):
    """The centre of mass is from the origin; the inertia is about the origin."""
    frames[name], reference = frame, [*position, 1, 0, 0, 0]
    node = NodeRigidBodyEP(
        name=name, referenceCoordinates=reference, initialCoordinates=initial
    )
    nodes[name] = mbs.AddNode(node)
    rigid = ObjectRigidBody(
        name=name, mass=mass, inertia=inertia, centerOfMass=center, nodeNumber=nodes[name]
    )
    bodies[name] = mbs.AddObject(rigid)
    falling = mbs.AddMarker(MarkerBodyMass(bodyNumber=bodies[name]))
    mbs.AddLoad(LoadMassProportional(markerNumber=falling, loadVector=gravity))


def spring(name, first, second, **options):
    item = ObjectConnectorSpringDamper(
        name=name, markerNumbers=[marker(*first), marker(*second)], **options
    )
    forces[name] = mbs.AddObject(item)


def torsion(name, first, second, turn, **options):
    """A torsional spring-damper about the z axis of its markers, whose turn a node counts."""
    turns = mbs.AddNode(NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[turn]))
    item = ObjectConnectorTorsionalSpringDamper(
        name=name, markerNumbers=[marker(*first), marker(*second)], nodeNumber=turns, **options
    )
    forces[name] = mbs.AddObject(item)


def bushing(name, first, second, stiffness, damping, preload, turning, law):
    """Springs and dampers along and about the axes of the first marker. The force is at the second
    one, so that a couple is on the first; the elastic torque is the gradient of an energy in Euler
    parameters or Cardan angles. Exudyn's own law has neither.
    """
    ends = [marker(*first), marker(*second)]
    kinds = exu.OutputVariableType

    def wrench(mbs, t, item, *measured):
        def of(kind):
            return [np.array(mbs.GetMarkerOutput(end, kind)) for end in ends]

        r0, r1 = of(kinds.Position)
        v0, v1 = of(kinds.Velocity)
        w0, w1 = of(kinds.AngularVelocity)
        A, B = (each.reshape(3, 3) for each in of(kinds.RotationMatrix))
        R, d = A.T @ B, r1 - r0
        x, rates = A.T @ d, A.T @ (v1 - v0 - np.cross(w0, d))
        force = np.multiply(stiffness, x) + preload + np.multiply(damping, rates)
        if item is None:
            return [*np.cross(d, A @ force)]
        if law == "cardan":
            a, b = np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(R[0, 2])
            c = np.arctan2(-R[0, 1], R[0, 0])
            turns = [
                [1, 0, 0],
                [0, np.cos(a), np.sin(a)],
                [np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)],
            ]
            torque = np.linalg.solve(turns, np.multiply(turning[0], [a, b, c]))
        else:
            e0 = 0.5 * np.sqrt(1 + np.trace(R))
            e = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * e0)
            twice = 2 * np.multiply(turning[0], e)
            torque = e0 * twice + np.cross(e, twice)
        return [*force, *(torque + np.multiply(turning[1], A.T @ (w1 - w0)))]

    item = ObjectConnectorRigidBodySpringDamper(
        name=name, markerNumbers=ends, springForceTorqueUserFunction=wrench
    )
    forces[name] = mbs.AddObject(item)
    if bodies[first[0]] != ground:
        couple = LoadTorqueVector(
            markerNumber=ends[0], loadVectorUserFunction=lambda mbs, t, load: wrench(mbs, t, None)
        )
        mbs.AddLoad(couple)


def force(name, at, **options):
    item = LoadForceVector(markerNumber=marker(*at), **options)
    forces[name] = mbs.AddLoad(item)


def torque(name, at, **options):
    item = LoadTorqueVector(markerNumber=marker(*at), **options)
    forces[name] = mbs.AddLoad(item)
'''
BEGINNING = '''\
"""A mechanism in Exudyn, written by kincheck. Lengths are in m, angles in rad.

MASSES Drivers are not part of the model: the initial
coordinates are consistent with the driver values below. All bodies are parallel to the global axes
at design, in their reference coordinates, from which the state of Exudyn is measured; `frames` has
the Euler parameters of the bodies' own axes in these.
"""

import exudyn as exu
import numpy as np
from exudyn.itemInterface import *

SC = exu.SystemContainer()
mbs = SC.AddSystem()
ground = mbs.AddObject(ObjectGround())
nodes, bodies, frames, joints, coordinates, points = {}, {}, {}, {}, {}, {}

BODY

def marker(name, position, rotation=np.eye(3)):
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation, position
    return mbs.AddMarker(MarkerBodyRigid(bodyNumber=bodies[name], localHT=frame))


def joint(name, kind, first, second, **options):
    item = kind(markerNumbers=[marker(*first), marker(*second)], **options)
    joints.setdefault(name, []).append(mbs.AddObject(item))


def translation(name, first, second, axis):
    """The displacement of the second point against the first along an axis of the first body."""
    (one, at), (two, there) = first, second
    points = dict(localPosition0=at, localPosition1=there)
    item = MarkerBodiesRelativeTranslationCoordinate(
        bodyNumbers=[bodies[one], bodies[two]], axis0=axis, **points
    )
    coordinates[name] = mbs.AddMarker(item)


def rotation(name, first, second, axis, initial):
    """The turn of the second body against the first; a node keeps it, and so counts the turns."""
    (one, at), (two, there) = first, second
    turns = mbs.AddNode(NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[initial]))
    points = dict(localPosition0=at, localPosition1=there)
    item = MarkerBodiesRelativeRotationCoordinate(
        nodeNumber=turns, bodyNumbers=[bodies[one], bodies[two]], axis0=axis, **points
    )
    coordinates[name] = mbs.AddMarker(item)


def relation(name, one, other, factor):
    """One coordinate is the factor times the other."""
    markers = [coordinates[one], coordinates[other]]
    item = ObjectConnectorCoordinate(markerNumbers=markers, factor1=factor)
    joints.setdefault(name, []).append(mbs.AddObject(item))


'''
END = "\nmbs.Assemble()\n"


# Round-off of a right angle between unit vectors, which a generic joint leaves as a residual.
RIGHT_ANGLE = 1e-15


def write(
    mechanism: Mechanism,
    way: Mapping[str, BodyMotion],
    start: Mapping[str, float],
    zeros: Zeros = NO_ZEROS,
    ranges: Ranges = NO_RANGES,
) -> Mapping[str, str]:
    """Return a .py file; see `Writer`. Initial coordinates are the end of the way.

    Raises:
        KincheckError: a joint or coupler has no counterpart in Exudyn.
    """
    require_known(mechanism, "Exudyn")
    strange = [each for each in mechanism.couplers if each.curve or len(each.joints) > 2]
    if strange:
        raise KincheckError(
            f"{strange[0]} has no counterpart in Exudyn; export MJCF or URDF instead"
        )
    note = text.zeros_of(zeros) + text.lost_limits(ranges)
    script = _Script(*_with_hinges(mechanism, way)).text(start)
    return {".py": f"#{note}\n{script}" if note else script}


class _Script:
    """The lines of one mechanism's script."""

    def __init__(self, mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> None:
        self.mechanism, self.way, self.placed = mechanism, way, displacements(mechanism, way)
        self.lines: list[str] = []
        self.loaded = mechanism.has_loads
        self.measured = set[str]()

    def text(self, start: Mapping[str, float]) -> str:
        """Return the script."""
        self.lines.append(f"drivers = {dict(start)!r}")
        fixed = [GROUND, *(body.name for body in self.mechanism.bodies if body.fixed)]
        if self.loaded:
            self.lines.append(f"gravity = {_text(self.mechanism.gravity)}")
        self.lines.append(f"bodies |= dict.fromkeys({fixed!r}, ground)")
        for body in self.mechanism.moving:
            turn = np.array([float(each[-1]) for each in self.placed[body.name].turn])
            moved = [*(self.way[body.name].r[-1] - body.origin), *(turn - (1.0, 0.0, 0.0, 0.0))]
            self.call(
                *("body", body.name, body.origin, moved, body.euler_parameters),
                *(inertial(body) if self.loaded else ()),
            )
        for joint in self.mechanism.joints:
            self.joint(joint)
            for relation in relations(joint):
                self.relate(joint.name, relation)
        for coupler in self.mechanism.couplers:
            self.relate(coupler.name, coupler.terms)
        forces = [each.name for each in self.mechanism.forces if is_known(each)]
        if strange := text.left_out(self.mechanism, forces, True).strip():
            self.lines.append(f"# {strange}")
        for force in filter(is_known, self.mechanism.forces):
            self.load(force)
        for point in self.mechanism.points:
            self.lines.append(
                f"points[{point.name!r}] = bodies[{point.body!r}],"
                f" {self.arm(point.body, point.position)}"
            )
        return script_head(self.mechanism) + "\n".join(self.lines) + "\n" + END

    def call(self, function: str, *values: Any, **options: Any) -> None:
        """Add a line with a call."""
        texts = [
            *map(_text, values),
            *(f"{name}={_text(value)}" for name, value in options.items()),
        ]
        self.lines.append(f"{function}({', '.join(texts)})")

    def arm(self, body: str, P: Sequence[float]) -> _Code:
        """Return the text of a point, global at design, in Exudyn's coordinates of a body; fixed
        bodies are Exudyn's ground.
        """
        origin = (
            (0.0, 0.0, 0.0) if self.mechanism.is_fixed(body) else self.mechanism.body(body).origin
        )
        return _Code(_text([*(vec(P) - vec(origin))]))

    def marker(self, body: str, P: Sequence[float], axes: Array | None = None) -> _Code:
        """Return the text of a frame on a body, global at design; the columns are its axes, by
        default the global axes.
        """
        frame = [] if axes is None else [_text(axes)]
        return _Code(f"({', '.join([repr(body), self.arm(body, P), *frame])})")

    def joint(self, joint: j.Joint) -> None:
        """Add a joint as objects of Exudyn."""
        for each in objects_of(joint, ends_of(self.mechanism, joint)):
            points = each.points
            if isinstance(joint, j.RevoluteSpherical) and each.axes:
                # the link keeps its position along the hinge; if its foot is on the hinge, the
                # generic joint needs no offset
                link, axis = vec(points[1]) - vec(points[0]), unit(joint.axis)
                points = [*(vec(points[0]) + (axis @ link) * axis)], points[1]
            markers = map(self.marker, joint.bodies, points, each.frames)
            self.call("joint", joint.name, _Code(each.kind), *markers, **each.options)

    def load(self, force: ForceElement) -> None:
        """Add a force element as an object or load of Exudyn."""
        options = load_options(force)
        if isinstance(force, SpringDamper):
            ends = map(self.marker, force.bodies, force.points)
            self.call("spring", force.name, *ends, **options)
        elif isinstance(force, TorsionSpringDamper):
            joint: Any = self.mechanism.joint(force.joint)
            axes = frame_along(joint.axis, 2)
            ends = [self.marker(body, joint.point, axes) for body in joint.bodies]
            self.call("torsion", force.name, *ends, *self.values(joint)["rotation"], **options)
        elif isinstance(force, Bushing):
            axes = np.array(force.triad).T
            ends = [self.marker(body, force.point, axes) for body in force.bodies]
            self.call("bushing", force.name, *ends, **options)
        elif isinstance(force, Force | Torque):
            at = force.point if isinstance(force, Force) else (0.0, 0.0, 0.0)
            self.call(force.type, force.name, self.marker(force.body, at), **options)

    def relate(self, name: str, terms: Terms) -> None:
        """Keep the weighted sum of two coordinates (joint, freedom, weight) at zero."""
        one, other, line = Relation(name, terms, ()).follower(signed=False)
        self.call("relation", name, self.coordinate(*one), self.coordinate(*other), line.at(0.0)[1])

    def values(self, joint: Any) -> Mapping[str, tuple[float, ...]]:
        """Return the coordinates of a joint at the start, by freedom."""
        links = CHAINS[type(joint)](joint, joint.point)
        values = link_coordinates(joint, links, self.placed)
        return {link.name: value for link, value in zip(links, values, strict=True)}

    def coordinate(self, name: str, freedom: str) -> str:
        """Return the name of a joint's coordinate, and add its measurement."""
        joint: Any = self.mechanism.joint(name)
        known = f"{name}.{freedom}"
        if known not in self.measured:
            self.measured.add(known)
            ends = (self.marker(body, joint.point) for body in joint.bodies)
            initial = self.values(joint)[freedom] if freedom == "rotation" else ()
            self.call(freedom, known, *ends, [*unit(joint.axis)], *initial)
        return known


class _Code(str):
    """Text that is code."""


def _text(value: Any) -> str:
    """Return a value as Python text; numbers are read back as the same doubles."""
    if isinstance(value, _Code):
        return value
    if isinstance(value, np.ndarray | list | tuple):
        return f"[{', '.join(map(_text, cast(Sequence[Any], value)))}]"
    return repr(value) if isinstance(value, str | int) else repr(float(value) + 0.0)


def _with_hinges(
    mechanism: Mechanism, way: Mapping[str, BodyMotion]
) -> tuple[Mechanism, Mapping[str, BodyMotion]]:
    """Return the mechanism and its way, with joints unknown to Exudyn as hinges between further
    bodies.
    """
    placed, way = displacements(mechanism, way), dict(way)
    bodies, joints, couplers = [*mechanism.bodies], list[j.Joint](), [*mechanism.couplers]
    for joint in mechanism.joints:
        if not _needs_hinges(joint):
            joints.append(joint)
            continue
        P = ends_of(mechanism, joint)[0]
        links = CHAINS[type(joint)](joint, P)
        motions = link_motions(joint, links, placed)
        hinges = [
            (link, motion[0])
            for link, motion in zip(links, motions, strict=True)
            if link.move == "hinge"
        ]
        names, before, swing = (
            [f"{joint.name}.{k}" for k in range(1, len(hinges) + 1)],
            joint.i,
            placed[joint.i],
        )
        for name, (link, angle) in zip(names[:-1], hinges, strict=False):
            swing = swing.then_about(vec(link.axis), vec(P), angle)
            bodies.append(text.link_between(name, triple(P), mechanism))
            way[name] = _motion(swing, P)
            joints.append(j.Revolute(name, before, name, P, link.axis))
            before = name
        last = hinges[-1][0].axis
        crossed = isinstance(joint, j.PerpendicularAxes)
        joints.append(
            j.ParallelAxes(names[-1], before, joint.j, last)
            if crossed
            else j.Revolute(names[-1], before, joint.j, P, last)
        )
        by_name = dict(zip((link.name for link, _ in hinges), names, strict=True))
        for relation in relations(joint):
            (_, one, weight), (_, other, opposite) = relation
            couplers.append(
                j.Gear(f"{by_name[one]} alike", (by_name[one], by_name[other]), -opposite / weight)
            )
    return replace(mechanism, bodies=bodies, joints=joints, couplers=couplers, drivers=()), way


def _needs_hinges(joint: j.Joint) -> bool:
    if isinstance(joint, j.Universal | j.PerpendicularAxes):
        return abs(unit(joint.axes[0]) @ unit(joint.axes[1])) > RIGHT_ANGLE
    return isinstance(joint, j.ConstantVelocity)


def _motion(displacement: Displacement, P: Iterable[float]) -> BodyMotion:
    """Return the motion of a body aligned at design, with its origin at P."""
    r, p = (
        np.column_stack(np.broadcast_arrays(*values))
        for values in (displacement.of(vec([*P])), displacement.turn)
    )
    return BodyMotion(r, p, None, None)
