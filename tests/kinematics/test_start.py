"""Where a motion is followed from: the design decides, up to six typed digits, and rounding never
does.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    RackPinion,
    Ramp,
    Revolute,
    Sine,
    Table,
    Translational,
    adapters,
    solve,
)
from kincheck.adapters.exudyn.exudyn import Exudyn
from kincheck.adapters.mujoco.mujoco import MuJoCo
from kincheck.adapters.pinocchio.pinocchio import Pinocchio
from kincheck.core.case.case import Output, Sweep, Truth
from kincheck.core.kinematics import start_of, styles
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.one_design import prepare
from kincheck.core.mechanism.motions import Absolute, Path

from ..support.block_structures import solve_components, solve_sparse
from ..support.mechanisms import ORIGIN, X, Y, chain, errors, slider_crank

DESIGNS = "kincheck.core.extensions.designs.design_batch"

RADIUS = 0.1
TIMES = np.linspace(-0.75, 0.75, 13)
Z = (0.0, 0.0, 1.0)
ANGLES = [60.0, 45.0, 180.0, round(np.random.default_rng(7).uniform(-180.0, 180.0), 3)]


def six(x):
    """A number as a person types it."""
    return float(f"{x:.6g}")


def arm(degrees, *, relative=False):
    """Two links of 0.8 m whose tip is driven on the unit circle about their hinge, which turns a
    pinion.
    """
    tip, elbow = math.radians(degrees), math.radians(degrees) + math.acos(0.5 / 0.8)
    at, joint = (
        (r * math.cos(angle), r * math.sin(angle), 0.0) for r, angle in ((1.0, tip), (0.8, elbow))
    )
    return Mechanism(
        "arm",
        [Body("a"), Body("b"), Body("rack")],
        [
            Revolute("h", "ground", "a", ORIGIN, Z),
            Revolute("k", "a", "b", joint, Z),
            Translational("s", "ground", "rack", (0.0, -1.0, 0.0), X),
        ],
        [Point("tip", "b", at), Point("r", "rack", (0.0, -1.0, 0.0))],
        [
            PointCoordinate("x", "tip", X, relative=relative),
            PointCoordinate("y", "tip", Y, relative=relative),
        ],
        [RackPinion("rp", ("h", "s"), RADIUS)],
    )


def turned_arm(degrees=30.0):
    """The arm, driven at its two hinges."""
    return replace(arm(degrees), drivers=[JointAngle("u", "h"), JointAngle("v", "k")])


def circling(mechanism, phases, kind="sine"):
    """Motions of the tip that go once round the unit circle in a second."""

    def motion(phase):
        if kind == "sine":
            return Sine(1.0, 1.0, phase)
        times = np.linspace(-1.0, 1.0, 401)
        values = [math.sin(2.0 * math.pi * t + phase) for t in times.tolist()]
        return Table(tuple(times), tuple(map(six, values) if kind == "typed table" else values))

    return {
        name: Absolute(motion(phase), mechanism.design_value(name))
        for name, phase in zip("xy", phases, strict=True)
    }


def phases_of(degrees):
    return math.radians(degrees) + math.pi / 2.0, math.radians(degrees)


def case_of(mechanism, motions, times=TIMES):
    points = [each.name for each in mechanism.points]
    outputs = tuple(Output(f"{name}_x", name, X, False, 1e-9, 0.0, "a test") for name in points)
    sweep = Sweep("time", times, 1.0, 0.0, motions)
    return Case("case", "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def by_style(style):
    def solved(case):
        path = case.sweep.path
        return prepare(
            case.mechanism, Request(tuple(path.motions), case.points, style=style), path
        )(1e-12)

    return solved


def by_sparse(case):
    return solve_sparse(case.mechanism, case.sweep.path, case.points)


def by_engine(engine):
    return lambda case: engine.solve(engine.build(case), case, 1e-12)


ENGINES = {"mujoco": MuJoCo, "pinocchio": Pinocchio, "exudyn": Exudyn}
WAYS = [
    *(pytest.param(by_style(style), id=style) for style in styles()),
    pytest.param(by_sparse, id="sparse", marks=pytest.mark.needs("blocks")),
    *(
        pytest.param(
            by_engine(make()),
            id=name,
            marks=pytest.mark.skipif(make().version() is None, reason="not installed"),
        )
        for name, make in ENGINES.items()
    ),
]


@pytest.mark.parametrize(
    ("solved", "angles"),
    [
        pytest.param(by_style("native"), ANGLES[2:], id="native at other angles"),
        *(pytest.param(*way.values, ANGLES[:2], id=way.id, marks=way.marks) for way in WAYS),
    ],
)
def test_pinion_rolls_from_any_angle(solved, angles):
    """At 60 degrees the sine of the phase is not the design value to the last bit, at 45 it is."""
    for degrees in angles:
        mechanism = arm(degrees)
        found = solved(case_of(mechanism, circling(mechanism, phases_of(degrees))))
        assert found.solved.all(), found.message
        assert found.points["r"].position[:, 0] == pytest.approx(
            2.0 * math.pi * RADIUS * TIMES, abs=1e-12
        ), degrees
        assert found.details["start"]["time"] == 0.0
        assert "notes" not in found.details


@pytest.mark.by_day(3)
@pytest.mark.parametrize("solved", WAYS)
@pytest.mark.parametrize("kind", ["sine", "typed table"])
def test_typed_digits_start_at_design(solved, kind):
    degrees = ANGLES[2 if kind == "sine" else 3]
    phases = phases_of(degrees)
    mechanism = arm(degrees)
    motions = circling(mechanism, map(six, phases) if kind == "sine" else phases, kind)
    found = solved(case_of(mechanism, motions))
    assert found.solved.all(), found.message
    assert found.points["r"].position[:, 0] == pytest.approx(
        2.0 * math.pi * RADIUS * TIMES, abs=1e-4
    )
    assert "notes" not in found.details
    # what is between the design and the path is travelled: at time zero the tip is where its
    # drivers are
    middle = found.points["tip"].position[6, :2]
    assert middle == pytest.approx(
        [motion.motion.at(np.zeros(1))[0][0] for motion in motions.values()], abs=1e-14
    )


def test_rounded_design_value_is_zero():
    mechanism = arm(180.0)
    assert 0.0 < mechanism.design_value("y") < 1e-15
    motions = {"x": Sine(1.0, 1.0, -math.pi / 2.0), "y": Ramp(0.0)}
    held = {name: Absolute(each, mechanism.design_value(name)) for name, each in motions.items()}
    start = start_of(mechanism, Path(held, TIMES))
    assert (start.time, start.lead, start.starts_at_design) == (0.0, None, True)


def test_exact_start_is_design():
    mechanism = arm(30.0, relative=True)
    start = start_of(mechanism, Path({"x": Sine(0.1, 1.0), "y": Ramp(0.1)}, TIMES))
    assert (start.time, start.lead, start.other, start.facts) == (
        0.0,
        None,
        None,
        {"time": 0.0, "lead": {}},
    )


def test_table_starts_at_first_sample():
    """Beyond its ends a line goes on through the design, and is not asked there."""
    mechanism = turned_arm()
    table = Table((1.0, 2.0, 3.0), (1.0, 2.0, 3.0))
    path = Path({"u": table, "v": table}, np.array([1.0, 1.5]))
    start = start_of(mechanism, path)
    assert (start.time, start.other) == (1.0, None)
    assert start.facts["lead"] == {"u": 1.0, "v": 1.0}


@pytest.mark.parametrize("solved", WAYS)
def test_start_at_sample_of_design(solved):
    """A table of one turn and a half that is at the design in its middle, at 0.75 s."""
    degrees, times = 60.0, np.linspace(0.0, 1.5, 13)
    mechanism = arm(degrees)
    phases = [phase - 1.5 * math.pi for phase in phases_of(degrees)]
    found = solved(case_of(mechanism, circling(mechanism, phases), times))
    assert found.solved.all(), found.message
    assert found.points["r"].position[:, 0] == pytest.approx(
        2.0 * math.pi * RADIUS * (times - 0.75), abs=1e-12
    )
    assert found.details["start"]["time"] == 0.75


@pytest.mark.parametrize("phase", [3.0 * math.pi, six(3.0 * math.pi)])
def test_start_passes_singular_pose(phase):
    """The cranks of a parallelogram pass their base line, 1.87 rad from design, before any
    sample.
    """
    path = Path({"turn": Sine(2.5, 0.25, phase)}, np.array([-0.95, -0.9]))
    found = prepare(chain(1), Request(("turn",), ("end",)), path)(1e-12)
    assert found.solved.all(), found.message
    assert found.points["end"].position[:, 0] == pytest.approx(
        1.0 + np.sin(0.3 - path.motions["turn"].at(path.times)[0]), abs=1e-12
    )


def test_start_near_dead_centre():
    """Design: stretched out. To depart from there for 1e-16 rad is to depart from there."""
    found = solve(slider_crank(), "turn", np.linspace(-0.4, 0.4, 5), motions={})
    path = Path({"turn": Sine(-0.4, 0.25, math.pi)}, np.array([-1.0, 0.0, 1.0]))
    other = prepare(slider_crank(), Request(("turn",), ("end",)), path)(1e-12)
    assert other.points["end"].position == pytest.approx(
        found.points["end"].position[::2], abs=1e-15
    )


# Two ways from the design to the path: which one is taken, and what is said of the other


FAR = 1.0
"""By what the arm at time zero is ahead of its design [rad]."""


@pytest.mark.by_day(2)
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


@pytest.mark.by_day(2)
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


# Components, many designs, simulators and proofs start as a sweep does


@pytest.mark.needs("blocks")
def test_components_start_at_typed_phase():
    for phase in (math.pi, six(math.pi)):
        path = Path({"turn": Sine(-1.2, 0.2, phase)}, TIMES)
        found = solve_components(chain(3), path, ("end",))
        expected = 3.0 + np.sin(0.3 - path.motions["turn"].at(TIMES)[0])
        assert found.solved.all(), found.message
        assert found.points["end"].position[:, 0] == pytest.approx(expected, abs=1e-12)
        assert found.details["start"]["time"] == 0.0


def test_designs_start_at_typed_phase():
    designs = pytest.importorskip(DESIGNS).solve_designs
    mechanism = turned_arm()
    values, tips = np.linspace(-1.0, 1.0, 5), np.array([(1.0, 0.1, 0.0), (0.9, 0.2, 0.0)])
    for phase in (math.pi, six(math.pi), 1.0):
        motions = {"v": Sine(0.5, 0.3, phase)}
        found = designs(mechanism, "u", values, {"points.tip.position": tips}, motions=motions)
        for k, tip in enumerate(tips.tolist()):
            one = replace(mechanism, points=[Point("tip", "b", tuple(tip))])
            alone = solve(one, "u", values, motions=motions).points["tip"]
            assert errors(alone, [found.points["tip"].position[k]])[0] <= 1e-12


def test_designs_note_assumed_start():
    designs = pytest.importorskip(DESIGNS).solve_designs
    tips = {"points.tip.position": np.array([(1.0, 0.1, 0.0)])}
    near, far = (
        designs(turned_arm(), "u", TIMES, tips, motions={"v": Sine(0.5, 0.3, phase)}).notes
        for phase in (six(math.pi), 1.0)
    )
    assert [*near] == []
    assert "the design position is not on the path: all drivers go straight" in "; ".join(far)


@pytest.mark.parametrize(("phase", "said"), [(six(math.pi), False), (1.0, True)])
def test_study_notes_assumed_start(phase, said, tmp_path):
    read_variation = pytest.importorskip(
        "kincheck.core.extensions.sweep.variation_file"
    ).read_variation
    sweep_designs = pytest.importorskip("kincheck.core.extensions.sweep.sweep").sweep_designs
    mechanism = turned_arm()
    file = tmp_path / "vary.toml"
    what = '[units]\nlength = "m"\n[hardpoints.tip]\nat = "points.tip.position"\nsigma = 0.001\n'
    file.write_text(f'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n{what}')
    case = case_of(mechanism, {"u": Sine(0.5, 0.3, phase), "v": Ramp(0.1)})
    found = sweep_designs(case, read_variation(file, case), samples=8)
    assert any("go straight" in note for note in found.run["cases"]["case"]["notes"]) == said


@pytest.mark.needs("simulate")
def test_simulator_starts_at_typed_phase():
    """Turns of a coupled joint are counted from the design, where a typed phase begins as well as
    an exact one.
    """
    static = adapters.engine("exudyn-static", "simulate")
    if static.version() is None:
        pytest.skip("not installed")
    mechanism = turned_arm(60.0)
    near, far = (
        case_of(mechanism, {"u": Sine(1.0, 0.3, phase), "v": Ramp(0.1)})
        for phase in (six(math.pi), 1.0)
    )
    assert static.unsupported(near) is None
    assert "count from the design" in str(static.unsupported(far))
    found = static.solve(static.build(near), near, 1e-12)
    assert found.points["r"].position[:, 0] == pytest.approx(
        RADIUS * near.sweep.motions["u"].at(TIMES)[0], abs=1e-9
    )


def test_written_start_is_reached():
    """The way begins at the design, also where the motion does not, so that turns are counted."""
    way_to = pytest.importorskip("kincheck.core.extensions.exports.model_writer").way_to
    mechanism = turned_arm(60.0)
    case = case_of(mechanism, {"u": Sine(9.0, 0.1, 1.5), "v": Ramp(0.1)})
    way = way_to(case, 0.5)
    assert way["rack"].r[0] == pytest.approx(ORIGIN, abs=1e-15)
    assert way["a"].p[0] == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-15)
    assert way["rack"].r[-1, 0] == pytest.approx(
        RADIUS * case.sweep.motions["u"].at(np.array([0.5]))[0][0], abs=1e-12
    )


def test_typed_digits_are_proved():
    prove_case = pytest.importorskip(
        "kincheck.core.extensions.proofs.verified_reference"
    ).prove_case
    mechanism = arm(60.0)
    case = case_of(mechanism, circling(mechanism, map(six, phases_of(60.0))))
    made, _ = prove_case(case, digits=20, numbers="double", tol=1e-12)
    assert all(each.proved for each in made.samples)
