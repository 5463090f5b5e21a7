"""Components solved one after the other: the same motions as all at once, whatever the mechanism,
and programs are shared.
"""

import math
import random
from dataclasses import dataclass, replace
from pathlib import Path as File

import numpy as np
import pytest
from kincheck import (
    Body,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Ramp,
    Revolute,
    Sine,
    SolveError,
    Spherical,
)
from kincheck.core import primitives
from kincheck.core.case.io.case_file import load_case
from kincheck.core.extensions.blocks.component_lanes import LANES, ComponentLanes
from kincheck.core.extensions.blocks.sweep import WORST
from kincheck.core.kinematics import Method, NativeSolver
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import FROM, SIGMA, TIME, Request
from kincheck.core.kinematics.continuation.walk import HALVINGS, part_of_step
from kincheck.core.mechanism.motions import Path
from kincheck.core.program import MARGIN

from ...support.block_structures import (
    assert_alike,
    chain_of_hinges,
    solve_components,
    with_one_program,
)
from ...support.examples import examples
from ...support.mechanisms import (
    LEAN,
    ORIGIN,
    Y,
    Z,
    chain,
    chain_end,
    circles_meet,
    errors,
    placed,
    solve_all,
)

(COMPONENTS,) = examples(__file__, "components")


def test_singular_pose_before_sweep_is_reported():
    path = Path({"turn": Sine(2.4, 1e-2, np.pi / 2.0)}, np.linspace(2.0, 3.0, 5))
    solve = NativeSolver(method=Method.BY_COMPONENTS).prepare(chain(6), path, ("end",))
    told = [solve(1e-12).details["notes"] for _ in range(2)]
    assert told[0] == told[1]
    assert "crosses a singular pose near turn = 1.870" in told[0][0]


def test_fixed_bodies_beside_components():
    m = chain(2)
    still = Body("frame", fixed=True, origin=(0.5, 0.0, 0.0))
    mark = Point("mark", "frame", (1.0, 2.0, 3.0))
    m = replace(m, bodies=[*m.bodies, still], points=[*m.points, mark])
    path = Path({"turn": Ramp(1.0)}, np.array([0.0, 0.2]))
    found = solve_components(m, path, ("mark",), ("frame",))
    assert found.solved.all()
    mark, frame = found.points["mark"], found.bodies["frame"]
    given = np.hstack([mark.position, mark.velocity, mark.acceleration, frame.r, frame.p])
    assert (given == [1.0, 2.0, 3.0, *[0.0] * 6, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).all()
    assert not np.hstack([frame.v, frame.a]).any()


def test_components_stop_at_last_iteration():
    path = Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.2, 9))
    solver = NativeSolver(last_iteration=np.inf, method=Method.BY_COMPONENTS)
    found = solver.prepare(chain(3), path, ("end",))(np.inf)
    assert (found.iterations == 1).all()
    assert found.residual > 1e-10


def test_equal_components_share_program():
    """Whatever the numbers, those of outputs too."""
    whole = chain(40)
    bodies = [
        replace(body, origin=(float(k), 0.1, 0.0)) for k, body in enumerate(whole.bodies[1:], 1)
    ]
    whole = replace(whole, bodies=[whole.bodies[0], *bodies])
    every = tuple(body.name for body in whole.bodies)
    cascade = ComponentLanes(whole, Request(("turn",), ("end",), every))
    assert len(cascade.parts) == 41
    # the crank, the one with the point, all others
    assert sorted(len(kind.members) for kind in cascade.kinds) == [1, 1, 39]
    assert cascade.details["largest_component"] == 12


def test_equal_driven_components_share_program():
    names = [f"j{k}" for k in range(12)]
    cranks = Mechanism(
        "cranks",
        [Body(f"body {name}") for name in names],
        [
            Revolute(name, "ground", f"body {name}", (k, 0.0, 0.0), Y)
            for k, name in enumerate(names, 1)
        ],
        [Point(f"tip {name}", f"body {name}", (k, 0.0, 1.0)) for k, name in enumerate(names, 1)],
        [JointAngle(f"motor {name}", name) for name in names],
    )
    lanes = ComponentLanes(cranks, Request(tuple(f"motor {name}" for name in names), ("tip j3",)))
    assert len(lanes.kinds) == 12
    assert len({id(kind.model) for kind in lanes.kinds}) == 2  # that with the point, and all others
    path = Path(
        {f"motor {name}": Ramp(0.1 * k) for k, name in enumerate(names, 1)},
        np.linspace(0.0, 3.0, 9),
    )
    found = solve_components(cranks, path, [f"tip {name}" for name in names], ())
    for k, name in enumerate(names, 1):
        angle = 0.1 * k * path.times
        tip = np.stack([k + np.sin(angle), np.zeros(9), np.cos(angle)], axis=1)
        assert np.allclose(found.points[f"tip {name}"].position, tip, rtol=0.0, atol=1e-12)


@dataclass(frozen=True, kw_only=True)
class Tilted(primitives.Spherical):
    """Rows with a plain number, and something beside it."""

    tilt: float
    beside: object

    def phi(self, i, j):
        assert math.cos(self.tilt) > 0.0
        return super().phi(i, j)


