"""The McPherson strut against its 40-digit reference and against the paper's unsimplified
equations; what is asked is computed.
"""

import pickle
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from kincheck import (
    Body,
    Cylindrical,
    Distance,
    JointDisplacement,
    Mechanism,
    Point,
    PointMotion,
    Ramp,
    Revolute,
    Screw,
    SolveError,
    Translational,
    cases,
    solve,
)
from kincheck.core.kinematics import styles
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import RATE, RATE_T, Request
from kincheck.core.trajectory import Motions

from ..oracles import naive
from ..support.examples import examples
from ..support.mechanisms import (
    ORIGIN,
    Y,
    errors,
    four_bar,
    mcpherson,
    slider_crank,
    solve_all,
    swapped,
    without_fixed_bodies,
)

(BAD_ARGUMENTS,) = examples(__file__, "bad_arguments")
STROKES = np.linspace(-0.08, 0.08, 161)
MOVING = ("lca", "knuckle", "strut")


@cache
def reference():
    """Columns by name, shape (161,) each."""
    table = np.genfromtxt(
        Path(__file__).parents[1] / "data" / "mcpherson_reference.csv",
        delimiter=",",
        names=True,
        skip_header=2,
    )
    assert table.shape == (161,)
    return {name: table[name] for name in table.dtype.names}


@cache
def solution(style="native"):
    return solve_all(mcpherson(), "stroke", STROKES, bodies=MOVING, style=style)


def deviation(found, *columns):
    return np.abs(found - np.column_stack([reference()[name] for name in columns])).max()


# Against the reference


@pytest.mark.parametrize("style", styles())
def test_wheel_against_reference(style):
    """Round-off of numbers near one, amplified by the condition (36) and the second derivatives (3
    1/m).
    """
    wheel = solution(style).points["wheel"]
    assert deviation(wheel.position, "x_W", "y_W", "z_W") <= 5e-16
    assert deviation(wheel.velocity[:, :2], "vx", "vy") <= 1e-14
    assert deviation(wheel.acceleration[:, :2], "ax", "ay") <= 1e-13
    assert np.abs(wheel.velocity[:, 2] - 1.0).max() <= 1e-15
    assert np.abs(wheel.acceleration[:, 2]).max() <= 1e-14


@pytest.mark.parametrize("style", styles())
def test_knuckle_against_reference(style):
    """The body's own frame, in the paper's variables: its origin is the wheel centre."""
    knuckle = solution(style).bodies["knuckle"]
    assert deviation(knuckle.r, "x_W", "y_W", "z_W") <= 5e-16
    assert deviation(knuckle.p, "e0", "e1", "e2", "e3") <= 1e-15
    assert np.abs(np.linalg.norm(knuckle.p, axis=1) - 1.0).max() <= 5e-16


def test_strut_iterations_and_residual():
    found = solution()
    assert found.iterations.max() <= 4
    assert found.iterations.min() >= 1
    assert found.residual <= 1e-15
    assert found.message == ""


# Against the unsimplified equations


def jack():
    """A nut on a screw askew, and a slider that it moves by a rod."""
    return Mechanism(
        "jack",
        [
            Body("screw", (0.1, 0.0, 0.2)),
            Body("nut", (0.5, 0.1, 0.0), (0.8, 0.0, 0.6, 0.0)),
            Body("slider", (1.5, 0.4, 0.0)),
        ],
        [
            Revolute("bearing", "ground", "screw", ORIGIN, (1.0, 0.2, 0.1)),
            Screw("thread", "screw", "nut", (0.3, 0.06, 0.03), (1.0, 0.2, 0.1), 0.15),
            Cylindrical("keeper", "ground", "nut", (0.0, 0.3, 0.0), (1.0, 0.2, 0.1)),
            Distance("rod", "nut", "slider", ((0.4, 0.1, 0.1), (1.4, 0.4, 0.0))),
            Translational("guide", "ground", "slider", (1.5, 0.4, 0.0), (1.0, 0.5, 0.0)),
        ],
        [Point("end", "slider", (1.5, 0.4, 0.0))],
        [replace(four_bar().driver("turn"), joint="bearing")],
    )


