"""Conditioning of a motion, at and beside poses whose rows depend on each other."""

import numpy as np
from kincheck import Ramp, cases
from kincheck.core.extensions.explain.conditioning import conditioning
from kincheck.core.mechanism.motions import Path

from ...support.mechanisms import BRANCH, chain


def loop():
    return cases.load("bennett").mechanism


def test_conditioning_orientation_over_bifurcation():
    turn = np.linspace(0.0, 3.0, 31)
    found = conditioning(chain(1), Path({"turn": Ramp(1.0)}, turn), turn, ["end"], {}, 31, 1e-12)
    assert [pose.orientation for pose in found.poses] == [
        1.0 if value < BRANCH else -1.0 for value in turn
    ]


def test_conditioning_at_dependent_rows():
    turn = np.linspace(0.0, 2.0 * np.pi, 41)
    found = conditioning(loop(), Path({"turn": Ramp(1.0)}, turn), turn, ["tracer"], {}, 41, 1e-12)
    assert [pose.orientation for pose in found.poses] == [1.0] * 41
    assert min(pose.smallest for pose in found.poses) > 0.03
    assert len({tuple(pose.owners) for pose in found.poses}) > 1
