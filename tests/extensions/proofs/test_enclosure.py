"""Proofs in ball arithmetic: what is proved is true, and what is not true, or singular, is not
proved. Also exact numbers and derivatives of tapes, of which enclosures are made.
"""

import csv
import math
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from pathlib import Path

import kincheck.cases
import numpy as np
import pytest
from kincheck import (
    Body,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Ramp,
    Revolute,
    SolveError,
    solve,
)
from kincheck.core.algebra import root
from kincheck.core.case.joint_probe import probes
from kincheck.core.extensions.proofs import krawczyk
from kincheck.core.extensions.proofs.ball_executor import UndecidedError, evaluate, precision
from kincheck.core.extensions.proofs.exact import (
    Exact,
    as_decimal,
    as_double,
    equations,
    exact_mechanism,
)
from kincheck.core.extensions.proofs.krawczyk import Enclosure, UnprovedError
from kincheck.core.extensions.proofs.proofs import _states, prove
from kincheck.core.kinematics import Cartesian, constraints
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.structure.degrees_of_freedom import select_rows
from kincheck.core.mechanism.motions import Path as Way
from kincheck.core.program import Tape, absolute, cos, program, sin, where_larger
from kincheck.core.program.tape import jacobian

from ...support.mechanisms import CRANK, ORIGIN, ROD, X, Y, Z, four_bar, slider_crank

flint = pytest.importorskip("flint")
BITS = 200


def proved(mechanism, driver, values, reading=as_double, exact=None, tol=1e-12):
    """The proofs of a sweep at rate one."""
    values = np.asarray(values, dtype=float)
    drives = {
        driver: [(x, Fraction(1), Fraction(0)) for x in exact or map(Fraction, values.tolist())]
    }
    points = [point.name for point in mechanism.points]
    return prove(mechanism, Way({driver: Ramp(1.0)}, values), points, drives, reading, BITS, tol)


# What is proved is true


def test_enclosure_holds_slider_crank_closed_form():
    angles = np.linspace(-2.5, 2.5, 7)
    found = proved(slider_crank(), "turn", angles)
    with precision(BITS):
        for angle, each in zip(angles.tolist(), found.samples, strict=True):
            theta = flint.arb_series([flint.arb(angle), 1], prec=3)
            height = theta.sin() * CRANK
            x = theta.cos() * CRANK + (ROD * ROD - height * height).sqrt()
            moved, velocity, acceleration = each.points["end"]
            for ball, truth in (
                (moved[0], x[0] - (CRANK + ROD)),
                (velocity[0], x[1]),
                (acceleration[0], 2 * x[2]),
            ):
                assert ball.overlaps(truth)
                assert ball.rad() < 1e-40
            assert all(x.contains(0) for x in moved[1:])


def test_enclosure_agrees_with_printed_strut_reference():
    """Two independent 40-digit solutions, printed to 17 digits, of the geometry as its decimals
    say.
    """
    case = kincheck.cases.load("mcpherson_strut")
    lines = [
        line
        for line in (Path(kincheck.cases.__file__).parent / "mcpherson_strut.csv")
        .read_text()
        .splitlines()
        if line[0] != "#"
    ]
    rows = [*csv.DictReader(lines)][::16]
    values = [float(row["stroke"]) for row in rows]
    found = proved(
        case.mechanism, "stroke", values, as_decimal, [Fraction(row["stroke"]) for row in rows]
    )
    with precision(BITS):
        for row, each in zip(rows, found.samples, strict=True):
            for name, axis in (("half_track_change", 1), ("wheelbase_change", 0)):
                for order, ending in enumerate(("", ".velocity", ".acceleration")):
                    printed = row[name + ending]
                    last = Fraction(1, 10 ** len(printed.partition(".")[2]))
                    off = abs(each.points["wheel_center"][order][axis] - flint.arb(printed))
                    assert off < flint.arb(flint.fmpq(last.numerator, last.denominator)) * 0.51, (
                        name,
                        ending,
                        row["stroke"],
                    )


PROVED = [case for case in probes() if case.name != "spline"]


def test_proof_of_spline_coupler_is_refused():
    (case,) = (case for case in probes() if case.name == "spline")
    with pytest.raises(SolveError, match="is a spline, and proofs know none"):
        proved(case.mechanism, case.sweep.driver, case.sweep.change[:1])


