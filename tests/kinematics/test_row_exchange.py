"""Rows chosen anew where those chosen at the design come to depend on each other, and the mechanism
is regular.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import Ramp, Sine, cases, solve
from kincheck.cases import Jet, bennett
from kincheck.core.kinematics import styles
from kincheck.core.kinematics.compiled.compiled_model import recent_model
from kincheck.core.kinematics.compiled.request import SIGMA, Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation import segments, singular_samples
from kincheck.core.kinematics.continuation.segments import Followed, choose_rows, with_better_rows
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import SideWalk, follow_samples
from kincheck.core.mechanism.motions import Path

from ..support.mechanisms import BRANCH, chain, chain_end, errors, solve_all
from .test_redundancy import LEFT, locomotive, rim

STYLES = styles()
ALONG = np.pi / 2.0
"""Turn of the Bennett loop at which the rows chosen at the design depend on each other; the other
is at three times as much.
"""
DEAD = np.pi - LEFT
"""Turn of the locomotive at which a rod is at its dead point, of which rows were chosen."""


def loop():
    return cases.load("bennett").mechanism


def bennett_errors(found, turn, turn_t=1.0, turn_tt=0.0):
    """Largest errors of position, velocity and acceleration over the points of the Bennett loop."""
    truth = bennett.motion(Jet(turn, turn_t + 0.0 * turn, turn_tt + 0.0 * turn))
    orders = {
        point: [np.column_stack([getattr(jet, order) for jet in jets]) for order in "xva"]
        for point, jets in truth.items()
    }
    return np.max(
        [errors(found.points[name], orders[name]) for name in found.points if name in orders],
        axis=0,
    )


@pytest.mark.parametrize("style", STYLES)
def test_bennett_loop_over_turns(style):
    turn = np.linspace(-3.5, 7.5, 111)
    found = solve_all(loop(), "turn", turn, style=style)
    assert (bennett_errors(found, turn) <= [1e-13, 1e-11, 1e-9]).all()
    assert found.details["rows_chosen_anew"] >= 2
    assert not {"notes", "singular_poses", "retried_samples"} & set(found.details)


@pytest.mark.parametrize(("order", "compiled"), [(0, True), (1, False), (2, True), (2, False)])
def test_bennett_loop_at_dependent_rows(order, compiled):
    """At the pose itself and beside it; it is regular, and no digits are lost."""
    turn = ALONG + np.array([-1e-3, -1e-6, -1e-12, 0.0, 1e-12, 1e-6, 1e-3])
    model = recent_model(loop(), Request(("turn",), ("tracer",), order=order, compiled=compiled))
    found = follow(Route(model, Path({"turn": Ramp(1.0)}, turn)), 1e-12)
    assert found.solved.all(), found.message
    assert "notes" not in found.details
    assert (bennett_errors(found, turn)[: order + 1] <= 1e-13).all()


def test_row_exchange_before_first_sample():
    """A motion that is beyond the pose at its beginning: the way there leads over it."""
    path = Path({"turn": Sine(2.0, 0.16, 1.2)}, np.linspace(0.0, 7.0, 71))
    model = recent_model(loop(), Request(("turn",), ("crank_pin", "follower_pin", "tracer")))
    found = follow(Route(model, path), 1e-12)
    assert found.solved.all(), found.message
    value, rate, second = path.drive(["turn"], path.times)[:, 0]
    assert value[0] > ALONG
    assert (bennett_errors(found, value, rate, second) <= [1e-13, 1e-11, 1e-9]).all()


@pytest.mark.parametrize("near", [1e-2, 1e-3, 1e-5, 0.0])
def test_last_sample_beside_dependent_rows(near):
    """Nothing ends the motion before it; rows chosen there are better, for accelerations long
    before anything is in doubt.
    """
    turn = np.array([0.0, 1.0, DEAD - near])
    found = solve_all(locomotive(np.pi / 2.0), "turn", turn)
    assert (errors(found.points["rim"], rim(turn)) <= [1e-14, 1e-13, 1e-12]).all()
    assert found.details["rows_chosen_anew"] == 1
    assert found.details["smallest_singular_value"] > 0.05


@pytest.mark.parametrize(
    ("first", "turn"),
    [(1.0, np.linspace(0.0, 4.0, 41)), (1.8, np.array([0.0, 1.0, BRANCH, 4.0]))],
    ids=["before", "after"],
)
def test_bifurcation_after_row_exchange(first, turn):
    """A locomotive that turns over the dead points of its rods, and a chain that branches after the
    first or before.
    """
    loco, arm = locomotive(np.pi / 2.0, first), chain(1)
    both = replace(
        loco,
        bodies=[*loco.bodies, *arm.bodies],
        joints=[*loco.joints, *arm.joints],
        points=[*loco.points, *arm.points],
        drivers=[*loco.drivers, replace(arm.driver("turn"), name="lean")],
    )
    found = solve_all(both, "turn", turn, motions={"lean": Ramp(1.0)})
    assert errors(found.points["rim"], rim(turn))[0] <= 1e-12
    assert errors(found.points["end"], chain_end(1, turn))[0] <= 1e-12
    assert found.details["rows_chosen_anew"] >= 1
    assert [pose["kind"] for pose in found.details["singular_poses"]] == ["bifurcation"]


# When other rows are looked for, how often, and which are taken


def test_row_exchange_stops_at_limit(monkeypatch):
    """Then the motion ends, or is refused, and says that it was the choice of rows."""
    turn = np.linspace(0.0, 3.0, 31)
    monkeypatch.setattr(segments, "MOST", 0)
    found = solve(loop(), "turn", turn)
    assert not found.solved.all()
    assert "the mechanism is regular there" in found.message


def test_limit_of_failed_row_exchanges(monkeypatch):
    tried, found, renew = list[float](), list[int](), Followed.renew
    monkeypatch.setattr(
        segments,
        "with_better_rows",
        lambda route, lane, *_: tried.append(lane[route.model.slots["from time"]]),
    )
    monkeypatch.setattr(
        Followed,
        "renew",
        lambda self, lanes: tried.clear() or renew(self, lanes) or found.append(len(tried)),
    )
    solve(locomotive(np.pi / 2.0), "turn", DEAD - np.linspace(1e-3, 1e-4, 99))
    assert found == [segments.WITHOUT]


def test_unreached_sample_is_kept(monkeypatch):
    monkeypatch.setattr(Followed, "visit", lambda self, samples: {})
    turn, question = np.append(0.0, DEAD - np.geomspace(1.0, 1e-2, 12)), segments.needs_check
    found = list[int]()
    monkeypatch.setattr(
        segments,
        "needs_check",
        lambda *a, **k: found.append(question(*a, **k).sum()) or question(*a, **k),
    )
    assert solve(locomotive(np.pi / 2.0), "turn", turn).solved.all()
    assert found[0] >= 1


def test_dead_centre_is_examined_once(monkeypatch):
    """The Bricard linkage comes near its dead centre, which no choice of rows changes."""
    asked, values = list[int](), singular_samples.smallest_singular_values
    monkeypatch.setattr(
        singular_samples,
        "smallest_singular_values",
        lambda *given: asked.append(1) or values(*given),
    )
    case = cases.load("bricard")
    route = Route(recent_model(case.mechanism, Request(("hinge",), ("P3",))), case.sweep.path)
    first, second = (follow(route, 1e-12) for _ in range(2))
    assert len(asked) == 1
    assert first.details == second.details
    assert "rows_chosen_anew" not in first.details
    follow(route, 1e-13)
    assert len(asked) == 2


def test_known_rows_are_chosen_if_good():
    matrix = np.array([[1.0, 0.0], [0.0, 1e-3], [0.0, 1.0], [0.0, 0.2]])
    drivers, none = 0, ()
    assert choose_rows(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 2)
    assert choose_rows(matrix, [(0, 1), (0, 2)], drivers, none) == (0, 2)
    matrix[3, 1] = 0.5
    assert choose_rows(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 3)
    # there are not two
    assert choose_rows(
        np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1e-17]]), [(0, 1)], drivers, none
    ) == (0, 1)


def test_pose_off_chosen_rows_is_refused():
    """What rows chosen anew make of a pose is near it, or it is another."""
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.0, 1.5])))
    lane = follow_samples(route, 1e-12, visit={1}).visited[1]
    standing = with_better_rows(route, lane, route.path, [model])
    assert standing is None  # none are better there
    beside = replace(route, path=Path({"turn": Ramp(1.0)}, np.array([0.0, ALONG - 1e-3])))
    lane = follow_samples(beside, 1e-12, visit={1}).visited[1]
    standing = with_better_rows(beside, lane, beside.path, [model])
    assert standing is not None
    before = {name: lane[model.vectors[f"from {name}"]] for name in model.state}
    sample = beside.sampled(np.array([ALONG - 1e-3]))
    assert segments._lane_near(standing.model, before, sample, 1e-6) is not None
    off = {name: value + 1e-3 * (name == "u coupler") for name, value in before.items()}
    assert segments._lane_near(standing.model, off, sample, 1e-6) is None


def test_pose_against_redundant_rows_is_refused(monkeypatch):
    """Rows chosen anew leave out others than before: those must hold as well. A hinge is askew by a
    part of what is allowed.
    """
    skew = replace(loop().joint("C"), axis=(4.0 + 1e-9, -3.0, 12.0))
    mechanism = replace(
        loop(), joints=[skew if joint.name == "C" else joint for joint in loop().joints]
    )
    model = recent_model(mechanism, Request(("turn",), ()))
    state = {name: np.array(value) for name, value in model.state.items()}
    sample = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.3]))).sampled(np.array([0.3]))
    assert segments._lane_near(model, state, sample, 1.0) is not None
    monkeypatch.setattr(segments, "CONSISTENT", 1e-12)
    assert segments._lane_near(model, state, sample, 1.0) is None


@pytest.mark.parametrize("part", [2.0, 4.0])
def test_sample_is_replaced_if_more_regular(part, monkeypatch):
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.1, 0.2, 0.3])))
    found = follow_samples(route, 1e-12)
    sigma, other = model.rows[SIGMA].start, np.full_like(found.kept, 7.0)
    other[sigma] = part * found.kept[sigma]
    monkeypatch.setattr(segments, "follow_samples", lambda *_, **__: found._replace(kept=other))
    whole = Followed(route, found._replace(kept=found.kept.copy()), 1e-12)
    whole._follow(route, np.arange(3))
    assert (whole.found.kept[0] == 7.0).tolist() == [part > 3.0] * 3
    assert whole.part_of.tolist() == [int(part > 3.0)] * 3


def test_row_exchange_comes_before_division(monkeypatch):
    """Down to where nothing is seen through rounding takes thirty parts each time."""
    divided, divide = list[float](), SideWalk._divide_step
    monkeypatch.setattr(
        SideWalk, "_divide_step", lambda self, *where: divided.append(1.0) or divide(self, *where)
    )
    found = solve(loop(), "turn", np.linspace(0.0, 2.0 * np.pi, 73))
    assert found.details["rows_chosen_anew"] >= 3
    assert len(divided) <= 10  # 110 where rows are not chosen before
