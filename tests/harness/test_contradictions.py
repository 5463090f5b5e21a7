"""Contradictions between engines, and outputs that are held."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.adapters import engine
from kincheck.core.case.case import Series
from kincheck.core.case.held import held_case
from kincheck.core.case.io.case_file import load_case
from kincheck.core.extensions.hardpoints.templates import TEMPLATES
from kincheck.core.harness.execution import Answer, Attempt, Failure, Pair, attempt
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.mechanism.motions import Waypoints
from kincheck.core.report.report import headline

from ..oracles.rods import Carrier
from ..support.fakes import (
    RADIUS,
    SAMPLES,
    Fake,
    at,
    crank,
    exact,
    off,
    raising,
    record_of,
    run_case,
    solution,
)

TOL = 1e-12
ENDS = "cannot be followed beyond here: there is a singular pose ahead"


def reaching(samples, message=ENDS, **changed):
    """An answer that reaches these samples only."""

    def answer(case):
        solved = np.isin(np.arange(SAMPLES), [*samples])
        p, v, a = (np.where(solved[:, None], each, np.nan) for each in exact(case))
        found = solution(
            case, solved=solved, message=message, position=p, velocity=v, acceleration=a
        )
        return replace(found, **changed) if changed else found

    return answer


def pair(native, engine, case=None):
    """Records of the native engine and another."""
    return run_case(
        case or crank(reference=False), Fake("native", answer=native), Fake(answer=engine)
    ).records


def test_engine_values_beyond_native_reach_fail():
    native, fake = pair(reaching(range(7)), solution)
    assert native.outcome is Outcome.FAIL
    assert fake.outcome is Outcome.FAIL
    tip = RADIUS * np.array([np.cos(0.75) - 1.0, np.sin(0.75)])
    assert (
        fake.message
        == "values at 2 of 9 samples that native cannot reach, first at sample 7 (angle = 0.75): x"
        f" = {tip[0]:.6g} m, y = {tip[1]:.6g} m; native: 7 of 9 samples solved: {ENDS}"
    )
    # where both have values they are compared all the same
    assert fake.errors["x"].position.within
    assert fake.errors["x"].contradicted == 2


def test_baseline_contradicts_engine_values():
    native = Fake("native", answer=reaching(range(7)))
    fake = record_of(Fake(), crank(reference=False), baseline=native)
    assert (fake.outcome, "that native cannot reach" in fake.message) == (Outcome.FAIL, True)


def test_different_ends_name_longer_motion():
    _, further = pair(reaching(range(4)), reaching(range(6), "ends here"))
    assert further.outcome is Outcome.FAIL
    assert further.message.startswith(
        "6 of 9 samples solved: ends here; values at 2 of 9 samples that native cannot reach"
    )
    _, shorter = pair(reaching(range(6)), reaching(range(4), "ends here"))
    assert (
        shorter.message == "4 of 9 samples solved: ends here; native has values at 2 of the others"
    )
    _, alike = pair(reaching(range(6)), reaching(range(6), "ends here"))
    assert alike.message == "6 of 9 samples solved: ends here"


def test_contradiction_and_deviation_share_message():
    _, fake = pair(reaching(range(7)), off("position", at(2, 1, 9.0)))
    assert "that native cannot reach" in fake.message
    assert "y: position is off by" in fake.message


def test_native_reaching_nothing_contradicts_every_value():
    _, fake = pair(reaching([]), solution)
    assert (fake.outcome, fake.errors["x"].contradicted) == (Outcome.FAIL, SAMPLES)


def test_reference_gap_leaves_native_judge():
    case = crank()
    short = np.where(np.arange(SAMPLES) < 7, 1.0, np.nan)
    for name, series in case.reference.items():
        case.reference[name] = Series(
            *(short * each for each in (series.position, series.velocity, series.acceleration))
        )
    native, fake = pair(solution, solution, case)
    assert [native.outcome, fake.outcome] == [Outcome.PASS, Outcome.PASS]
    assert "not judged: position: closed form has no value at 2 of 9 samples; " in fake.message
    # native refuses what the reference does not have
    _, fake = pair(reaching(range(7)), solution, case)
    assert (fake.outcome, "values at 2 of 9 samples that native cannot reach" in fake.message) == (
        Outcome.FAIL,
        True,
    )
    alone = record_of(Fake(), case, baseline=Fake("native", answer=reaching(range(7))))
    assert alone.outcome is Outcome.FAIL


def test_reference_overrules_native_refusal():
    """Native refuses samples that the closed form has: native is wrong there, and the others are
    not.
    """
    case = crank()
    case.reference["y"] = Series(case.reference["y"].position)  # the rates of y are native's
    native, fake = pair(reaching(range(7)), solution, case)
    assert [native.outcome, fake.outcome] == [Outcome.FAIL, Outcome.PASS]
    assert "velocity: native has no value at 2 of 9 samples" in fake.message


@pytest.mark.parametrize("outcome", [Outcome.ERROR, Outcome.TIMEOUT, Outcome.CRASHED])
def test_failed_native_judges_nothing(outcome):
    def solver(pairs):
        for index, each in enumerate(pairs):
            if each.engine.name == "native":
                yield index, Attempt(None, Failure(outcome, "it went down"))
            else:
                yield index, attempt(each)

    native, fake = run_case(crank(reference=False), Fake("native"), Fake(), solver=solver).records
    assert native.outcome is outcome
    why = (
        f"the case has no reference, and the native engine has no answer ({outcome}: it went down)"
    )
    assert (fake.outcome, fake.message) == (Outcome.UNJUDGED, why)


# Residuals


def leaving(residual, **changed):
    return Fake(answer=lambda case: replace(solution(case), residual=residual), **changed)


def test_residual_above_tolerance_fails():
    fake = record_of(leaving(1e-6))
    assert fake.outcome is Outcome.FAIL
    assert fake.message.startswith(
        "the residual of samples that the engine calls solved is 1e-06, tolerance 1e-12"
    )
    assert "1 of 1 comparisons has a residual above the tolerance" in headline(
        run_case(crank(), leaving(1e-6))
    )


@pytest.mark.parametrize(
    ("residual", "options", "engine"),
    [
        (1e-6, {"tol": 1e-5}, {}),
        (1e-12, {}, {}),
        # a simulation promises no residual, and an effort leaves one on purpose
        (1e-6, {}, {"mode": "simulate"}),
        (1e-6, {"residuals": False}, {}),
    ],
    ids=["tolerance", "round-off", "simulation", "effort"],
)
def test_residual_within_tolerance_passes(residual, options, engine):
    given = {"tol": TOL, **options}
    assert run([crank()], [leaving(residual, **engine)], **given).records[0].outcome is Outcome.PASS


def test_residual_fails_uncompared_pair():
    fake = record_of(leaving(1e-6), crank(reference=False))
    assert fake.outcome is Outcome.FAIL


@pytest.mark.parametrize("name", ["mujoco", "pinocchio", "exudyn"])
def test_simulators_keep_residual_promise(name):
    engine = adapters.engine(name)
    if engine.version() is None:
        pytest.skip(f"{name} is not installed")
    record = record_of(engine, cases.load("chrono_macpherson"), tol=1e-9)
    assert record.outcome is Outcome.PASS, record.message


# What native says of samples beside singular poses


def test_uncertain_samples_contradict_no_engine():
    others = [k for k in range(SAMPLES) if k != 4]
    uncertain = reaching(
        others, "refused at angle = 0: so near a singular pose", details={"uncertain_samples": [4]}
    )
    native, fake = pair(uncertain, solution)
    assert [native.outcome, fake.outcome] == [Outcome.FAIL, Outcome.PASS]
    assert "not judged: position: native has no value at 1 of 9 samples" in fake.message
    assert fake.message.endswith(
        "native: 8 of 9 samples solved: refused at angle = 0: so near a singular pose"
    )


def test_contradictions_are_written_read_and_resumed():
    results = run_case(crank(reference=False), Fake("native", answer=reaching(range(7))), Fake())
    read = from_json(to_json(results))
    assert read == results
    assert "contradict" in headline(results)
    engines = [Fake("native", answer=raising(AssertionError("not again"))), Fake()]
    again = run_case(crank(reference=False), *engines, made=read.records[:1])
    assert again.records[1].message == results.records[1].message


# Derivatives by wheel travel at every sample of a combined sweep: other drivers are held


AT = TEMPLATES["double_wishbone"].sample
WHEEL_RADIUS, WHEELBASE, HEIGHT, SHARE = 0.228, 1.55, 0.3, 0.6
RODS = [
    ("lca_front", "lca_outer"),
    ("lca_rear", "lca_outer"),
    ("uca_front", "uca_outer"),
    ("uca_rear", "uca_outer"),
    ("tierod_inner", "tierod_outer"),
]


def arm(name):
    front, rear = (np.array(AT[f"{name}_{end}"]) for end in ("front", "rear"))
    return f"""