@pytest.mark.parametrize("case", PROVED, ids=lambda case: case.name)
def test_enclosure_of_every_joint_type(case):
    """Velocities and accelerations here come from the residuals alone; the native ones from rows,
    nu and gamma.
    """
    values = case.sweep.change[::20]
    found = proved(case.mechanism, case.sweep.driver, values)
    for name, native in found.native.points.items():
        origin = np.array(case.mechanism.point(name).position)
        for k, each in enumerate(found.samples):
            assert isinstance(each, Enclosure), each
            moved, velocity, acceleration = (
                [float(x) for x in vector] for vector in each.points[name]
            )
            assert np.abs(native.position[k] - origin - moved).max() < 1e-14
            assert np.abs(native.velocity[k] - velocity).max() < 1e-13
            assert np.abs(native.acceleration[k] - acceleration).max() < 1e-11


def test_enclosure_has_zero_redundant_rows():
    found = proved(four_bar(), "turn", [0.5, 1.0])
    assert len(found.redundant) == 3
    for each in found.samples:
        assert len(each.left_out) == 3
        assert all(x.contains(0) and x.rad() < 1e-40 for x in each.left_out)


def test_enclosure_measures_wrong_native_pose():
    """The pose of one mechanism, given as that of another whose rod is 1e-9 m longer."""
    right = proved(slider_crank(), "turn", [1.0]).samples[0].points["end"][0][0]
    longer, pose, drives = _setup(slider_crank(ROD + 1e-9), slider_crank(), 1.0)
    with precision(BITS):
        found = krawczyk.enclose(longer, pose, drives, BITS).points["end"][0][0]
    assert 0.5e-9 < found - right < 2e-9


def _setup(mechanism, native, angle):
    """The equations of a mechanism, and the state of another one at an angle of the driver."""
    driver = native.drivers[0].name
    motion = solve(native, driver, [angle], bodies=[body.name for body in native.moving])
    frame = frames(mechanism)
    kept = select_rows(
        mechanism, frame, Cartesian(constraints(mechanism, frame, {}), frame.moving)
    ).chosen
    with precision(BITS):
        traced = equations(
            exact_mechanism(mechanism, as_double),
            (driver,),
            [p.name for p in mechanism.points],
            kept,
        )
        drives = [[flint.arb(angle), flint.arb(1), flint.arb(0)]]
    return traced, _states(native, motion, np.array([angle]))[0], drives


# What is not true, or singular, is not proved


def test_enclosure_refuses_distant_start():
    traced, pose, drives = _setup(slider_crank(), slider_crank(), 1.0)
    with precision(BITS), pytest.raises(UnprovedError, match=r"another one|no solution near"):
        krawczyk.enclose(traced, pose + 0.05, drives, BITS)


def test_enclosure_refuses_overturned_branch():
    """A crank turned over about an axis in its plane solves the residuals of its revolute, and its
    driver's at half a turn.
    """
    arm = Mechanism(
        "arm",
        [Body("arm")],
        [Revolute("pivot", "ground", "arm", ORIGIN, Z)],
        [Point("tip", "arm", X), Point("end", "arm", Z)],
        [PointCoordinate("lift", "tip", Y)],
    )
    traced, pose, drives = _setup(arm, arm, 0.1)
    s, c = math.sin(0.5 * math.asin(0.1)), math.cos(0.5 * math.asin(0.1))
    turned_over = np.array([0.0, 0.0, 0.0, 0.0, c, s, 0.0])
    with precision(BITS):
        krawczyk.enclose(traced, pose, drives, BITS)
        with pytest.raises(UnprovedError, match=r"axes are turned over: their cosine is \[-1\.0"):
            krawczyk.enclose(traced, turned_over, drives, BITS)


def test_enclosure_refuses_change_point():
    """A parallelogram with all pivots on a line can go on as a parallelogram or as its crossed
    twin.
    """
    y = Z
    flat = Mechanism(
        "parallelogram",
        [Body("a"), Body("b"), Body("c")],
        [
            Revolute("A", "ground", "a", ORIGIN, y),
            Revolute("B", "a", "b", Y, y),
            Revolute("C", "b", "c", (2.0, 1.0, 0.0), y),
            Revolute("D", "ground", "c", (2.0, 0.0, 0.0), y),
        ],
        [Point("C", "b", (2.0, 1.0, 0.0))],
        [JointAngle("turn", "A")],
    )
    found = proved(flat, "turn", [0.0, 1.0, np.pi / 2.0, 2.0])
    assert [isinstance(each, Enclosure) for each in found.samples] == [True, True, False, True]
    assert "singular pose" in str(found.samples[2])
    # beyond it the march goes on as the parallelogram, and that is proved again
    assert found.native.points["C"].position[3] == pytest.approx(
        [2.0 - np.sin(2.0), np.cos(2.0), 0.0], abs=1e-12
    )


