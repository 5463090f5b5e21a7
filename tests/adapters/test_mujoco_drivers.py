"""Drivers of the MuJoCo adapter: points, slides, and what holds."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.joints import (
    Translational,
)
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, PointCoordinate
from numpy.polynomial import Chebyshev

from ..support.mujoco_cases import (
    B0,
    C0,
    CRANK_PIN,
    RATE,
    RSSR,
    TURN,
    assert_motion,
    case,
    periodic,
    rocker,
    solve,
)

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


def test_drivers_without_a_sweep_hold():
    """The RSSR's rocker on a slide that is held."""
    slide = Translational("slide", "carriage", "ground", (0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    drivers = [JointAngle("crank", "a"), JointDisplacement("hold", "slide")]
    held = case(
        [RSSR[0], replace(RSSR[1], j="carriage"), RSSR[2], slide],
        {"C": ("rocker", C0)},
        drivers,
        TURN,
        RATE,
    )
    assert_motion(solve(held).points["C"], *periodic(rocker(CRANK_PIN, 0.76)))


def test_point_driven_along_an_oblique_direction():
    """r cos(t - t_d) = c: a pendulum of radius r pulled along the direction t_d in its plane."""
    r, t_d, c, rate = 0.5, math.atan2(4.0, 3.0), np.linspace(-0.2, 0.1, 13), 2.0
    pendulum = [replace(RSSR[0], j="arm")]
    pull = [PointCoordinate("pull", "tip", (3.0, 4.0, 0.0))]
    motion = solve(case(pendulum, {"tip": ("arm", (r, 0.0, 0.0))}, pull, c, rate)).points["tip"]
    s = -np.arccos((r * math.cos(t_d) + c) / r)[:, None]
    e, n = (
        np.cos(s + t_d + k) * [1, 0, 0] + np.sin(s + t_d + k) * [0, 1, 0]
        for k in (0.0, math.pi / 2)
    )
    s_t = -rate / (r * np.sin(s))
    assert_motion(
        motion, r * e, r * s_t * n, -r * s_t**2 * (n / np.tan(s) + e), atol=(1e-14, 1e-13, 1e-12)
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_displacement_of_a_slider(sign):
    """A slider, named second or first of its joint, pushes the rocker of the RSSR by the rod."""
    h, values, rate = np.array([2.0, 1.0, -2.0]) / 3.0, np.linspace(-0.05, 0.05, 9), 0.5
    guide = Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), tuple(3.0 * h))
    joints = [guide if sign > 0 else guide.reversed(), RSSR[1], replace(RSSR[2], i="slider")]
    motion = solve(
        case(joints, {"C": ("rocker", C0)}, [JointDisplacement("push", "guide")], values, rate)
    ).points["C"]
    # interpolated on twice the range: at its ends the derivatives are poor
    fit = [
        Chebyshev.interpolate(
            lambda s, k=k: rocker(B0 + sign * np.outer(s, h), 0.76)[:, k], 40, [-0.1, 0.1]
        )
        for k in range(3)
    ]
    assert_motion(
        motion, *(rate**n * np.column_stack([x.deriv(n)(values) for x in fit]) for n in range(3))
    )
