"""Cases for Exudyn's adapter, solved with every sample."""

import numpy as np
from kincheck.adapters.exudyn.exudyn import Exudyn
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point

TOL = 1e-12


def case_of(bodies, joints, points, drivers, values, rate=1.0, design=0.0):
    """A case that sweeps the first driver and asks for all points; points: name -> (body,
    position).
    """
    places = [Point(name, body, tuple(position)) for name, (body, position) in points.items()]
    mechanism = Mechanism(
        "m",
        [body if isinstance(body, Body) else Body(body) for body in bodies],
        joints,
        places,
        drivers,
    )
    outputs = tuple(Output(name, name, (1.0, 0.0, 0.0), False, 1e-9, 0.0, "") for name in points)
    sweep = Sweep(drivers[0].name, np.asarray(values, dtype=float), rate, design)
    return Case("m", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def solve(case):
    assert Exudyn().unsupported(case) is None
    return Exudyn().solve(Exudyn().build(case), case, TOL)


def solved(case):
    """The motion of the case's points, by name; every sample must be there."""
    trajectory = solve(case)
    assert trajectory.solved.all(), trajectory.message
    assert trajectory.residual <= TOL
    return trajectory.points


def turned(joints, reverse):
    return [joint.reversed() for joint in joints] if reverse else joints


def assert_consistent(motion, dt):
    """Velocity and acceleration against eighth-order differences over uniform samples."""
    weights = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    n = len(motion.position)
    for values, derivative in (
        (motion.position, motion.velocity),
        (motion.velocity, motion.acceleration),
    ):
        found = (
            sum(
                w * (values[4 + k : n - 4 + k] - values[4 - k : n - 4 - k])
                for k, w in enumerate(weights, 1)
            )
            / dt
        )
        # differences: round-off 1e-16 / dt of values about 1, times the mechanism's amplification
        assert np.abs(found - derivative[4:-4]).max() <= 1e-10 * (1.0 + np.abs(derivative).max())