def test_enclosure_near_and_at_dead_centre():
    bent = replace(slider_crank(), drivers=[JointDisplacement("push", "guide")])
    start, end = 2.0, CRANK + ROD
    turned = proved(slider_crank(), "turn", [start]).native
    pin, slider = (tuple(turned.points[name].position[0].tolist()) for name in ("pin", "end"))
    joints = [
        replace(bent.joints[0]),
        replace(bent.joints[1], points=(pin, slider), length=ROD),
        replace(bent.joints[2], point=slider),
    ]
    bent = replace(bent, joints=joints, points=[Point("pin", "crank", pin)])
    stroke = end - slider[0]
    found = proved(bent, "push", [0.0, 0.5 * stroke, stroke - 1e-5, stroke])
    assert [isinstance(each, Enclosure) for each in found.samples] == [True, True, True, False], (
        found.samples[2]
    )
    # the singular value is a hundredth, the proof reaches less far
    assert found.samples[2].alone < 0.2 * found.samples[0].alone


# Derivatives and balls


def test_tape_jacobian_equals_series_slopes():
    tape = Tape()
    inputs = [tape.input(slot) for slot in range(3)]
    x, y, z = inputs
    values = [x * y - z / (x + 2.0), root(x * x + y * y), sin(x * z) * cos(-y), 3.0 * z, 1.0]
    gradients = jacobian(tape, values, inputs)
    assert gradients[3].keys() == {2}
    assert gradients[4] == {}
    code = program("values", tape, dict(enumerate(values)))
    slopes = program(
        "slopes",
        tape,
        {3 * row + k: value for row, each in enumerate(gradients) for k, value in each.items()},
    )
    with precision(BITS):
        at = [flint.arb(x) for x in ("0.7", "-0.3", "1.9")]
        found = evaluate(slopes, at)
        for k in range(3):
            moving = [flint.arb_series([x, int(k == j)], prec=3) for j, x in enumerate(at)]
            for row, value in evaluate(code, moving).items():
                expected = value[1] if isinstance(value, flint.arb_series) else flint.arb(0)
                assert abs(found.get(3 * row + k, flint.arb(0)) - expected) < 1e-50


def test_tape_jacobian_of_kink_is_refused():
    tape = Tape()
    x = tape.input(0)
    with pytest.raises(TypeError, match="'abs' has a kink"):
        jacobian(tape, [absolute(x)], [x])


def test_comparison_of_overlapping_balls_is_undecided():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    larger = program("larger", tape, {0: where_larger(x, y, 1.0, 2.0)})
    assert evaluate(larger, [flint.arb(-3), flint.arb(2)])[0] == 1
    assert evaluate(larger, [flint.arb(2), flint.arb(-3)])[0] == 2
    with pytest.raises(UndecidedError, match="cannot be told apart"):
        evaluate(larger, [flint.arb(2, 0.1), flint.arb(-2)])


def test_precision_context_is_restored():
    before = flint.ctx.prec
    with precision(BITS):
        assert before != flint.ctx.prec == BITS
    assert flint.ctx.prec == before


# Exact numbers


def test_exact_number_arithmetic():
    third = Exact.of(Fraction(1, 3))
    assert (third + 0.5 - Exact.of(Fraction(5, 6))).trivial == 0.0
    assert (Exact.of(Fraction(9, 16)).sqrt() - 0.75).trivial == 0.0
    with precision(BITS):
        root = Exact.of(Fraction(2)).sqrt()
        assert root.trivial is None
        assert abs(root.ball**2 - 2) < 1e-58
        assert abs((root * root - 2.0).ball) < 1e-58
    assert as_double(0.1) != Fraction(1, 10) == as_decimal(0.1)


@pytest.mark.parametrize("case", PROVED, ids=lambda case: case.name)
def test_exact_joints_call_no_doubles(case, monkeypatch):
    """Nothing that reaches the primitives went through a function of doubles; checks and the choice
    of a length unit may.
    """

    def exactly(do):
        def call(*arguments):
            assert not any(isinstance(each, Exact) for each in arguments), (
                f"{do} rounds {arguments} to a double"
            )
            return do(*arguments)

        return call

    with precision(BITS):
        exact = exact_mechanism(case.mechanism, as_double)
        frame = frames(exact)
        for name in {name for name in dir(math) if callable(getattr(math, name))} - {
            "isfinite",
            "dist",
        }:
            monkeypatch.setattr(math, name, exactly(getattr(math, name)))
        for constraint in constraints(exact, frame, {}):
            assert {*_floats(constraint)} <= {0.0, 1.0, -1.0}, constraint


def _floats(value):
    if isinstance(value, float):
        yield value
    elif isinstance(value, dict):
        yield from (x for each in value.values() for x in _floats(each))
    elif is_dataclass(value):
        yield from (x for each in fields(value) for x in _floats(getattr(value, each.name)))