@pytest.mark.usefixtures("own_joint_types")
@pytest.mark.parametrize("beside", [tuple, list])
def test_component_joint_settings_stay_numbers(beside):
    @dataclass(frozen=True)
    class Ball(Spherical):
        type = "tilted_ball"
        tilt: float = 0.0

        def primitives(self, i, j):
            return [
                Tilted(s_i=each.s_i, s_j=each.s_j, d0=each.d0, tilt=self.tilt, beside=beside())
                for each in super().primitives(i, j)
            ]

    whole, balls = chain(3), iter(range(3))
    joints = [
        Ball(each.name, *each.bodies, each.point, 0.1 * next(balls))
        if type(each) is Spherical
        else each
        for each in whole.joints
    ]
    path = Path({"turn": Ramp(1.0)}, np.linspace(-1.0, 1.0, 9))
    own, plain = (
        solve_components(replace(whole, joints=each), path, ("end",))
        for each in (joints, whole.joints)
    )
    assert_alike(own, plain)


PATH = Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.3, 10))


def at_design(lanes):
    """Bring lanes to the design position, from where they go along the path."""
    lanes.solve_near(lanes.design, 1e-12)
    lanes.set_prediction_start(0.0, PATH)


def test_walk_follows_as_attempts_do():
    count, request = 2 * LANES + 5, Request(("turn",), ("end",))
    walking, trying = both = [ComponentLanes(chain(3), request) for _ in range(2)]
    for lanes in both:
        at_design(lanes)
    times = np.append(np.linspace(0.005, 0.3, count), [0.3] * LANES)
    walked = walking.walk(walking.sample_tables(times, PATH), count)
    for some in np.split(np.arange(count), [LANES, 2 * LANES]):
        n = len(trying.attempt(times[some], PATH))
        for each, tried in zip(walked, (trying.motions(n), trying.worst[:, :n]), strict=True):
            np.testing.assert_array_equal(each[:, some], tried)
        trying.carry(n - 1)
    ends = [lanes.anchor(0.3).pose for lanes in both]
    for a, b in zip(*ends, strict=True):
        np.testing.assert_array_equal(a, b)
    assert ends[0][0][0, walking.kinds[0].column[FROM + TIME]] == pytest.approx(0.3)


def test_walk_stops_before_doubtful_samples():
    lanes = ComponentLanes(chain(3), Request(("turn",), ("end",)))
    times = np.full(2 * LANES, 0.005)
    # the residual is below both; rounding leaves more than the second in doubt
    for tol, followed in ((1e-12, LANES), (2e-18, 0)):
        at_design(lanes)
        lanes.accept_by({"tolerance": tol})
        assert lanes.attempt(times[:1], PATH) > 0.0
        assert lanes.walk(lanes.sample_tables(times, PATH), LANES)[1].shape[1] == followed


@pytest.mark.parametrize(("part", "compiled"), COMPONENTS)
def test_sample_takes_worst_component(part, compiled):
    """The first, which is driven, any of those that are alike, and the last; what is not a number
    is the worst of all.
    """
    lanes = ComponentLanes(chain(3), Request(("turn",), ("end",), compiled=compiled))
    times = np.linspace(0.005, 0.1, LANES)
    at_design(lanes)
    assert len(lanes.parts) == 4
    assert (lanes.attempt(times, PATH) > 0.0).all()
    np.testing.assert_array_equal(
        lanes.worst[WORST.index("closure")], lanes.each("closure").max(axis=0)
    )
    np.testing.assert_array_equal(lanes.worst[WORST.index(SIGMA)], lanes.each(SIGMA).min(axis=0))
    kind, member = lanes.place[part]
    anchor, model = lanes.anchor(0.0), kind.model
    column = [*model.plan.fixed].index(model.vectors[FROM + "q b0"][0])
    anchor.pose[lanes.kinds.index(kind)][member, column] = np.nan
    lanes.restore(anchor)
    assert not (lanes.attempt(times, PATH) > 0.0).any()
    for name in ("closure", MARGIN):
        assert np.isnan(lanes.worst[WORST.index(name)]).all()


def test_components_without_outputs():
    found = solve_all(chain(30), "turn", np.linspace(0.0, 0.3, 5), points=())
    assert found.details["components"] == 31
    assert not found.points


@pytest.mark.parametrize("lanes", [8, 16])
@pytest.mark.parametrize("part", [1, 2, 7, 8, 9, 14, 15, 16, 17, 30, 31, 39])
def test_step_division_by_any_lanes(part, lanes):
    """Lanes are fewer than the parts of a step: those take turns, and no part counts whose half is
    not reached.
    """
    tried = list[np.ndarray]()

    def attempt(times):
        assert len(times) == lanes
        tried.append(times)
        return np.where(times - 1.0 <= 2.0**-part, 1.0, -1.0)

    lane, time = part_of_step(1.0, 2.0, attempt, lanes)
    assert time == 1.0 + 2.0**-part == tried[-1][lane]
    # that of which no half is tried is no part
    last = lambda times: tried.append(times) or np.where(times - 1.0 <= 2.0**-HALVINGS, 1.0, -1.0)  # noqa: E731
    assert part_of_step(1.0, 2.0, last, lanes) is None
    assert tried[-1][-1] <= 1.0 + 2.0**-HALVINGS


