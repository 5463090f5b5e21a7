"""Reduction of bad cases to small ones."""

import numpy as np
import pytest
from kincheck.core import solve
from kincheck.core.errors import KincheckError
from kincheck.core.studies.stress.families.base import as_case
from kincheck.core.studies.stress.families.linkages import any_plane, crank_rocker, four_bar
from kincheck.core.studies.stress.reduction import fewer_samples, reduced, rounded
from kincheck.core.trajectory import PointMotion


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(8)
    mechanism, _ = four_bar(any_plane(rng), *crank_rocker(rng), "rod")
    return as_case(mechanism, "turn", np.linspace(-1.0, 1.0, 5))


def test_a_bad_case_is_made_small():
    """Bad is whatever has a crank longer than 0.1 m that is turned by more than 0.3 rad."""
    rng = np.random.default_rng(8)
    mechanism, _ = four_bar(any_plane(rng), *crank_rocker(rng), "revolutes")
    case = as_case(mechanism, "turn", np.linspace(-1.0, 1.0, 41))

    def bad(case):
        pivot = case.mechanism.joint("pivot").point
        pins = [
            joint
            for joint in case.mechanism.joints
            if "crank" in joint.bodies and joint.name != "pivot"
        ]
        long = any(
            np.linalg.norm(np.subtract(getattr(pin, "point", pivot), pivot)) > 0.1 for pin in pins
        )
        return long and np.abs(case.sweep.values).max() > 0.3

    few = fewer_samples(case, 3, bad)
    assert len(few.sweep.values) == 1
    small, words = reduced(few, bad)
    assert bad(small)
    assert words
    assert len(small.mechanism.points) == 1
    assert len(str(small.mechanism.joint("pivot").point[0])) < 8


def test_unjudgeable_case_is_not_reduced(case):
    def bad(other):
        if other is not case:
            raise KincheckError("cannot be judged")
        return True

    assert fewer_samples(case, 0, bad) is case
    assert reduced(case, bad) == (case, [])


def test_rounding_keeps_names_and_shapes(case):
    short = rounded(case, 2)
    assert short is not None
    assert [j.name for j in short.mechanism.joints] == [j.name for j in case.mechanism.joints]
    assert short.mechanism != case.mechanism
    assert isinstance(solve(short.mechanism, "turn", [0.1]).points["C"], PointMotion)
