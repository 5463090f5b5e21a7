"""Chains of hinges that move though they have too few freedoms, with few digits, in every format:
the rows that stay are those of the joints, against least squares over the closure of the loop.

For more of each:

    KINCHECK_LOOPS=9 pytest -m "" tests/case/test_overconstrained_loops.py
"""

import os
from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import KincheckError, MechanismError
from kincheck.core.extensions.closing.reduction import reduce_rows
from kincheck.core.kinematics import NativeSolver, largest_residual
from scipy.spatial.transform import Rotation

from ...support.cut_models import CHAINS, closed_chain, written
from ...support.overconstrained_loops import FAMILIES, random_loop

SEEDS = range(1, 1 + int(os.environ.get("KINCHECK_LOOPS", "1")))
DIGITS = (4, 5, 6, 8, 12)
ANGLES = np.linspace(0.0, 0.6, 7)
POINT = np.array([0.1, 0.2, 0.3])
SINGLE = 1e-6
"""Digits of the frames of joints in USD."""


def case_of(form, loop, digits, folder, seed):
    """The case of a loop in a format, its first hinge driven, and the tolerance of its digits."""
    rng, tolerance = np.random.default_rng([seed, digits]), 10.0 ** (1 - digits)
    while True:  # until the first hinge is none of two points
        file, said = written(form, closed_chain(loop), folder, rng, digits)
        if form != "MJCF" or "j0" in said:
            break
    closure = tolerance if digits < 6 or form == "case" else None
    if form == "USD":
        tolerance = max(tolerance, SINGLE)
        closure = tolerance
    drive = {"Adams": "JOINT_0", "case": ""}.get(form, "j0")
    options = Supplied(closure=closure)
    if drive:
        options = replace(options, drive=(f"{drive}:0:0.6:7",), hold_rest=form != "Adams")
    return load(file, options), tolerance


def tracks(case, loop):
    """Motion of a point of each link; links of datasets have numbers."""
    names = tuple(body.name for body in case.mechanism.moving)
    solver = NativeSolver(order=0).prepare(case.mechanism, case.sweep.path, bodies=names)
    found, motion = {}, solver(1e-12)
    for k in range(1, len(loop.points)):
        body = next(x for x in case.mechanism.moving if x.name in (f"l{k}", f"PART_{k + 1}"))
        turns = Rotation.from_quat(
            np.nan_to_num(motion.bodies[body.name].p, nan=0.5), scalar_first=True
        )
        start = Rotation.from_quat(body.euler_parameters, scalar_first=True)
        arm = (turns * start.inv()).apply(POINT - np.array(body.origin))
        found[k] = motion.bodies[body.name].r + arm
    return found, motion.bodies


def require_motion_of_least_squares(form, family, digits, folder, seed):
    loop = random_loop(family, seed)
    angles, _ = loop.followed(ANGLES)
    case, tolerance = case_of(form, loop, digits, folder, seed)
    found, bodies = tracks(case, loop)
    for k, track in found.items():
        links = [loop.links(each)[k - 1] for each in angles]
        truth = np.array([R @ POINT + r for R, r in links])
        assert np.abs(track - truth).max() < 30.0 * tolerance, (form, family, digits, k)
    joints = [each.joint for each in case.mechanism.reduced]
    assert largest_residual(case.mechanism, joints, bodies) <= tolerance


@pytest.mark.by_day(2)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("digits", [4, 12])
def test_few_digits_move_like_least_squares(family, digits, tmp_path):
    for seed in SEEDS:
        require_motion_of_least_squares("case", family, digits, tmp_path, seed)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("form", [form for form in CHAINS if form != "case"])
def test_few_digits_in_formats(form, tmp_path):
    for family, digits in (("factorized", 5), ("plane", 6), ("bennett", 6)):
        require_motion_of_least_squares(form, family, digits, tmp_path, 1)


@pytest.mark.nightly
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("form", CHAINS)
@pytest.mark.parametrize("digits", DIGITS)
def test_all_digits_in_all_formats(form, family, digits, tmp_path):
    for seed in SEEDS:
        require_motion_of_least_squares(form, family, digits, tmp_path, seed)


@pytest.mark.parametrize("family", ["factorized", "trihedral", "line"])
def test_six_hinges_in_second_engine(family, tmp_path):
    pytest.importorskip("mujoco")
    case, tolerance = case_of("case", random_loop(family, 1), 6, tmp_path, 1)
    tips = [
        engine.solve(engine.build(case), case, 1e-12).points["tip"].position
        for engine in map(adapters.engine, ("native", "mujoco"))
    ]
    assert np.ptp(tips[0]) > 1e-3
    assert np.abs(tips[0] - tips[1]).max() < tolerance


@pytest.mark.by_day(3)
@pytest.mark.parametrize("family", FAMILIES)
def test_kept_rows_hold_in_whole_joint(family, tmp_path):
    """What stays of a hinge is true of the exact linkage at any pose, and not only at the start."""
    loop = random_loop(family, 2)
    case, _ = case_of("case", loop, 12, tmp_path, 2)
    found, bodies = tracks(case, loop)
    assert found
    for name in ("j1", "j5", "j3"):
        carrying = [joint.name for joint in case.mechanism.joints if joint.name != name]
        less = reduce_rows(case.mechanism, 1e-6, carrying).mechanism
        if less.reduced:
            assert largest_residual(less, less.joints, bodies) < 1e-9


def test_residual_beyond_tolerance_is_refused(tmp_path):
    """A regular chain of six hinges, one of which is moved by a hundredth, does not move."""
    loop = random_loop("factorized", 1)
    points = loop.points + 0.02 * np.eye(6, 3)
    with pytest.raises((MechanismError, KincheckError), match="off by up to"):
        case_of("case", replace(loop, points=points), 4, tmp_path, 1)


def test_tolerance_serves_last_digits(tmp_path):
    """Rows that contradict by 1e-9 are left out by --closure 1e-6."""
    loop = random_loop("factorized", 3)
    file, _ = written("case", closed_chain(loop), tmp_path, np.random.default_rng(1), 9)
    (note,) = load(file, Supplied(closure=1e-6)).assembly
    assert "--closure" in note