cardan = cases.load("double_cardan")
SWEEPS = {
    "jack": (jack, "turn", np.linspace(-8.0, 6.0, 3)),
    "mcpherson": (mcpherson, "stroke", np.linspace(-0.08, 0.06, 3)),
    "slider_crank": (slider_crank, "turn", np.linspace(-4.0, 9.0, 3)),
    "four_bar": (four_bar, "turn", np.linspace(-4.0, 9.0, 3)),
    "double_cardan": (lambda: cardan.mechanism, cardan.sweep.driver, np.linspace(-4.0, 9.0, 3)),
}


# Every mechanism in every style; each mechanism and each style as given, and swapped.
WRITTEN = [
    pytest.param(
        name,
        swapped if (row + column) % 2 else None,
        style,
        id=f"{name}-{'swapped' if (row + column) % 2 else 'as given'}-{style}",
    )
    for row, name in enumerate(SWEEPS)
    for column, style in enumerate(styles())
]


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("name", "write", "style"), WRITTEN)
def test_paper_equations_hold(name, write, style):
    """Residuals of all joints at the solved poses, and their first two derivatives by time along r,
    p, v and a.

    omega' and its derivative enter through pdot and pddot: another frame or sign of theirs would
    show. All joints hold undriven, so every derivative is zero; redundant rows are among them.
    """
    make, driver, values = SWEEPS[name]
    mechanism = write(make()) if write else make()
    bodies = [body.name for body in mechanism.moving]
    found = solve_all(mechanism, driver, values, rate=1.3, bodies=bodies, style=style)
    for k in range(len(values)):
        path = naive.along(naive.sample(found, k))
        phi, phi_t, phi_tt = naive.taylor(lambda t, path=path: naive.residuals(mechanism, path(t)))
        # some roundings of coordinates of 2 m
        assert np.abs(naive.residuals(mechanism, path(0.0))).max() <= 4e-15
        assert np.abs(phi).max() <= 4e-15
        # speeds reach 4 m/s, accelerations 10 m/s^2; the circle of 0.1 s costs one and two digits
        assert np.abs(phi_t).max() <= 1e-13
        assert np.abs(phi_tt).max() <= 1e-11


def test_paper_equations_find_wrong_rates():
    """The check above has teeth: omega' in the wrong frame or with the wrong sign breaks it by
    orders of magnitude.
    """
    mechanism, found = mcpherson(), solution()
    r, p, v, a = naive.sample(found, 0)["knuckle"]
    A = naive.A(p)
    for part, rates, seconds in (
        (1, np.r_[v[:3], A @ v[3:]], a),
        (1, np.r_[v[:3], -v[3:]], a),
        (2, v, np.r_[a[:3], A @ a[3:]]),
    ):
        path = naive.along(naive.sample(found, 0) | {"knuckle": (r, p, rates, seconds)})
        parts = naive.taylor(lambda t, path=path: naive.residuals(mechanism, path(t)))
        assert np.abs(parts[part]).max() > 1e-2


def test_points_follow_bodies():
    """Position, velocity and acceleration of a point by the bodies' r, p, omega' alone."""
    mechanism, found = mcpherson(), solution()
    arm = naive.arm(naive.design(mechanism)["knuckle"], mechanism.point("rod_end").position)
    for k in range(0, 161, 20):
        r, p, v, a = naive.sample(found, k)["knuckle"]
        A, w, w_t = naive.A(p), naive.tilde(v[3:]), naive.tilde(a[3:])
        rod_end = found.points["rod_end"]
        assert rod_end.position[k] == pytest.approx(r + A @ arm, abs=5e-16)
        assert rod_end.velocity[k] == pytest.approx(v[:3] + A @ w @ arm, abs=5e-15)
        assert rod_end.acceleration[k] == pytest.approx(a[:3] + A @ (w_t + w @ w) @ arm, abs=5e-14)


