"""Suspension outputs by the native engine, and a wheel on one hinge."""

import numpy as np
from kincheck.adapters.native import Native
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.outputs import with_slopes
from kincheck.core.case.quantity import with_markers
from kincheck.core.case.suspension import (
    Convention,
    Side,
    SuspensionOutput,
    Vehicle,
)
from kincheck.core.harness.compare import output_series
from kincheck.core.joints import Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle

TOL = 1e-12
ROUND_OFF = 1e-14
"""A hundred roundings of numbers near one, for values; derivatives are sums of a few products of
such numbers.
"""


def solved(case):
    """Every output of a case by the native engine, by name."""
    engine = Native()
    trajectory = engine.solve(engine.build(case), case, TOL)
    assert trajectory.solved.all()
    return {output.name: output_series(case, output, trajectory) for output in case.outputs}


def hinged(center, hinge, axis, angles, types, rate=1.0, points=(), between=None, **vehicle):
    """A wheel carrier on one hinge, turned through the angles: outputs by type, each with its
    slope.
    """
    known = {
        "convention": Convention.ISO_8855,
        "side": Side.LEFT,
        "forward": (1.0, 0.0, 0.0),
        "up": (0.0, 0.0, 1.0),
    }
    wheel = Vehicle(**known | {"wheel_center": "wheel", "wheel_radius": 0.3} | vehicle)
    more = {"motion_ratio": {"between": between}}
    outputs = [
        SuspensionOutput.registry[each](each, wheel, 1e-9, 0.0, "test", **more.get(each, {}))
        for each in types
    ]
    mechanism = Mechanism(
        "hinged",
        [Body("carrier"), Body("chassis", fixed=True)],
        [Revolute("hinge", "ground", "carrier", hinge, axis)],
        [Point("wheel", "carrier", center), *points],
        [JointAngle("turn", "hinge")],
    )
    sweep = Sweep("turn", np.asarray(angles), rate)
    case = Case(
        "hinged",
        "test",
        Truth.CONSENSUS_ONLY,
        with_markers(mechanism, outputs),
        sweep,
        with_slopes(outputs, 1.0),
    )
    return solved(case)
