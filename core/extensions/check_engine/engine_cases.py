"""Cases of forces for the check of an engine, and a joint that no engine knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ... import primitives as p
from ...algebra import ZERO, vec
from ...case.case import Case
from ...case.io.case_file import load_case
from ...case.io.outputs import default
from ...case.joint_probe import coordinates, probe, probes
from ...case.measures import Axis, DriverEffort, ElementForce, ForceMeasure, JointForce, JointMoment
from ...case.quantity import with_markers
from ...joints import Attachment, Joint, Revolute
from ...joints.base import directions, position, require_perpendicular, unit
from ...mechanism.loads import Axes, Force, SpringDamper, Torque, TorsionSpringDamper
from ...studies.checks.joint_loops import with_loads


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


def force_cases() -> Iterator[tuple[str, Case]]:
    """Yield the cases with their words: the loaded probe of each registered type, all elements, all
    drivers in uneven motion, a spring over several turns, and reactions left undetermined by
    redundant rows.
    """
    for case in probes():
        yield case.name, replace(at_rate(with_loads(case)), name=f"{case.name}_with_loads")
    yield "elements", _elements()
    yield "drivers", _with_forces(uneven_drives())
    for name in ("turns", "undetermined"):
        yield name, _with_forces(_read(name))


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
    case = with_loads(probe(Revolute))
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
    case = _read("uneven_drives")
    first, *others = case.sweep.motions.items()
    # not in the order of the drivers: an engine is to take a motion by its name
    sweep = replace(case.sweep, motions=dict([*others, first]))
    return replace(case, sweep=sweep, outputs=coordinates(case.mechanism))


def _read(name: str) -> Case:
    return load_case(Path(__file__).with_name(f"{name}.toml"))
