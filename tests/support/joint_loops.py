"""A body that hangs on a crank by a joint of any type, in a closed loop, with its native motion."""

from functools import cache

import numpy as np
from kincheck import GROUND, Body, Distance, Joint, JointAngle, Mechanism, Point, Revolute, solve
from kincheck.core import joints as library

from ..support.examples import examples

RODS, OTHER_RODS, GEOMETRY = examples(__file__, "rods", "other_rods", "geometry")

HINGE = (0.2, -0.1, 0.3)
CRANK = Revolute("crank", GROUND, "A", (0.0, 0.1, -0.1), (0.3, -0.2, 2.0))

# both sets chosen so that the joints they go with stay far from singular positions: the largest
# singular value is at most 30 times the smallest
WITH_OTHER_RODS = {
    "inline",
    "orientation_lock",
    "parallel_axes",
    "perpendicular_axes",
    "revolute_spherical",
}
ON_AXIS = {"point": HINGE, "axis": (0.4, 1.0, -0.7)}
ENDS = {"points": (HINGE, (0.35, 0.0, 0.4))}
# the axes of a cross, off the right angle by what rounding of a table may be
ROUNDED = {"axes": ((0.5, 1.0, 0.2), (1.0, -0.49, 0.0))}
TYPES = sorted(
    name for name, kind in Joint.registry.items() if kind.__module__.startswith(library.__name__)
)
TOO_LOOSE = {
    "distance",
    "in_plane",
    "inline",
    "parallel_axes",
    "perpendicular_axes",
    "revolute_spherical",
}
"""Types of fewer than three rows, which carry no body."""


def on_crank(kind, first, second):
    """Body B on the crank A by one joint of that kind, its freedoms taken by rods to the ground."""
    assert kind in GEOMETRY, f"joint type {kind!r} is not tested: add it to GEOMETRY here"
    joint = Joint.registry[kind]("tested", first, second, **GEOMETRY[kind])
    rods = [
        Distance(f"rod {k}", GROUND, "B", ends)
        for k, ends in enumerate(
            (OTHER_RODS if kind in WITH_OTHER_RODS else RODS)[: 6 - joint.rows]
        )
    ]
    points = [
        Point(name, "B", P)
        for name, P in (("P", (0.4, 0.1, 0.3)), ("Q", (0.4, -0.3, 0.5)), ("S", (0.7, 0.1, 0.5)))
    ]
    return Mechanism(
        kind,
        [Body("A", (0.1, 0.2, 0.3)), Body("B", (0.4, 0.0, 0.4), (0.5, 0.5, -0.5, 0.5))],
        [CRANK, joint, *rods],
        points,
        [JointAngle("turn", "crank")],
    )


TURN, RATE = np.linspace(-0.4, 0.4, 7), 2.0
# Both engines solve to round-off: 1e-16 of positions of 1 m and accelerations of 10 m/s^2, times a
# conditioning of 41.
ROUND_OFF = (1e-13, 1e-12, 1e-11)


@cache
def native_motion(kind, first, second):
    """The motion of `on_crank` by the native engine, computed once for all simulators."""
    found = solve(on_crank(kind, first, second), "turn", TURN, rate=RATE)
    assert found.solved.all()
    return found


def assert_moves_natively(found, kind, bodies, tolerances=ROUND_OFF):
    """The points of `on_crank` move, and as by the native engine [m, m/s, m/s^2]."""
    native = native_motion(kind, *bodies)
    for name, motion in found.points.items():
        assert np.ptp(motion.position, axis=0).max() > 0.05  # something moves
        for quantity, atol in zip(
            ("position", "velocity", "acceleration"), tolerances, strict=True
        ):
            np.testing.assert_allclose(
                getattr(motion, quantity), getattr(native.points[name], quantity), rtol=0, atol=atol
            )
