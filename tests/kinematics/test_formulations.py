"""One mechanism, several row styles: the same motion.

Whichever way the rows are written, the solutions agree to round-off.
"""

from dataclasses import replace

import kincheck.cases
import numpy as np
import pytest
from kincheck.core.case.joint_probe import probes
from kincheck.core.kinematics import NATIVE, styles
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.kinematics.formulation.acceptance_criteria import (
    Block,
    Candidate,
    Limits,
    margins,
)

OTHERS = styles()[1:]
ORDERS = ("position", "velocity", "acceleration")


# The same motion


def deviation(found, reference, order):
    """The largest over all points and samples."""
    assert found.solved.all(), found.message
    return max(
        np.abs(getattr(found.points[name], order) - getattr(reference.points[name], order)).max()
        for name in found.points
    )


def run(case, style):
    """The points of a case by the equations of a style."""
    request = Request(tuple(case.sweep.path.motions), case.points, style=style)
    return sweep(compile_model(case.mechanism, request), case.sweep.path, 1e-12)


# The platforms, of 13 bodies, take ten times as long to trace in all styles as any other case, and
# their joints occur elsewhere.
MOST_BODIES = 7
ALL = [*map(kincheck.cases.load, kincheck.cases.names()), *probes()]
CASES = {case.name: case for case in ALL if len(case.mechanism.moving) <= MOST_BODIES}
# The probes have the joints of all types one by one: they move in all styles. The library's cases
# combine them, which makes a difference to relative coordinates alone: rows of the other styles are
# written joint by joint.
PROBES = {case.name for case in probes()}
STYLES = {name: OTHERS if name in PROBES else OTHERS[-1:] for name in CASES}


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", CASES)
def test_case_motion_in_row_styles(name):
    reference = run(CASES[name], NATIVE)
    # a hundred roundings, divided by the smallest singular value once for positions, and once more
    # for each derivative
    sigma = reference.details["smallest_singular_value"]
    for style in STYLES[name]:
        found = run(CASES[name], style)
        for k, order in enumerate(ORDERS):
            size = max(
                1.0, *(np.abs(getattr(motion, order)).max() for motion in reference.points.values())
            )
            assert deviation(found, reference, order) < 1e-14 * size / sigma ** (k + 1), (
                style,
                order,
            )


# Ground rows: the paper counts fixed bodies too; eliminating them changes nothing


# Acceptance: each criterion fails alone

BLOCKS = [Block(0.5, 0.5, 0.1)]
POSE = Candidate(1.0, 1e-15, 1e-15, 1.0, 0.0, 0.1, 0.1, [0.1], 0.5, 0.5, 1.0, 0.0, BLOCKS)
SPOILT = [
    ("converged", {"done": 0.0}),
    ("closed", {"closure": 2e-12}),
    ("consistent", {"leftover": 2e-12}),
    ("on the branch", {"branch": -0.1}),
    ("continued", {"gap": 0.011}),
    ("near", {"reach": 0.6}),
    ("not turned round", {"turns": [0.1, -2.1]}),
    ("as regular", {"blocks": [Block(0.5, 0.03, 0.1)]}),
    ("as regular", {"blocks": [*BLOCKS, Block(0.03, 0.5, 0.1)]}),
    ("on this side", {"reversal": -1.0}),
    ("regular between", {"moved": 0.3, "blocks": [Block(0.5, 0.5, 1.0)]}),
    ("certain", {"sigma": 1e-7}),
    ("not turned by rounding", {"sigma": 2e-6, "before": 1e-6}),
]


@pytest.mark.parametrize(("criterion", "changes"), SPOILT, ids=str)
def test_margins_of_spoilt_pose(criterion, changes):
    def failed(pose, crossing):
        found = margins(pose, Limits(1e-12, 1e-12, crossing))
        return {name for name, margin in found.items() if margin <= 0.0}

    assert failed(POSE, 0.0) == set()
    assert failed(replace(POSE, **changes), 0.0) == {criterion}
    passed = criterion in ("as regular", "on this side", "regular between")
    assert failed(replace(POSE, **changes), 100.0) == (set() if passed else {criterion})