[bodies.{name}]
[joints.{name}_pivot]
type = "revolute"
bodies = ["ground", "{name}"]
point = {rear.tolist()}
axis = {(front - rear).tolist()}
[joints.{name}_ball]
type = "spherical"
bodies = ["{name}", "knuckle"]
point = {[*AT[f"{name}_outer"]]}
"""


CASE = f"""
schema = "kincheck-case/1"
name = "steered"
source = "made up"
[bodies.knuckle]
[bodies.rack]
{arm("lca")}{arm("uca")}
[joints.slide]
type = "translational"
bodies = ["ground", "rack"]
point = {[*AT["tierod_inner"]]}
axis = [0, 1, 0]
[joints.tie]
type = "distance"
bodies = ["rack", "knuckle"]
points = [{[*AT["tierod_inner"]]}, {[*AT["tierod_outer"]]}]
[points.wheel_center]
body = "knuckle"
position = {[*AT["wheel_center"]]}
[drivers.rack]
type = "joint_displacement"
joint = "slide"
[drivers.stroke]
type = "point_coordinate"
point = "wheel_center"
direction = [0, 0, 1]
[suspension]
convention = "iso8855"
side = "left"
forward = [1, 0, 0]
up = [0, 0, 1]
axle = "front"
wheel_radius = {WHEEL_RADIUS}
wheelbase = {WHEELBASE}
cg_height = {HEIGHT}
brake_share = {SHARE}
[outputs]
toe.type = "toe"
rc.type = "roll_center_height"
dive.type = "anti_dive"
"""
RAMP = '[drivers.rack.motion]\ntype = "ramp"\nrate = 0.01\n'
SINE = '[drivers.stroke.motion]\ntype = "sine"\namplitude = 0.02\nfrequency = 1.0\n'
TIME = "[sweep]\nstart = -1.0\nstop = 1.0\nsteps = 9\n"
STROKE = '[sweep]\ndriver = "stroke"\nstart = -0.03\nstop = 0.04\nsteps = 8\nrate = 0.1\n'
SWEEPS = {
    "both": f'{RAMP}[drivers.stroke.motion]\ntype = "ramp"\nrate = 0.02\n{TIME}',
    # at the quarters of its period the wheel stands still
    "sine": RAMP + SINE + TIME,
    "rack alone": '[sweep]\ndriver = "rack"\nstart = -0.02\nstop = 0.02\nsteps = 9\n',
    "rack, late": '[sweep]\ndriver = "rack"\nstart = 0.005\nstop = 0.02\nsteps = 4\n',
    "stroke swept": RAMP + STROKE,
    "one sample": f"{RAMP}{SINE}[sweep]\nstart = 0.3\nstop = 0.3\nsteps = 1\n",
}


def case_of(folder, sweep):
    file = folder / "case.toml"
    file.write_text(CASE + sweep)
    return load_case(file)


def answer(case, name, mode="projection"):
    found = attempt(Pair(case, engine(name, mode), 1e-12, timed=False)).result
    assert isinstance(found, Answer), found
    return found


def toe_of(carrier):
    s = carrier.direction((0.0, 1.0, 0.0))
    return np.arctan2(s[0], s[1])


def expected(rack, stroke):
    """Toe by travel, roll centre and anti-dive of five rods, the inner end of one displaced."""
    moved = {4: (0.0, rack, 0.0)}
    carrier = Carrier(AT["wheel_center"], [(AT[a], AT[b]) for a, b in RODS])
    for part in (0.25, 0.5, 0.75, 1.0):
        carrier.go(part * stroke, {4: (0.0, part * rack, 0.0)})
    center, s = carrier.at(AT["wheel_center"]), carrier.direction((0.0, 1.0, 0.0))
    rise = np.array([0.0, 0.0, 1.0]) - s[2] * s
    contact = center - WHEEL_RADIUS * rise / np.linalg.norm(rise)
    vx, vy, vz = carrier.velocity(contact, moved)
    _, w = carrier.twist(moved)
    s_t = np.cross(w, s)
    return {
        "toe": toe_of(carrier),
        "toe.per_travel": (s[1] * s_t[0] - s[0] * s_t[1]) / (s[0] ** 2 + s[1] ** 2),
        "rc": contact[1] * vy / vz,
        "dive": SHARE * WHEELBASE / HEIGHT * vx / vz,
    }


@pytest.mark.parametrize("kind", SWEEPS)
def test_derivatives_by_travel_at_every_sample(tmp_path, kind):
    case = case_of(tmp_path, SWEEPS[kind])
    found = answer(case, "native")
    assert found.message == ""
    path = case.sweep.path
    rack, stroke = path.drive(["rack", "stroke"], path.times)[0]
    for k in range(len(path.times)):
        true = expected(rack[k], stroke[k])
        assert {name: found.outputs[name].position[k] for name in true} == pytest.approx(
            true, abs=1e-12
        )
    assert found.outputs["rc"].velocity is None


@pytest.mark.parametrize("name", ["mujoco", "pinocchio", "exudyn"])
def test_derivatives_by_travel_in_engines(tmp_path, name):
    pytest.importorskip(name)
    case = case_of(tmp_path, SWEEPS["sine"])
    found, native = answer(case, name), answer(case, "native")
    for output in case.outputs:
        off = found.outputs[output.name].position - native.outputs[output.name].position
        assert np.abs(off).max() < 1e-11


def test_roll_centre_slope_equals_difference(tmp_path):
    """The roll centre by travel, against its difference over two wheel heights."""
    case = case_of(tmp_path, SWEEPS["both"])
    slope = answer(case, "native").outputs["rc.per_travel"].position
    for k in (0, 6):
        rack, stroke = 0.01 * case.sweep.values[k], 0.02 * case.sweep.values[k]
        high, low = (expected(rack, stroke + d)["rc"] for d in (1e-5, -1e-5))
        assert slope[k] == pytest.approx((high - low) / 2e-5, rel=1e-6)


def test_slope_without_travel_driver(tmp_path):
    """A reference point of the same carrier is no driver of travel unless it is named."""
    data_path = case_of(tmp_path, SWEEPS["both"])
    assert data_path.outputs[0].vehicle.travel == ("stroke",)
    alone = case_of(tmp_path, STROKE)
    assert alone.outputs[0].vehicle.travel == ()


def test_missing_derivative_has_reason(tmp_path):
    """A pose that the other path does not find has no derivative, and the reason is given."""
    case = case_of(tmp_path, SWEEPS["both"])

    class Elsewhere(type(engine("native"))):
        def solve(self, model, case, tol):
            found = super().solve(model, case, tol)
            if any(isinstance(each, Waypoints) for each in case.sweep.motions.values()):
                points = {
                    name: replace(motion, position=motion.position + 1.0)
                    for name, motion in found.points.items()
                }
                found = replace(found, points=points)
            return found

    found = attempt(Pair(case, Elsewhere(), 1e-12, timed=False)).result
    assert "no derivative by stroke at 9 of 9 samples: another assembly" in found.message
    assert np.isnan(found.outputs["rc"].position).all()
    assert np.isfinite(found.outputs["toe"].position).all()


def test_waypoints_interpolate_smoothly():
    motion = Waypoints((0.0, 1.0, 1.5), (0.2, -0.3, 0.4), 0.05)
    assert np.array_equal(motion.at(np.array(motion.times)), [motion.values, [0.05] * 3, [0.0] * 3])
    t, h = np.array([-0.5, 0.0, 0.3, 0.999999, 1.0, 1.3, 1.5, 2.0]), 1e-6
    (x, v, a), before, after = (motion.at(t + step) for step in (0.0, -h, h))
    assert np.abs((after[0] - before[0]) / (2 * h) - v).max() < 1e-8
    assert np.abs((after[1] - before[1]) / (2 * h) - a).max() < 1e-3
    assert x[0] == 0.2 - 0.025


def test_held_path_keeps_sweep_values(tmp_path):
    case = case_of(tmp_path, SWEEPS["sine"])
    path, again = case.sweep.path, held_case(case, ["stroke"]).sweep.path
    names = ["rack", "stroke"]
    assert np.array_equal(path.times, again.times)
    value, rate, second = again.drive(names, again.times)
    assert np.array_equal(value, path.drive(names, path.times)[0])
    assert not rate[0].any()
    assert (rate[1] > 0.0).all()
    assert not second.any()
