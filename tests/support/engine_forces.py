"""Forces of a mechanism by an engine beside those of the native engine."""

from dataclasses import dataclass, replace

import numpy as np
from kincheck import Case
from kincheck.core.case.case import Sweep, Truth
from kincheck.core.case.measures import Axis, DriverEffort, ElementForce, JointForce, JointMoment
from kincheck.core.case.quantity import with_markers
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper

from .engine_motion import installed

UNUSED = {"atol": 1.0, "rtol": 0.0, "why": "not judged here"}


def every_force(mechanism, names=None):
    """Outputs of all reactions, efforts and element forces, or of the joints named."""
    joints = [each for each in mechanism.given_joints if names is None or each.name in names]
    found = [
        kind(f"{joint.name} {kind.type} {axis}", joint=joint.name, component=axis, **UNUSED)
        for joint in joints
        for kind in (JointForce, JointMoment)
        for axis in Axis
    ]
    found += [DriverEffort(f"effort {d.name}", driver=d.name, **UNUSED) for d in mechanism.drivers]
    found += [ElementForce(f"element {f.name}", force=f.name, **UNUSED) for f in mechanism.forces]
    return tuple(output.bound(mechanism) for output in found)


def force_case(mechanism, values, rate=1.0, names=None):
    """A sweep of the first driver with all forces as outputs."""
    sweep = Sweep(mechanism.drivers[0].name, np.asarray(values, dtype=float), rate)
    return sweep_case(mechanism, sweep, names)


def sweep_case(mechanism, sweep, names=None):
    """A case with all forces as outputs, or those of the joints named."""
    outputs = every_force(mechanism, names)
    marked = with_markers(mechanism, outputs)
    return Case(mechanism.name, "made here", Truth.CONSENSUS_ONLY, marked, sweep, outputs)


def pushed(mechanism, seed=3):
    """The mechanism with force elements of every type."""
    random, moving = np.random.default_rng(seed), mechanism.moving
    first, last = moving[0].name, moving[-1].name

    def near(name):
        return tuple(np.array(mechanism.body(name).origin) + 0.3 * random.normal(size=3))

    forces = [
        SpringDamper(
            *("to ground", "ground", last),
            points=((1.0, 2.0, 3.0), near(last)),
            stiffness=300.0,
            damping=5.0,
        ),
        Force("turning push", first, near(first), (3.0, -4.0, 5.0), "body"),
        Force("push", last, near(last), (3.0, -4.0, 5.0)),
        Torque("twist", last, (0.5, 0.25, -0.75)),
        Torque("turning twist", first, (0.3, 0.4, 0.5), "body"),
    ]
    if first != last:
        forces.append(
            SpringDamper(
                *("between", last, first),
                points=(near(last), near(first)),
                stiffness=200.0,
                damping=3.0,
                free_length=0.1,
            )
        )
    forces += [
        TorsionSpringDamper(f"clock {joint.name}", joint.name, 2.0, damping=0.3, free_angle=0.2)
        for joint in mechanism.joints
        if "rotation" in joint.freedoms
    ]
    return replace(mechanism, forces=forces)


@dataclass(frozen=True)
class Beside:
    """Values of all outputs: native and of an engine, shape (outputs, samples)."""

    native: np.ndarray
    found: np.ndarray

    @property
    def same_missing(self):
        return bool((np.isnan(self.native) == np.isnan(self.found)).all())

    @property
    def worst(self):
        """The largest difference, as a part of the largest force."""
        return np.nanmax(np.abs(self.found - self.native)) / np.nanmax(np.abs(self.native))


def values(case, engine):
    """Values of all outputs by an engine, and its trajectory."""
    given = installed(engine)
    assert given.unsupported(case) is None
    found = given.solve(given.build(case), case, 1e-12)
    assert found.solved.all(), found.message
    return np.array([output.values(found.forces) for output in case.outputs]), found