@pytest.mark.parametrize("loops", [1, 5])
def test_chain_through_change_points(loops):
    # through the change points, where the loops could fold over
    turn = np.linspace(-np.pi, np.pi, 37)
    found = solve_all(chain(loops), "turn", turn)
    # round-off grows with the length of the chain, and by the condition near the change points,
    # sampled no nearer than 0.1 rad
    assert errors(found.points["end"], chain_end(loops, turn))[0] <= 1e-13 * loops


def test_chain_cost_grows_linearly():
    sizes = [
        compile_model(chain(loops), Request(("turn",), (), compiled=False)).sizes
        for loops in (4, 8, 12)
    ]
    for name in ("newton", "outputs"):
        one, two, three = (size[name]["flops"] for size in sizes)
        assert two - one == three - two


@pytest.mark.parametrize("seed", [1, 2])
def test_tilted_components_with_redundant_rows(seed):
    """Planar loops of hinges in a tilted plane, in any order: all are solved, whatever rows are
    matched.
    """
    tilt = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    m = placed(chain_of_hinges(22), *[lambda point: tuple((tilt @ point).tolist())] * 2)
    order = random.Random(seed)
    joints, bodies = (order.sample(each, len(each)) for each in (m.joints, m.bodies))
    values = np.array([0.0, 0.2])
    found = solve_all(replace(m, joints=joints, bodies=bodies), "turn", values)
    end = chain_end(22, values)[0] @ tilt.T
    assert found.points["end"].position == pytest.approx(end, abs=1e-13)


# Where a motion by components ends, what it passes, and the component that is named


def test_singular_component_is_named():
    """The second of two four-bars, which cannot turn on; the first one's crank can, and its
    residuals are no larger.
    """
    bodies, joints = [Body("crank")], [Revolute("turn", "ground", "crank", ORIGIN, Z)]
    carrier, start = "crank", 0.0
    for k, (angle, crank, rod, rocker) in enumerate(((1.0, 1.0, 3.2, 2.6), (1.3, 2.0, 3.0, 1.5))):
        pin = (start + crank * np.cos(angle), crank * np.sin(angle), 0.0)
        start += 4.0
        rest = (start, 0.0, 0.0)
        meet = tuple(circles_meet(pin, rod, rest, rocker).tolist())
        bodies += [Body(f"rod{k}"), Body(f"rocker{k}")]
        joints += [
            Revolute(f"a{k}", carrier, f"rod{k}", pin, Z),
            Revolute(f"b{k}", f"rod{k}", f"rocker{k}", meet, Z),
            Revolute(f"c{k}", "ground", f"rocker{k}", rest, Z),
        ]
        carrier = f"rocker{k}"
    mechanism = Mechanism(
        "two loops", bodies, joints, [Point("end", carrier, rest)], [JointAngle("turn", "turn")]
    )
    for values in (np.linspace(0.0, 6.0, 31), [0.0, 3.0], [0.1, 2.0, 4.0]):
        found = solve_components(mechanism, Path({"turn": Ramp(1.0)}, np.array(values)), ("end",))
        assert not found.solved.all()
        assert "the component of rod1, rocker1: there is a singular pose ahead" in found.message


def test_components_refuse_couplers_and_freedom():
    m = chain(2)
    coupled = replace(m, couplers=[Gear("gear", ("pivot0", "pivot1"), ratio=1.0)])
    with pytest.raises(SolveError, match="couplers"):
        ComponentLanes(coupled, Request(("turn",), ()))
    with pytest.raises(SolveError, match="not driven enough"):
        ComponentLanes(replace(m, drivers=[]), Request((), ()))


def test_chain_passes_links_in_line():
    """Every loop may fold there; that the motion goes on is said."""
    loops, turn = 20, np.linspace(-0.1, 2.4, 26)
    found = solve_components(chain(loops), Path({"turn": Ramp(1.0)}, turn), ("end",))
    assert found.solved.all(), found.message
    expected, *_ = chain_end(loops, turn)
    # every loop adds its rounding, over the sine of how far its links are from in line
    rounding = 4.0 * loops * np.finfo(float).eps / np.abs(np.cos(turn - LEAN))
    assert (np.abs(found.points["end"].position - expected).max(axis=1) <= rounding).all()
    (note,) = found.details["notes"]
    assert "crosses a singular pose near turn = 1.870" in note


@pytest.mark.parametrize("name", ["kite", "four_bar_in_one_step"])
def test_components_stop_at_narrow_gap(name):
    """The sample is beyond a gap, or a corner, of less than a thousandth of the step."""
    case = load_case(File(__file__).parents[2] / "data" / "stress" / f"{name}.toml")
    path = case.sweep.path
    found, expected = with_one_program(Method.BY_COMPONENTS, case.mechanism, path, case.points)
    if expected.solved.all():
        assert_alike(found, expected)
    else:
        assert not found.solved.any()
        assert "cannot be followed beyond" in found.message
