"""Two ways from the design to the path: which one is taken, and what is said of the other."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.kinematics.compiled.routes import start_of
from kincheck.core.mechanism.motions import Path, Ramp, Sine

from .test_start import TIMES, WAYS, arm, by_style, case_of, circling, phases_of, turned_arm

FAR = 1.0
"""By what the arm at time zero is ahead of its design [rad]."""


@pytest.mark.parametrize("solved", WAYS)
def test_ambiguous_start_is_noted(solved):
    mechanism = arm(60.0)
    motions = circling(mechanism, [phase + FAR for phase in phases_of(60.0)])
    found = solved(case_of(mechanism, motions))
    assert found.solved.all(), found.message
    said = "; ".join(found.details["notes"])
    assert "AMBIGUOUS: by way of the first sample the results differ by up to 0.62" in said
    assert "all drivers go straight from it to time zero" in said
    # what is found at a time does not depend on where the sweep begins
    shorter = solved(case_of(mechanism, motions, TIMES[4::4]))
    assert shorter.points["r"].position == pytest.approx(
        found.points["r"].position[4::4], abs=1e-12
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_start_with_two_design_samples(sign):
    """The nearer one to time zero is the start, before it or after."""
    mechanism = turned_arm()
    waves = {name: Sine(0.5, 0.5, -0.5 * math.pi * sign) for name in "uv"}
    times = sign * np.array([0.5, 0.8, 1.5])
    start = start_of(mechanism, Path(waves, np.sort(times)))
    assert (start.time, start.ambiguous) == (times[0], True)
    assert start.other.time == times[2]


def test_equal_starts_are_not_ambiguous():
    mechanism = turned_arm()
    found = by_style("native")(case_of(mechanism, {"u": Sine(2.0, 1.0, 1.0), "v": Ramp(0.3)}))
    (note,) = found.details["notes"]
    assert "go straight from it to time zero (u = 1.68" in note


@pytest.mark.parametrize("solved", WAYS)
def test_start_with_one_reachable_way(solved):
    """Straight to time zero, the tip would go through the hinge, where links of different lengths
    cannot bring it.
    """
    mechanism = arm(0.0)
    short = replace(mechanism.joints[1], point=(0.55, math.sqrt(0.6**2 - 0.55**2), 0.0))
    mechanism = replace(mechanism, joints=[mechanism.joints[0], short, mechanism.joints[2]])
    motions = circling(mechanism, [1.5 * math.pi, math.pi])
    found = solved(case_of(mechanism, motions, np.linspace(-0.3, 0.1, 9)))
    assert found.solved.all(), found.message
    assert "no sample can be reached by way of time zero" in "; ".join(found.details["notes"])
    assert found.details["start"]["time"] == -0.3
