"""Cases of forces for the check of an engine, and a joint that no engine knows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import primitives as p
from ...algebra import ZERO, vec
from ...case.case import TIME, Case, Quantity, Sweep, Truth
from ...case.io.outputs import default
from ...case.joint_probe import coordinates, probe, probes
from ...case.measures import Axis, DriverEffort, ElementForce, ForceMeasure, JointForce, JointMoment
from ...case.quantity import with_markers
from ...joints import Attachment, Fixed, Joint, Revolute, Translational
from ...joints.base import directions, position, require_perpendicular, unit
from ...mechanism.body import Body
from ...mechanism.loads import Axes, Force, SpringDamper, Torque, TorsionSpringDamper
from ...mechanism.mechanism import GROUND, Mechanism, Point
from ...mechanism.motions import JointAngle, JointDisplacement, PointCoordinate, Sine
from .loaded_probe import GRAVITY, INERTIA, loaded


@dataclass(frozen=True)
class UnknownJoint(Joint):
    """The point of body j stays in the plane through it normal to the first axis, on body i, and
    the second axis, on body j, stays perpendicular to the first.
    """

    freedoms = ("translation x", "translation y", "rotation i", "rotation j")
    symmetric = False
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        point, (normal, along) = vec(self.point), map(unit, self.axes)
        return p.Dot20(normal, i.arm(point), j.arm(point), ZERO), p.Dot10(normal, along)


UnknownJoint.type = "unknown_to_engines"  # set here, so that it is not registered for case files


RATE = 0.75
"""Rate of the probes' hinge [rad/s]; at one, rates by time and by angle are the same."""
SOURCE = "made for check-engine"


def force_cases() -> Iterator[tuple[str, Case]]:
    """Yield the cases with their words: the loaded probe of each registered type, all elements, all
    drivers in uneven motion, a spring over several turns, and reactions left undetermined by
    redundant rows.
    """
    for case in probes():
        yield case.name, replace(at_rate(loaded(case)), name=f"{case.name}_with_loads")
    yield "elements", _elements()
    yield "drivers", _with_forces(uneven_drives())
    yield "turns", _turns()
    yield "undetermined", _undetermined()


def at_rate(case: Case) -> Case:
    """Return a probe at another rate than one."""
    return replace(case, sweep=replace(case.sweep, rate=RATE))


def _with_forces(case: Case) -> Case:
    """Return the case of a loaded mechanism with all its forces as outputs."""
    mechanism = case.mechanism
    size = 10.0 * sum(body.mass for body in mechanism.bodies)
    force, moment = default(size, "N"), default(size, "N m")
    outputs: list[ForceMeasure] = []
    for joint in mechanism.joints:
        for kind, what, tolerance in (
            (JointForce, "force", force),
            (JointMoment, "moment", moment),
        ):
            for axis in Axis:
                name = f"{joint.name}_{what}_{axis}"
                outputs.append(kind(name, *tolerance, joint=joint.name, component=axis))
    for driver in mechanism.drivers:
        outputs.append(DriverEffort(f"{driver.name}_effort", *force, driver=driver.name))
    for each in mechanism.forces:
        outputs.append(ElementForce(f"{each.name}_amount", *force, force=each.name))
    bound = tuple(each.bound(mechanism) for each in outputs)
    mechanism = with_markers(mechanism, bound)
    return replace(case, name=f"{case.name}_with_forces", mechanism=mechanism, outputs=bound)


def _elements() -> Case:
    """Return a loaded probe with every force element."""
    case = loaded(probe(Revolute))
    a, b = (body.name for body in case.mechanism.moving)
    forces = [
        *case.mechanism.forces,
        SpringDamper("strut", b, a, ((0.4, -0.1, 0.5), (0.1, -0.3, 0.2)), 80.0, 3.0, 0.2),
        TorsionSpringDamper("clock", "hinge", 4.0, damping=0.5, free_angle=0.25),
        Force("push", b, (0.4, 0.1, 0.2), (3.0, -4.0, 5.0), Axes.GLOBAL),
        Force("thrust", a, (0.2, -0.3, 0.1), (-2.0, 1.0, 4.0), Axes.BODY),
        Torque("twist", b, (0.5, 0.25, -0.75), Axes.GLOBAL),
        Torque("motor", a, (0.3, 0.4, 0.5), Axes.BODY),
    ]
    mechanism = replace(case.mechanism, forces=forces)
    return _with_forces(replace(at_rate(case), name="elements", mechanism=mechanism))


