"""Exudyn's differences of rates, and poses that it refuses."""

import numpy as np
import pytest
from kincheck import Distance, PointCoordinate, Spherical, Translational
from kincheck.adapters.exudyn.exudyn import Exudyn

from ..support.engine_motion import TOL, mechanism_of, motion_case, solved
from ..support.mechanisms import ORIGIN, X, Y

pytest.importorskip("exudyn")


def test_exudyn_accelerations_of_short_rod():
    """A slide x drives a slide y by a rod of 4 mm: y y = L L - x x, in a mechanism of one metre.

    The rod turns by a quarter while the slides go 3 mm, so differences over 1 mm are off by 1e-6.
    """
    length, x = 0.004, np.linspace(0.0, 0.0035, 8)
    joints = [
        Translational("a", "ground", "first", ORIGIN, X),
        Translational("b", "ground", "second", X, Y),
        Distance("rod", "first", "second", (ORIGIN, (0.0, length, 0.0))),
    ]
    driver = PointCoordinate("x", "start", X)
    points = {"start": ("first", ORIGIN), "end": ("second", (0.0, length, 0.0))}
    end = solved("exudyn", mechanism_of(joints, points, [driver]), x).points["end"]
    y = np.sqrt(length**2 - x**2)
    expected = -1.0 / y - x**2 / y**3
    assert np.abs(end.acceleration[:, 1] / expected - 1.0).max() <= 1e-10


def test_exudyn_refused_pose_gives_nan():
    """A diverged iteration gives a rod no length in Exudyn's arithmetic, which then raises."""
    joints = [
        Spherical("a", "ground", "first", ORIGIN),
        Spherical("b", "ground", "second", X),
        Distance("rod", "first", "second", ((0.0, 0.5, 0.0), (1.0, 0.5, 0.0))),
    ]
    driver = PointCoordinate("x", "tip", X)
    mechanism = mechanism_of(joints, {"tip": ("first", (0.0, 0.5, 0.0))}, [driver])
    model = Exudyn().build(motion_case(mechanism, [0.0]))
    model.move(np.full(model.unknowns, 1e25))
    assert np.isnan(model.residual(np.zeros(1))).all()
    model.reset()
    assert np.abs(model.residual(np.zeros(1))).max() < TOL
