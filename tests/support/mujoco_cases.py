"""Cases solved by the MuJoCo adapter."""

import math
from dataclasses import replace

import numpy as np
from kincheck.adapters.mujoco import mujoco as adapter
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import (
    Distance,
    Fixed,
    Revolute,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle

TOL = 1e-12
RATE = 3.0
# One crank turn, the last sample left out: periodic, so that differentiation by FFT is exact to
# round-off.
TURN = np.linspace(-math.pi, math.pi, 100, endpoint=False)


def case(joints, points, drivers, values, rate=1.0, design=0.0, fixed=()):
    """Bodies are those of the joints; points: name -> (body, position); the first driver is
    swept.
    """
    bodies = dict.fromkeys(body for joint in joints for body in joint.bodies if body != "ground")
    places = [Point(name, *place) for name, place in points.items()]
    mechanism = Mechanism(
        "test", [Body(name, fixed=name in fixed) for name in bodies], joints, places, drivers
    )
    outputs = tuple(Output(name, name, (1.0, 0.0, 0.0), False, 1e-9, 0.0, "") for name in points)
    return Case(
        "test",
        "test",
        Truth.CONSENSUS_ONLY,
        mechanism,
        Sweep(drivers[0].name, np.array(values), rate, design),
        outputs,
    )


def solve(case, complete=True):
    """The trajectory; complete: every sample is there."""
    engine = adapter.MuJoCo()
    assert engine.unsupported(case) is None
    found = engine.solve(engine.build(case), case, TOL)
    assert found.solved.all() or not complete, found.message
    assert found.residual <= TOL or not found.solved.any()
    return found


def assert_motion(motion, *expected, atol=(1e-13, 1e-11, 1e-9)):
    """Position, velocity and acceleration as expected. The last two are usually known by numerical
    differentiation only.
    """
    for found, wanted, error in zip(
        (motion.position, motion.velocity, motion.acceleration), expected, atol, strict=True
    ):
        np.testing.assert_allclose(found, wanted, rtol=0, atol=error)


def periodic(x, rate=RATE):
    """Samples over a crank turn with their first and second derivative by time."""
    k = 1j * np.fft.fftfreq(len(x), 1.0 / len(x))[:, None]
    return x, *(np.fft.ifft((rate * k) ** n * np.fft.fft(x, axis=0), axis=0).real for n in (1, 2))


def rocker(B, length):
    """C = D + 0.4 (0, cos f, sin f) at the distance of a rod from B: p cos f + q sin f = k."""
    d = np.array([0.6, 0.3, 0.1]) - B
    p, q, k = 0.8 * d[:, 1], 0.8 * d[:, 2], length**2 - 0.4**2 - (d * d).sum(axis=1)
    f = np.arctan2(q, p) + np.arccos(k / np.hypot(p, q))
    return np.stack([0.6 + 0 * f, 0.3 + 0.4 * np.cos(f), 0.1 + 0.4 * np.sin(f)], axis=1)


CRANK_PIN = 0.1 * np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
B0 = np.array([[0.1, 0.0, 0.0]])
C0 = tuple(rocker(B0, 0.76)[0])
RSSR = (
    Revolute("a", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Revolute("c", "rocker", "ground", (0.6, 0.3, 0.1), (1.0, 0.0, 0.0)),
    Distance("rod", "crank", "rocker", (tuple(B0[0]), C0)),
)


def change(case, *joints, **others):
    """The case with joints added in front, instead of those of the same names."""
    kept = [
        each for each in case.mechanism.joints if each.name not in {joint.name for joint in joints}
    ]
    return replace(case, mechanism=replace(case.mechanism, joints=(*joints, *kept), **others))


def slider_crank():
    """The spatial slider-crank of the IFToMM benchmarks, with a peg on the rod."""
    joints = [
        Revolute("pivot", "ground", "crank", (0.0, 0.1, 0.12), (1.0, 0.0, 0.0)),
        Spherical("pin", "crank", "rod", (0.0, 0.1, 0.2)),
        Universal(
            "gudgeon", "rod", "slider", (0.2, 0.0, 0.0), ((0.48, 0.6, -0.64), (0.0, 0.64, 0.6))
        ),
        Translational("guide", "ground", "slider", (0.2, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Fixed("glue", "rod", "peg"),
    ]
    points = {"slider": ("slider", (0.2, 0.0, 0.0)), "peg": ("peg", (0.1, 0.05, 0.2))}
    return case(joints, points, [JointAngle("crank", "pivot")], TURN, RATE)


# The slider's x = sqrt(l^2 - y^2 - z^2) for the crank pin's y, z.
SLIDER = np.outer(
    np.sqrt(0.09 - (0.1 - 0.08 * np.sin(TURN)) ** 2 - (0.12 + 0.08 * np.cos(TURN)) ** 2),
    [1.0, 0.0, 0.0],
)
