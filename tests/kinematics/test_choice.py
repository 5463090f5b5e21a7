"""Rows chosen anew where those chosen at the design come to depend on each other, and the mechanism
is regular.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.cases import bennett
from kincheck.cases.jet import Jet
from kincheck.core import Body, JointAngle, Mechanism, Point, Revolute, Universal
from kincheck.core.kinematics.compiled.compiled_model import recent_model
from kincheck.core.kinematics.compiled.request import SIGMA, Request
from kincheck.core.kinematics.compiled.samples import Route
from kincheck.core.kinematics.continuation import row_exchange, segments, singular_samples, sweep
from kincheck.core.kinematics.continuation.row_exchange import Choice, chosen
from kincheck.core.kinematics.continuation.segments import Followed
from kincheck.core.kinematics.continuation.side_follower import SideWalk
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import march
from kincheck.core.kinematics.diagnosis.conditioning import conditioning
from kincheck.core.kinematics.one_design import solve
from kincheck.core.mechanism.motions import Path, Ramp, Sine

from .test_chain import chain
from .test_redundancy import LEFT, locomotive
from .test_singular import BRANCH, chain_end

ALONG = np.pi / 2.0
"""Turn of the Bennett loop at which the rows chosen at the design depend on each other; the other
is at three times as much.
"""
DEAD = np.pi - LEFT
"""Turn of the locomotive at which a rod is at its dead point, of which rows were chosen."""


def loop():
    return cases.load("bennett").mechanism


def errors(found, turn, turn_t=1.0, turn_tt=0.0):
    """Largest errors of position, velocity and acceleration over the points of the Bennett loop."""
    truth = bennett.motion(Jet(turn, turn_t + 0.0 * turn, turn_tt + 0.0 * turn))
    largest = []
    for order, name in (("x", "position"), ("v", "velocity"), ("a", "acceleration")):
        expected = {
            point: np.stack([getattr(jet, order) for jet in jets], axis=1)
            for point, jets in truth.items()
        }
        largest.append(
            max(
                np.abs(getattr(found.points[point], name) - values).max()
                for point, values in expected.items()
            )
        )
    return np.array(largest)


@pytest.mark.parametrize("style", ["native", "paper", "conventional", "mixed", "relative"])
def test_a_bennett_loop_round_and_round(style):
    turn = np.linspace(-3.5, 7.5, 111)
    found = solve(loop(), "turn", turn, style=style)
    assert found.solved.all(), found.message
    assert (errors(found, turn) <= [1e-13, 1e-11, 1e-9]).all()
    assert found.details["rows_chosen_anew"] >= 2
    assert not {"notes", "singular_poses", "retried_samples"} & set(found.details)


@pytest.mark.parametrize(("order", "compiled"), [(0, True), (1, False), (2, True), (2, False)])
def test_where_the_rows_of_the_design_are_singular(order, compiled):
    """At the pose itself and beside it; it is regular, and no digits are lost."""
    turn = ALONG + np.array([-1e-3, -1e-6, -1e-12, 0.0, 1e-12, 1e-6, 1e-3])
    model = recent_model(loop(), Request(("turn",), ("tracer",), order=order, compiled=compiled))
    found = follow(Route(model, Path({"turn": Ramp(1.0)}, turn)), 1e-12)
    assert found.solved.all(), found.message
    assert "notes" not in found.details
    jets = bennett.motion(Jet(turn, np.ones(7), np.zeros(7)))["tracer"]
    motion = found.points["tracer"]
    for name, label in (("position", "x"), ("velocity", "v"), ("acceleration", "a"))[: order + 1]:
        assert (
            np.abs(
                getattr(motion, name) - np.stack([getattr(jet, label) for jet in jets], axis=1)
            ).max()
            <= 1e-13
        )


def test_on_the_way_to_the_first_sample():
    """A motion that is beyond the pose at its beginning: the way there leads over it."""
    path = Path({"turn": Sine(2.0, 0.16, 1.2)}, np.linspace(0.0, 7.0, 71))
    model = recent_model(loop(), Request(("turn",), ("crank_pin", "follower_pin", "tracer")))
    found = follow(Route(model, path), 1e-12)
    assert found.solved.all(), found.message
    value, rate, second = path.drive(["turn"], path.times)[:, 0]
    assert value[0] > ALONG
    assert (errors(found, value, rate, second) <= [1e-13, 1e-11, 1e-9]).all()


@pytest.mark.parametrize("near", [1e-2, 1e-3, 1e-5, 0.0])
def test_a_last_sample_near_there_has_its_digits(near):
    """Nothing ends the motion before it; rows chosen there are better, for accelerations long
    before anything is in doubt.
    """
    turn = np.array([0.0, 1.0, DEAD - near])
    found = solve(locomotive(np.pi / 2.0), "turn", turn)
    assert found.solved.all(), found.message
    rim = np.column_stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), 0.0 * turn])
    assert np.abs(found.points["rim"].position - rim - [2.0, 0.0, 0.0]).max() <= 1e-14
    assert np.abs(found.points["rim"].acceleration + rim).max() <= 1e-12
    assert found.details["rows_chosen_anew"] == 1
    assert found.details["smallest_singular_value"] > 0.05


def test_a_mechanism_that_is_singular_itself_is_followed_as_before():
    found = solve(locomotive(np.pi), "turn", np.linspace(0.0, 4.0, 33))
    assert "(bifurcation)" in found.details["notes"][0]
    assert "rows_chosen_anew" not in found.details


@pytest.mark.parametrize(
    ("first", "turn"), [(1.0, np.linspace(0.0, 4.0, 41)), (1.8, np.array([0.0, 1.0, BRANCH, 4.0]))]
)
def test_a_singular_pose_is_passed_by_the_rows_that_were_chosen_before_it(first, turn):
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
    found = solve(both, "turn", turn, motions={"lean": Ramp(1.0)})
    assert found.solved.all(), found.message
    rim = np.column_stack([2.0 + 0.5 * np.cos(turn), 0.5 * np.sin(turn), 0.0 * turn])
    assert np.abs(found.points["rim"].position - rim).max() <= 1e-12
    assert np.abs(found.points["end"].position - chain_end(1, turn)[0]).max() <= 1e-12
    assert found.details["rows_chosen_anew"] >= 1
    assert [pose["kind"] for pose in found.details["singular_poses"]] == ["bifurcation"]


def test_no_more_often_than_so(monkeypatch):
    """Then the motion ends, or is refused, and says that it was the choice of rows."""
    turn = np.linspace(0.0, 3.0, 31)
    monkeypatch.setattr(segments, "MOST", 0)
    found = solve(loop(), "turn", turn)
    assert not found.solved.all()
    assert "the mechanism is regular there" in found.message


def test_few_samples_are_tried_in_vain(monkeypatch):
    tried, found, renew = list[float](), list[int](), Followed.renew
    monkeypatch.setattr(
        Choice, "anew", lambda self, route, lane: tried.append(lane[route.model.slots["from time"]])
    )
    monkeypatch.setattr(
        Followed,
        "renew",
        lambda self, lanes: tried.clear() or renew(self, lanes) or found.append(len(tried)),
    )
    monkeypatch.setattr(segments, "WITHOUT", 3)
    solve(locomotive(np.pi / 2.0), "turn", DEAD - np.linspace(1e-3, 1e-4, 9))
    assert found == [3]


def test_a_sample_in_question_only_that_is_not_reached_again_stays(monkeypatch):
    monkeypatch.setattr(Followed, "visit", lambda self, samples: {})
    turn, question = np.append(0.0, DEAD - np.geomspace(1.0, 1e-2, 12)), segments.in_question
    found = list[int]()
    monkeypatch.setattr(
        segments,
        "in_question",
        lambda *a, **k: found.append(question(*a, **k).sum()) or question(*a, **k),
    )
    assert solve(locomotive(np.pi / 2.0), "turn", turn).solved.all()
    assert found[0] >= 1


def test_what_cannot_be_better_is_asked_once(monkeypatch):
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


def test_the_best_rows_known_are_taken_again_where_they_are_good_enough():
    matrix = np.array([[1.0, 0.0], [0.0, 1e-3], [0.0, 1.0], [0.0, 0.2]])
    drivers, none = 0, ()
    assert chosen(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 2)
    assert chosen(matrix, [(0, 1), (0, 2)], drivers, none) == (0, 2)
    matrix[3, 1] = 0.5
    assert chosen(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 3)
    # there are not two
    assert chosen(np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1e-17]]), [(0, 1)], drivers, none) == (
        0,
        1,
    )


def test_a_pose_that_other_rows_lead_away_from_is_not_taken():
    """What rows chosen anew make of a pose is near it, or it is another."""
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.0, 1.5])))
    lane = march(route, 1e-12, visit={1}).visited[1]
    standing = Choice(model).anew(route, lane)
    assert standing is None  # none are better there
    beside = replace(route, path=Path({"turn": Ramp(1.0)}, np.array([0.0, ALONG - 1e-3])))
    lane = march(beside, 1e-12, visit={1}).visited[1]
    standing = Choice(model).anew(beside, lane)
    assert standing is not None
    before = {name: lane[model.vectors[f"from {name}"]] for name in model.state}
    sample = beside.sampled(np.array([ALONG - 1e-3]))
    assert row_exchange._standing(standing.model, before, sample, 1e-6) is not None
    off = {name: value + 1e-3 * (name == "u coupler") for name, value in before.items()}
    assert row_exchange._standing(standing.model, off, sample, 1e-6) is None


def test_a_pose_that_contradicts_other_rows_is_not_taken(monkeypatch):
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
    assert row_exchange._standing(model, state, sample, 1.0) is not None
    monkeypatch.setattr(row_exchange, "CONSISTENT", 1e-12)
    assert row_exchange._standing(model, state, sample, 1.0) is None


@pytest.mark.parametrize("part", [2.0, 4.0])
def test_a_sample_is_taken_again_only_where_it_is_much_farther_from_singular(part, monkeypatch):
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.1, 0.2, 0.3])))
    found = march(route, 1e-12)
    sigma, other = model.rows[SIGMA].start, np.full_like(found.kept, 7.0)
    other[sigma] = part * found.kept[sigma]
    monkeypatch.setattr(segments, "march", lambda *_, **__: found._replace(kept=other))
    whole = Followed(route, found._replace(kept=found.kept.copy()), 1e-12)
    whole._follow(route, np.arange(3))
    assert (whole.found.kept[0] == 7.0).tolist() == [part > 3.0] * 3
    assert whole.part_of.tolist() == [int(part > 3.0)] * 3


def test_other_rows_are_looked_for_before_a_step_is_divided_down_to_the_pose(monkeypatch):
    """Down to where nothing is seen through rounding takes thirty parts each time."""
    divided, divide = list[float](), SideWalk._divided
    monkeypatch.setattr(
        SideWalk, "_divided", lambda self, *where: divided.append(1.0) or divide(self, *where)
    )
    turn = np.linspace(0.0, 2.0 * np.pi, 73)

    def parts():
        divided.clear()
        assert solve(loop(), "turn", turn).details["rows_chosen_anew"] >= 3
        return len(divided)

    soon = parts()
    for module in (sweep, segments):
        monkeypatch.setattr(module, "LOW", 0.0)
    assert 2 * soon < parts()


def test_a_diagnosis_follows_the_sign_of_the_determinant_over_a_bifurcation():
    turn = np.linspace(0.0, 3.0, 31)
    found = conditioning(chain(1), Path({"turn": Ramp(1.0)}, turn), turn, ["end"], [], 31, 1e-12)
    assert [pose.orientation for pose in found.poses] == [
        1.0 if value < BRANCH else -1.0 for value in turn
    ]


def test_a_diagnosis_knows_no_singular_pose_there():
    turn = np.linspace(0.0, 2.0 * np.pi, 41)
    found = conditioning(loop(), Path({"turn": Ramp(1.0)}, turn), turn, ["tracer"], [], 41, 1e-12)
    assert [pose.orientation for pose in found.poses] == [1.0] * 41
    assert min(pose.smallest for pose in found.poses) > 0.03
    assert len({tuple(pose.owners) for pose in found.poses}) > 1


@pytest.mark.parametrize(
    ("style", "off"),
    [
        *((style, off) for style in ("native", "relative") for off in (0.003, 0.0044, 0.008)),
        ("paper", 0.003),
        ("conventional", 0.0044),
        ("mixed", 0.008),
    ],
)
def test_a_spherical_kite_beside_its_corner(off, style):
    """Rod and rocker are alike, crank and ground nearly so: beside the corner all rows are nearly
    singular, those kept more so.
    """
    alike, ground = 0.98, 0.72

    def turned(axis, angle, vector):
        return (
            vector * np.cos(angle)
            + np.cross(axis, vector) * np.sin(angle)
            + axis * (axis @ vector) * (1.0 - np.cos(angle))
        )

    first, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    last = turned(up, ground, first)

    def pose(angle):
        pin = turned(first, angle, turned(up, ground + off, first))
        mean, across = pin + last, np.cross(pin, last)
        along = np.cos(alike) / (1.0 + pin @ last)
        return pin, along * mean + np.sqrt(
            (1.0 - along**2 * (mean @ mean)) / (across @ across)
        ) * across

    pin, meet = (tuple(each.tolist()) for each in pose(0.9))
    joints = [
        Revolute("first", "ground", "crank", (0.0, 0.0, 0.0), tuple(first.tolist())),
        Revolute("last", "ground", "rocker", tuple(last.tolist()), tuple(last.tolist())),
        Revolute("pin", "crank", "rod", pin, pin),
        Universal("meet", "rod", "rocker", meet, (meet, tuple(np.cross(pin, meet).tolist()))),
    ]
    bodies = [Body(name) for name in ("crank", "rod", "rocker")]
    kite = Mechanism(
        "kite", bodies, joints, [Point("meet", "rocker", meet)], [JointAngle("turn", "first")]
    )
    turn = np.linspace(0.0, -6.28, 14)
    found = solve(kite, "turn", turn, style=style, order=0)
    assert found.solved.all(), found.message
    assert (
        np.abs(found.points["meet"].position - [pose(0.9 + each)[1] for each in turn]).max() < 1e-10
    )