# A solution has what is asked for and no more, and bad arguments are refused


# What is asked for, and no more


def flops(found):
    return {name: size["flops"] for name, size in found.details["program"].items()}


def test_lower_orders_cost_less():
    by_order = [
        solve(mcpherson(), "stroke", STROKES, bodies=MOVING, order=order) for order in (0, 1, 2)
    ]
    position, velocity, acceleration = by_order
    # all are predicted by rates and accelerations, and end at the same pose but for its rounding
    wheel, strut = acceleration.points["wheel"], acceleration.bodies["strut"]
    for found in by_order:
        assert (found.iterations == acceleration.iterations).all()
        off = errors(found.points["wheel"], [wheel.position, wheel.velocity, wheel.acceleration])
        assert (off <= [3e-16, 2e-15, 0.0][: len(off)]).all()
        assert np.abs(found.bodies["strut"].p - strut.p).max() <= 3e-16
    assert position.points["wheel"].velocity is None
    assert position.bodies["strut"].v is None
    assert velocity.points["wheel"].acceleration is None
    assert velocity.bodies["strut"].a is None
    assert np.abs(velocity.bodies["strut"].v - strut.v).max() <= 2e-15
    cost = [sum(flops(found).get(name, 0) for name in ("newton", "outputs")) for found in by_order]
    assert cost[0] < cost[1] < cost[2]
    for order, wanted in enumerate([set(), {RATE}, {RATE, RATE_T}]):
        model = compile_model(mcpherson(), Request(("stroke",), (), MOVING, order=order))
        put_out = model.programs["outputs"].outputs.keys()
        assert {name for name in (RATE, RATE_T) if put_out & {*model.vectors[name]}} == wanted


@pytest.mark.parametrize("style", styles())
def test_fixed_bodies_cost_nothing(style):
    """Chassis and rack as fixed bodies, or as the ground itself: the same programs, the same
    bits.
    """
    free, fixed = (
        solve(each, "stroke", STROKES, style=style)
        for each in (without_fixed_bodies(mcpherson()), mcpherson())
    )
    assert flops(free) == flops(fixed)
    assert (free.points["wheel"].position == fixed.points["wheel"].position).all()
    assert free.details["rank"] == fixed.details["rank"]


def test_ground_as_either_body():
    """Which body of a joint is the fixed one costs nothing either."""
    m = mcpherson()
    turned = [
        joint.reversed() if any(map(m.is_fixed, joint.bodies)) else joint for joint in m.joints
    ]
    assert sum(joint is not other for joint, other in zip(turned, m.joints, strict=True)) == 3
    assert flops(solve(replace(m, joints=turned), "stroke", [0.0])) == flops(
        solve(m, "stroke", [0.0])
    )


def test_solution_has_requested_names_only():
    everything = solve(mcpherson(), "stroke", [0.0, 0.01], bodies=MOVING)
    little = solve(mcpherson(), "stroke", [0.0, 0.01], points=["rod_end"])
    nothing = solve(mcpherson(), "stroke", [0.0, 0.01], points=[])
    assert [(set(each.points), set(each.bodies)) for each in (everything, little, nothing)] == [
        ({"wheel", "rod_end"}, set(MOVING)),
        ({"rod_end"}, set()),
        (set(), set()),
    ]
    assert flops(nothing)["outputs"] < flops(little)["outputs"] < flops(everything)["outputs"]
    assert flops(nothing)["newton"] == flops(everything)["newton"]


def test_fixed_bodies_stay():
    top = Point("top", "chassis", (1.0, 0.55, 0.6))
    mechanism = replace(mcpherson(), points=[*mcpherson().points, top])
    found = solve(mechanism, "stroke", [-0.05, 0.05], points=["top"], bodies=["rack"])
    top, rack = found.points["top"], found.bodies["rack"]
    assert (np.hstack([top.position, rack.r]) == (1.0, 0.55, 0.6, 1.14, 0.0, 0.1455)).all()
    assert not np.hstack([top.velocity, top.acceleration, rack.v, rack.a]).any()


