"""Couplers in every engine, and linear ones as equations of MuJoCo."""

from dataclasses import replace

import kincheck
import numpy as np
import pytest
from kincheck import (
    Cylindrical,
    Gear,
    JointAngle,
    JointDisplacement,
    LinearCoupler,
    MechanismError,
    RackPinion,
    Revolute,
    Translational,
)
from kincheck.core.case.io.case_file import case_text, load_case

from ..support.engine_motion import (
    IN_TREE_OR_CUT,
    SIMULATORS,
    assert_as_native,
    assert_motion,
    installed,
    mechanism_of,
)
from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X

CASE, BAD_ARGUMENTS = examples(__file__, "case", "bad_arguments")

TURNS = np.linspace(-7.0, 7.0, 29)


@IN_TREE_OR_CUT
def test_gear_train_with_rack_moves_exactly(engine, closing):
    """A bearing that names its shaft first has the other sign of rotation. The last wheel slides
    too, as driven.
    """
    cut = ["b", "c", "rail"] if closing else []
    joints = [
        Revolute("a", "ground", "A", ORIGIN, (0.0, 0.0, 2.0)),
        Revolute("b", "B", "ground", (0.4, 0.0, 0.0), (0.0, 0.0, 2.0)),
        Cylindrical("c", "ground", "C", X, (0.0, 0.0, 2.0)),
        Translational("rail", "ground", "R", (1.0, 0.2, 0.0), X),
    ]
    ends = {"A": (0.1, 0.0, 0.0), "B": (0.6, 0.0, 0.0), "C": (1.0, 0.1, 0.0), "R": (1.0, 0.2, 0.0)}
    couplers = [
        Gear("ab", ("b", "a"), 0.5),
        Gear("bc", ("b", "c"), 3.0),
        RackPinion("cr", ("c", "rail"), -0.2),
    ]
    drivers = [JointAngle("turn", "a"), JointDisplacement("shift", "c")]
    points = {name: (name, place) for name, place in ends.items()}
    mechanism = mechanism_of(joints, points, drivers, couplers)
    found = assert_as_native(engine, mechanism, TURNS, cut=cut)
    # b = a / 2 turns B by -a / 2; c = b / 3
    half, sixth, none = TURNS / 2, TURNS / 6, 0 * TURNS
    expected = {
        "B": (0.4 + 0.2 * np.cos(half), -0.2 * np.sin(half), none),
        "C": (1.0 - 0.1 * np.sin(sixth), 0.1 * np.cos(sixth), none),
        "R": (1.0 - 0.2 * sixth, 0.2 + none, none),
    }
    for name, wanted in expected.items():
        assert_motion(found.points[name], np.stack(wanted, axis=1))
    if engine == "mujoco":
        assert len(found.details["relations"]) == 3
    assert_as_native(engine, replace(mechanism, drivers=drivers[::-1]), TURNS, cut=cut)


# Couplers of three joints in every simulator, against the sum that they keep at zero


# q1 + 0.05/mm q2 - 2 q3 = 0 with q1 = t, q2 = 10 mm sin(pi t): q3 = t / 2 + 0.25 sin(pi t), whose
# couple is -1/2 of that on the first joint; the arm of 2 kg at 0.3 m weighs on the third.


def differential(folder):
    t = np.linspace(0.0, 1.0, 5)
    turn = 0.5 * t + 0.25 * np.sin(np.pi * t)
    rate = 0.5 + 0.25 * np.pi * np.cos(np.pi * t)
    curvature = -0.25 * np.pi**2 * np.sin(np.pi * t)
    # a torque on the cage of I a + m g x [N mm], of which the first joint has half
    effort = 500.0 * (2.0 * 0.3**2 * curvature + 2.0 * 10.0 * 0.3 * np.cos(turn))
    rows = np.stack([t, turn, rate, curvature, effort], axis=1)
    text = CASE.replace("ROWS", ",\n".join(str(row) for row in rows.tolist()))
    (file := folder / "differential.toml").write_text(text)
    return load_case(file)


@pytest.mark.by_day(2)
@pytest.mark.parametrize("engine", ["native", *SIMULATORS])
def test_linear_coupler_of_three_joints_passes(engine, tmp_path):
    case = differential(tmp_path)
    if engine != "native":
        installed(engine)
    (found,) = kincheck.run(case, engine).records
    assert found.outcome.value == "pass", found


def test_linear_coupler_in_written_files(tmp_path):
    compare = pytest.importorskip("kincheck.core.extensions.same.verdict").compare
    undriven = pytest.importorskip("kincheck.core.extensions.same.undriven")
    written = pytest.importorskip("kincheck.core.extensions.exports.model_writer").written
    writer_of = pytest.importorskip("kincheck.core.extensions.exports.command").writer_of
    case = differential(tmp_path)
    (file := tmp_path / "again.toml").write_text(case_text(case))
    assert load_case(file).mechanism.couplers == case.mechanism.couplers
    for form in ("mjcf", "urdf"):
        for suffix, text in written(case, writer_of(form), None).items():
            (tmp_path / f"written_{form}{suffix}").write_text(text)
    for name in ("written_mjcf.xml", "written_urdf.urdf"):
        same = compare(
            undriven.undriven_case(case, "case"), undriven.undriven_file(tmp_path / name), {}
        )
        assert same.verdict == "same", same.reason
        assert same.largest < 1e-14


@pytest.mark.parametrize(
    ("given", "said"),
    BAD_ARGUMENTS,
)
def test_linear_coupler_bad_arguments_are_refused(given, said):
    with pytest.raises(MechanismError, match=said):
        LinearCoupler("sum", *given)
