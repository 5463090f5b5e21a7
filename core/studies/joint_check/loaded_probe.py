"""The probe of a joint with masses, gravity and a spring, solved natively with forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...case.case import Case
from ...case.io.outputs import default
from ...case.measures import DriverEffort, ForceMeasure, JointForce, JointMoment
from ...case.quantity import with_markers
from ...errors import SolveError
from ...forces import Reaction
from ...joints import AxialJoint, Joint
from ...kinematics import NativeSolver
from ...mechanism.body import Body
from ...mechanism.drivers import JointAngle, JointDisplacement, JointDriver
from ...mechanism.loads import SpringDamper
from ...mechanism.mechanism import GROUND, Mechanism
from ...mechanism.motions import Path, Sine
from ...trajectory import Trajectory

# Samples of the probe: forces follow from each pose alone.
SAMPLES = 3
TOL = 1e-12
GRAVITY = (0.5, -1.0, -9.75)
INERTIA = (0.04, 0.05, 0.06, 0.004, -0.003, 0.002)
CENTRE = np.array([0.05, -0.03, 0.04])
DRIVEN: Mapping[type[JointDriver], Sine] = {
    JointDisplacement: Sine(0.05, 0.5),
    JointAngle: Sine(0.5, 0.25),
}
"""Drivers of a joint's own coordinates, slides first, and their motions [m, rad]."""


@dataclass(frozen=True, eq=False)
class Probe:
    """A loaded probe and its native solution."""

    mechanism: Mechanism
    joint: Joint
    motion: Trajectory

    @property
    def reaction(self) -> Reaction:
        """The reaction of the joint under test."""
        assert self.motion.forces is not None
        return self.motion.forces.joints[self.joint.name]

    @property
    def size(self) -> float:
        """The largest force of any joint [N]."""
        assert self.motion.forces is not None
        every = self.motion.forces.joints.values()
        return max(float(np.abs(each.force).max()) for each in every)


def loaded(case: Case) -> Case:
    """Return the probe with loads, and the forces of joint and driver as outputs."""
    mechanism = case.mechanism
    bodies = [_with_mass(body, k, mechanism) for k, body in enumerate(mechanism.bodies)]
    last = bodies[-1].name
    ends = ((0.9, 0.4, -0.3), mechanism.points[0].position)
    spring = SpringDamper("spring", GROUND, last, ends, 50.0, 2.0, 0.5)
    heavy = replace(mechanism, bodies=bodies, gravity=GRAVITY, forces=[spring])
    name, weight = _tested(case).name, 10.0 * len(bodies)
    outputs: list[ForceMeasure] = [
        cls(f"{what}_{k}", *default(weight, "N"), joint=name, direction=axis)
        for cls, what in ((JointForce, "force"), (JointMoment, "moment"))
        for k, axis in zip("xyz", ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), strict=True)
    ]
    outputs.append(DriverEffort("effort", *default(weight, "N m"), driver=case.sweep.driver))
    bound = tuple(output.bound(heavy) for output in outputs)
    few = case.sweep.values[np.linspace(0, len(case.sweep.values) - 1, SAMPLES).astype(int)]
    sweep = replace(case.sweep, values=few)
    return replace(case, mechanism=with_markers(heavy, bound), sweep=sweep, outputs=bound)


def driven(case: Case) -> Case | None:
    """Return the loaded probe with drivers of the joint's own coordinates in place of rods, and the
    joint seen from its second body, whose frame is then off the axis; None without coordinates.
    """
    heavy = loaded(case)
    mechanism, tested = heavy.mechanism, _tested(heavy)
    if not isinstance(tested, AxialJoint):
        return None
    rods = [joint for joint in mechanism.joints if joint.name.startswith("rod_")]
    # a screw has two coordinates and one freedom
    found = [each for each in DRIVEN if each.freedom in tested.freedoms][: len(rods)]
    left = rods[len(found) :]
    joints = [tested.reversed() if each is tested else each for each in mechanism.joints]
    drivers = [each(f"own {each.freedom}", tested.name) for each in found]
    mechanism = replace(
        mechanism,
        joints=[joint for joint in joints if joint not in rods or joint in left],
        drivers=[*mechanism.drivers, *drivers],
    )
    motions = {driver.name: DRIVEN[type(driver)] for driver in drivers}
    efforts = [
        DriverEffort(f"{name} effort", *default(10.0, "N m"), driver=name).bound(mechanism)
        for name in motions
    ]
    return replace(
        heavy,
        mechanism=with_markers(mechanism, efforts),
        sweep=replace(heavy.sweep, motions=motions),
        outputs=(*heavy.outputs, *efforts),
    )


def _tested(case: Case) -> Joint:
    # the probe's hinge or rods may be of the same type
    return next(joint for joint in case.mechanism.joints if {*joint.bodies} == {"a", "b"})


def _with_mass(body: Body, number: int, mechanism: Mechanism) -> Body:
    near = [p for j in mechanism.joints if body.name in j.bodies for p in j.points_on(body.name)]
    center = np.mean(near or [(0.0, 0.0, 0.0)], axis=0) + CENTRE
    x, y, z = center.tolist()
    return replace(body, mass=2.0 + number, center_of_mass=(x, y, z), inertia=INERTIA)


def solved(case: Case, mechanism: Mechanism) -> Probe:
    """Solve the loaded probe natively.

    Raises:
        SolveError: samples are missing.
    """
    path: Path = case.sweep.path
    names = tuple(body.name for body in mechanism.moving)
    forces = [each.name for each in (*mechanism.joints, *mechanism.drivers)]
    solver = NativeSolver().prepare(mechanism, path, bodies=names, forces=forces)
    found = solver(TOL)
    if not found.solved.all() or found.forces is None:
        raise SolveError(f"the probe with masses cannot be solved: {found.message}")
    return Probe(mechanism, mechanism.joint(_tested(case).name), found)