def test_motions_are_lazy_views():
    table = np.arange(12.0).reshape(2, 6)
    motions = Motions(PointMotion, table, {"P": [slice(0, 3), slice(3, 6), None]})
    assert (list(motions), len(motions), "Q" in motions) == (["P"], 1, False)
    motion = pickle.loads(pickle.dumps(motions))["P"]
    assert (motion.position == table[:, :3]).all()
    assert (motion.velocity == table[:, 3:]).all()
    assert motion.acceleration is None
    assert np.shares_memory(motions["P"].velocity, table)
    with pytest.raises(KeyError, match="Q"):
        motions["Q"]


@pytest.mark.parametrize("name", ["rssr", "four_bar", "iftomm_n_four_bar"])
def test_solve_without_samples(name):
    """Also where rows are left out, which may be chosen anew."""
    case = cases.load(name)
    found = solve(case.mechanism, case.sweep.driver, [])
    assert found.solved.shape == (0,)
    assert {motion.position.shape for motion in found.points.values()} == {(0, 3)}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *BAD_ARGUMENTS,
        ({"values": [1j]}, r"values are \[1j\], expected numbers"),
        ({"motions": {"stroke": Ramp(1.0)}}, "motions has 'stroke', which is swept; leave it out"),
        ({"motions": {"steer": Ramp(1.0)}}, "there is no driver 'steer'"),
    ],
    ids=str,
)
def test_solve_refuses_bad_arguments(arguments, message):
    with pytest.raises(SolveError, match=message):
        solve(mcpherson(), **({"driver": "stroke", "values": [0.0, 0.1]} | arguments))


# More than one driver: those that are not swept hold their design value


def steered():
    """The strut with a rack that can slide."""
    base = mcpherson()
    rack = Translational("rack_guide", "chassis", "rack", (1.14, 0.0, 0.1455), Y)
    bodies = [replace(body, fixed=body.name == "chassis") for body in base.bodies]
    return replace(
        base,
        bodies=bodies,
        joints=[*base.joints, rack],
        drivers=[*base.drivers, JointDisplacement("steer", "rack_guide")],
    )


def test_held_driver_keeps_value():
    held = solve(steered(), "stroke", STROKES)
    fixed = solve(mcpherson(), "stroke", STROKES)
    wheel = fixed.points["wheel"]
    expected = wheel.position, wheel.velocity, wheel.acceleration
    assert (errors(held.points["wheel"], expected) <= [5e-16, 1e-14, 1e-13]).all()


def test_driven_displacement():
    """Steering with the stroke held: the rack moves as driven, all joints hold, the wheel keeps its
    height.
    """
    mechanism, values = steered(), np.linspace(-0.03, 0.05, 9)
    bodies = [body.name for body in mechanism.moving]
    found = solve_all(mechanism, "steer", values, rate=0.2, bodies=bodies)
    rack = found.bodies["rack"]
    assert rack.r - (1.14, 0.0, 0.1455) == pytest.approx(np.outer(values, Y), abs=1e-16)
    assert rack.v == pytest.approx(np.tile((0.0, 0.2, 0.0, 0.0, 0.0, 0.0), (9, 1)), abs=1e-15)
    assert np.abs(found.points["wheel"].position[:, 2] - 0.101).max() <= 2e-16
    for k in range(len(values)):
        path = naive.along(naive.sample(found, k))
        parts = naive.taylor(lambda t, path=path: naive.residuals(mechanism, path(t)))
        largest = [np.abs(part).max() for part in parts]
        assert (np.array(largest) < [2e-15, 1e-13, 1e-11]).all()


def test_drivers_in_either_order():
    """Whichever is swept, the other follows, and both end at the same pose."""
    one = solve_all(steered(), "stroke", [0.03], motions={"steer": Ramp(2.0 / 3.0)})
    other = solve_all(steered(), "steer", [0.02], motions={"stroke": Ramp(1.5)})
    ends = [each.points["rod_end"].position for each in (one, other)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-14)
