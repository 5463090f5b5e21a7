"""MuJoCo's solution beside that of the native solver."""

from contextlib import nullcontext
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from kincheck.adapters.shared import tree_plan
from kincheck.core import solve as solve_natively
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.mechanism.mechanism import SpanningTree, spanning_tree

from .mujoco_cases import assert_motion, solve

# Position, velocity and acceleration, m and s: round-off, amplified at most a thousandfold by the
# mechanisms at these speeds.
TOLERANCES = (1e-13, 1e-12, 1e-11)


def solved(mechanism, driver, values, rate=1.0, cut=()):
    """MuJoCo's solution, with joints to be cut: they close loops, and their bodies hang on others,
    or are free.
    """
    outputs = tuple(
        Output(point.name, point.name, (1.0, 0.0, 0.0), False, 0.0, 0.0, "")
        for point in mechanism.points
    )
    sweep = Sweep(driver, np.array(values), rate)
    with cutting(*cut) if cut else nullcontext():
        return solve(Case("test", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs))


def assert_agrees(mechanism, driver, values, rate=1.0, cut=()):
    """The motions of all points are those of the native solver; returned is MuJoCo's solution."""
    found = solved(mechanism, driver, values, rate, cut)
    expected = solve_natively(mechanism, driver, values, rate=rate)
    assert expected.solved.all()
    for name, motion in expected.points.items():
        assert_motion(
            found.points[name],
            motion.position,
            motion.velocity,
            motion.acceleration,
            atol=TOLERANCES,
        )
    return found


def cutting(*names):
    """MuJoCo's tree without these joints; the native engine, whose models are kept, has none."""

    def tree(mechanism):
        kept = [each for each in mechanism.joints if each.name not in names]
        rest = spanning_tree(replace(mechanism, joints=kept, drivers=(), couplers=()))
        return SpanningTree(rest.branches, (*rest.cut, *map(mechanism.joint, names)))

    return mock.patch.object(tree_plan, "spanning_tree", tree)


# Coordinates of joints: driven, coupled, over several turns


TURNS = np.linspace(-7.0, 7.0, 29)
CUTS = pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])
AXIS, TIP = (1.0, 2.0, -2.0), np.array([0.3, -0.2, 0.4])