def uneven_drives() -> Case:
    """Return a chain with a joint angle, a displacement and a point driven by sines at once."""
    mechanism = Mechanism(
        "uneven_drives",
        [
            *(_body(name, k) for k, name in enumerate(("sledge", "arm", "hand"))),
            Body("wall", (0.3, 0.2, 0.1), fixed=True),
        ],
        [
            # the fixed body is the second: a reaction is that of the first body on the second
            Translational("guide", "sledge", "wall", (0.4, -0.2, 0.3), (0.3, 0.5, 1.0)),
            Revolute("shoulder", "sledge", "arm", (0.2, 0.1, 0.4), (1.0, -2.0, 0.5)),
            Revolute("elbow", "arm", "hand", (0.6, 0.3, 0.2), (0.4, 1.0, 0.3)),
        ],
        [Point("tip", "hand", (0.9, 0.3, 0.6)), Point("heel", "arm", (0.5, -0.2, 0.3))],
        [
            JointDisplacement("slide", "guide"),
            JointAngle("swing", "shoulder"),
            PointCoordinate("reach", "tip", (1.0, 0.0, -1.0)),
        ],
        gravity=GRAVITY,
    )
    motions = {
        "swing": Sine(0.3, 0.5, 0.1),
        "reach": Sine(0.05, 0.4),
        "slide": Sine(-0.1, 0.3, 0.2),
    }
    sweep = Sweep(TIME, np.linspace(0.0, 0.75, 4), motions=motions)
    return _case(mechanism, sweep, coordinates(mechanism))


def _case(mechanism: Mechanism, sweep: Sweep, outputs: tuple[Quantity, ...] = ()) -> Case:
    return Case(mechanism.name, SOURCE, Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def _turns() -> Case:
    """Return a wheel with a rider on a torsional spring over two turns, from the last value to the
    first.
    """
    mechanism = Mechanism(
        "turns",
        [_body("wheel", 0), _body("rider", 1)],
        [
            Revolute("hub", GROUND, "wheel", (0.1, 0.2, 0.3), (0.2, -1.0, 0.4)),
            Fixed("weld", "wheel", "rider", (0.3, 0.1, 0.4)),
        ],
        drivers=[JointAngle("turn", "hub")],
        gravity=GRAVITY,
        forces=[TorsionSpringDamper("clock", "hub", 4.0, damping=0.5, free_angle=0.25)],
    )
    return _with_forces(_case(mechanism, Sweep("turn", np.linspace(7.0, -6.0, 14), RATE)))


def _undetermined() -> Case:
    """Return a planar four-bar: its true hinges leave three directions of each reaction open."""
    places = ((0.0, 0.0, 0.0), (0.1, 0.3, 0.0), (0.6, 0.5, 0.0), (0.5, 0.0, 0.0))
    bodies = (GROUND, "crank", "rod", "rocker", GROUND)
    axis = (0.0, 0.0, 1.0)
    mechanism = Mechanism(
        "undetermined",
        [_body(name, k) for k, name in enumerate(bodies[1:-1])],
        [
            Revolute(f"hinge_{k}", i, j, place, axis)
            for k, (i, j, place) in enumerate(zip(bodies, bodies[1:], places, strict=False))
        ],
        drivers=[JointAngle("turn", "hinge_0")],
        gravity=GRAVITY,
    )
    return _with_forces(_case(mechanism, Sweep("turn", np.linspace(-0.2, 0.3, 3), RATE)))


def _body(name: str, number: int) -> Body:
    """Return a body with mass whose frame is away from the global one and turned."""
    center = (0.3 + 0.1 * number, 0.1, 0.2 * math.cos(number))
    return Body(
        name,
        (0.1, -0.2, 0.05),
        (0.5, 0.5, -0.5, 0.5),
        mass=2.0 + number,
        center_of_mass=center,
        inertia=INERTIA,
    )
