"""What an engine's trajectory gets wrong by itself: its form, the balance of power, and bodies."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Outcome, Trajectory
from kincheck.core.forces import Forces
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.harness.trajectory_check import BadTrajectoryError, check

from ..support.engine_faults import changed
from ..support.engine_forces import force_case
from ..support.fakes import SAMPLES, Fake, at, crank, record_of, run_case, solution
from ..support.loaded_slider_crank import loaded

NATIVE = NativeEngine(every_body=True)


def altered(found, part, value):
    """The trajectory with another value of a part, by its path: of points, joints and bodies the
    first one's; a function makes it from what is there.
    """
    name, _, rest = part.partition(".")
    old = getattr(found, name)
    if isinstance(old, Mapping) and rest:
        key, one = next(iter(old.items()))
        new = {**old, key: altered(one, rest, value)}
    else:
        new = altered(old, rest, value) if rest else value(old) if callable(value) else value
    return (changed if isinstance(found, Trajectory) else replace)(found, **{name: new})


FORMS = [
    ("residual", -1e-15, "residual is -1e-15 although 9 samples are called solved"),
    ("residual", math.nan, "residual is nan"),
    ("residual", math.inf, "residual is inf"),
    ("residual", 1e-15 + 0j, "residual is of complex128, expected a real number"),
    ("residual", np.zeros(SAMPLES), "residual has shape (9,), expected ()"),
    (
        "points.position",
        lambda p: p + 0j,
        "position of point 'tip' is of complex128, expected floats",
    ),
    (
        "points.position",
        np.zeros((SAMPLES, 3), int),
        "position of point 'tip' is of int64, expected floats",
    ),
    (
        "points.velocity",
        lambda v: v.astype(object),
        "velocity of point 'tip' is of object, expected floats",
    ),
    (
        "points.acceleration",
        np.full((SAMPLES, 3), "0"),
        "acceleration of point 'tip' is of <U1, expected floats",
    ),
    ("points.position", None, "is of object"),
    ("points.position", [[0.0, 1.0], [0.0]], "position of point 'tip' is no array"),
    ("points.position", np.transpose, "position of point 'tip' has shape (3, 9), expected (9, 3)"),
    (
        "points.velocity",
        lambda v: v[1:],
        "velocity of point 'tip' has shape (8, 3), expected (9, 3)",
    ),
    (
        "points.position",
        np.full((SAMPLES, 3), math.nan),
        "which is called solved; 9 of 9 samples are so",
    ),
    (
        "points.acceleration",
        at(3, 2, math.inf),
        "at sample 3 (angle = -0.25), which is called solved",
    ),
    ("points", {}, "no motion of point 'tip'; found: none"),
    ("solved", lambda each: each[1:], "solved has shape (8,), expected (9,)"),
    ("solved", np.ones(SAMPLES), "solved is of float64, expected booleans"),
    ("iterations", np.full(SAMPLES, 2.5), "iterations is of float64, expected whole numbers"),
    ("iterations", np.full(SAMPLES, -3), "iterations has -3"),
    ("message", None, "message is None"),
    ("details", [1], "details [1]"),
]


def refused(answer):
    record = record_of(Fake(answer=answer))
    assert record.outcome is Outcome.ERROR
    assert record.message.startswith("BadTrajectoryError: fake: ")
    return record.message


@pytest.mark.parametrize(("part", "value", "said"), FORMS, ids=[said for *_, said in FORMS])
def test_malformed_trajectory_is_reported(part, value, said):
    assert said in refused(lambda case: altered(solution(case), part, value))


def test_answer_of_wrong_type_is_refused():
    assert "returned tuple" in refused(lambda case: (1, 2))


FORCES = [
    (
        "forces.joints.moment",
        np.zeros((3, 3)) + 1j,
        "moment of joint 'pin' is of complex128, expected floats",
    ),
    ("forces.joints.force", np.zeros((3, 3), int), "force of joint 'pin' is of int64"),
    ("forces.joints.force", np.zeros(3), "force of joint 'pin' has shape (3,), expected (3, 3)"),
    ("forces.joints.force", np.full((3, 3), math.inf), "force of joint 'pin' is infinite"),
    (
        "forces.joints.free",
        np.zeros((3, 3, 0)),
        "free directions of joint 'pin' has shape (3, 3, 0), expected (3, 6, 'any')",
    ),
    (
        "forces.drivers",
        {"turn": np.zeros((3, 1))},
        "effort of driver 'turn' has shape (3, 1), expected (3,)",
    ),
    ("forces.elements", {"spring": 1.0}, "force of element 'spring' has shape (), expected (3,)"),
    ("forces.power", 0.0, "power has shape ()"),
    ("forces.power", np.zeros(3) + 0j, "power is of complex128"),
    (
        "bodies",
        lambda bodies: {"crank": bodies["crank"]},
        "motions of bodies crank, but 'slider' is missing. Give those of all moving bodies",
    ),
    ("bodies", lambda bodies: {**bodies, "wall": bodies["crank"]}, "'wall' is no moving body"),
    ("bodies.p", np.zeros((3, 3)), "p of body 'crank' has shape (3, 3), expected (3, 4)"),
    ("bodies.p", lambda p: 1.001 * p, "p of body 'crank' has length 1.001"),
    ("bodies.r", np.full((3, 3), math.nan), "r of body 'crank' is [nan, nan, nan] at sample 0"),
]


@pytest.fixture(scope="module")
def case():
    return force_case(loaded(), [0.0, 0.25, 0.5])


@pytest.fixture(scope="module")
def found(case):
    return NATIVE.solve(NATIVE.build(case), case, 1e-12)


@pytest.mark.parametrize(("part", "value", "said"), FORCES, ids=[said for *_, said in FORCES])
def test_malformed_forces_and_bodies_are_reported(part, value, said, case, found):
    check(case, "fake", found)
    with pytest.raises(BadTrajectoryError, match=r"^fake: ") as caught:
        check(case, "fake", altered(found, part, value))
    assert said in str(caught.value)


def outcome(case, found, mode="projection"):
    """Outcome and message of a trajectory in a run, judged by itself alone."""
    engine = Fake("native", answer=lambda case: found, mode=mode)
    record = record_of(engine, case)
    return record.outcome, record.message


def unbalanced(found, watts, sample=1):
    return altered(found, "forces.power", lambda x: x + watts * (np.arange(len(x)) == sample))


@pytest.mark.parametrize("watts", [100.0, -100.0, 1e-3])
def test_unbalanced_power_fails_with_sample(watts, case, found):
    case = replace(case, outputs=tuple(replace(each, atol=1e-7) for each in case.outputs))
    result, message = outcome(case, unbalanced(found, watts))
    assert result is Outcome.FAIL
    assert f"the balance of power is off by {abs(watts):.3g} W at sample 1 (turn = 0.25)" in message


def test_power_balance_within_tolerance_passes(case, found):
    assert outcome(case, found)[0] is Outcome.UNJUDGED
    assert outcome(case, unbalanced(found, 1e-9))[0] is Outcome.UNJUDGED
    # a force within its own tolerance of 1 N may leave as much at the driver's pace
    assert outcome(case, unbalanced(found, 0.5))[0] is Outcome.UNJUDGED


def test_unbalanced_power_is_not_validated(kincheck_main, capsys):
    from kincheck import cases

    strut = cases.load("mcpherson_strut_loaded")
    right = NativeEngine()
    forces = right.solve(right.build(strut), strut, 1e-12)
    engine = Fake("other", answer=lambda case: unbalanced(forces, 100.0, 7))
    assert kincheck_main("run", strut.name, engines=[engine], cases={strut.name: strut}) == 1
    out = capsys.readouterr().out
    assert "the balance of power is off by 100 W at sample 7" in out
    assert "(validated)" not in out


def test_unknown_power_is_not_zero(found):
    none = np.full(3, math.nan)
    unknown = replace(found.forces, power=none, largest_power=none)
    assert unknown.account()["power_missing"] is None
    assert found.forces.account()["power_missing"] < 1e-12


BODIES = {
    "position": (lambda body: {"r": body.r + 1e-6}, "position of points on 'slider'"),
    "velocity": (lambda body: {"v": body.v * (1.0 + 1e-6)}, "velocity at"),
    "acceleration": (lambda body: {"a": -body.a}, "acceleration at"),
    "of another sample": (
        lambda body: {key: np.roll(getattr(body, key), 1, axis=0) for key in "rpva"},
        "position",
    ),
}


@pytest.mark.parametrize("fault", BODIES)
def test_bodies_off_their_constraints_fail(fault, case, found):
    change, said = BODIES[fault]
    slider = found.bodies["slider"]
    wrong = changed(found, bodies={**found.bodies, "slider": replace(slider, **change(slider))})
    result, message = outcome(case, wrong)
    assert result is Outcome.FAIL
    assert "the motion of bodies is off by" in message
    assert said in message
    assert outcome(case, wrong, "simulate")[0] is not Outcome.FAIL


def test_points_off_their_bodies_fail(case, found):
    result, message = outcome(case, altered(found, "points.position", lambda p: p + 1e-6))
    assert result is Outcome.FAIL
    assert "position of points on" in message


def test_bodies_without_rates_judged_by_position(case, found):
    still = {name: replace(each, v=None, a=None) for name, each in found.bodies.items()}
    found = changed(found, bodies=still)
    assert outcome(case, found)[0] is Outcome.UNJUDGED
    assert outcome(case, altered(found, "bodies.r", lambda r: r + 1e-6))[0] is Outcome.FAIL


def test_engine_with_points_alone_passes():
    free = Forces({}, {}, {}, np.zeros(SAMPLES), np.zeros(SAMPLES))
    engine = Fake(answer=lambda case: changed(solution(case), forces=free, residual=0))
    record = record_of(engine)
    assert record.outcome is Outcome.PASS


def test_freedoms_unlike_native_fail():
    def two(case):
        found = solution(case)
        return changed(found, details={**found.details, "dof": 2})

    native, other = run_case(crank(), Fake("native"), Fake("other", two)).records
    assert native.outcome is Outcome.PASS
    assert other.outcome is Outcome.FAIL
    assert other.message == "counts 2 degrees of freedom without drivers, native 1"
    assert other.faults == [other.message]
