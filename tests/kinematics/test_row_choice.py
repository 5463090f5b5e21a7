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
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.diagnosis.conditioning import conditioning
from kincheck.core.kinematics.formulation.constraints import Style
from kincheck.core.kinematics.one_design import solve
from kincheck.core.mechanism.motions import Path, Ramp, Sine

from ..support.mechanisms import BRANCH, ORIGIN, Z, chain, chain_end, errors, solve_all
from .test_redundancy import LEFT, locomotive, rim

STYLES = [style.value for style in Style]
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


def test_bifurcation_exchanges_no_rows():
    found = solve(locomotive(np.pi), "turn", np.linspace(0.0, 4.0, 33))
    assert "(bifurcation)" in found.details["notes"][0]
    assert "rows_chosen_anew" not in found.details


@pytest.mark.parametrize(
    ("first", "turn"), [(1.0, np.linspace(0.0, 4.0, 41)), (1.8, np.array([0.0, 1.0, BRANCH, 4.0]))]
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


def test_conditioning_orientation_over_bifurcation():
    turn = np.linspace(0.0, 3.0, 31)
    found = conditioning(chain(1), Path({"turn": Ramp(1.0)}, turn), turn, ["end"], {}, 31, 1e-12)
    assert [pose.orientation for pose in found.poses] == [
        1.0 if value < BRANCH else -1.0 for value in turn
    ]


def test_conditioning_at_dependent_rows():
    turn = np.linspace(0.0, 2.0 * np.pi, 41)
    found = conditioning(loop(), Path({"turn": Ramp(1.0)}, turn), turn, ["tracer"], {}, 41, 1e-12)
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
def test_spherical_kite_beside_corner(off, style):
    """Rod and rocker are alike, crank and ground nearly so: beside the corner all rows are nearly
    singular, those kept more so.
    """
    alike, ground = 0.98, 0.72

    last = np.array([np.sin(ground), 0.0, np.cos(ground)])

    def pose(angle):
        over = np.sin(ground + off)
        pin = np.array([over * np.cos(angle), over * np.sin(angle), np.cos(ground + off)])
        mean, across = pin + last, np.cross(pin, last)
        along = np.cos(alike) / (1.0 + pin @ last)
        return pin, along * mean + np.sqrt(
            (1.0 - along**2 * (mean @ mean)) / (across @ across)
        ) * across

    pin, meet = (tuple(each.tolist()) for each in pose(0.9))
    joints = [
        Revolute("first", "ground", "crank", ORIGIN, Z),
        Revolute("last", "ground", "rocker", tuple(last.tolist()), tuple(last.tolist())),
        Revolute("pin", "crank", "rod", pin, pin),
        Universal("meet", "rod", "rocker", meet, (meet, tuple(np.cross(pin, meet).tolist()))),
    ]
    bodies = [Body(name) for name in ("crank", "rod", "rocker")]
    kite = Mechanism(
        "kite", bodies, joints, [Point("meet", "rocker", meet)], [JointAngle("turn", "first")]
    )
    turn = np.linspace(0.0, -6.28, 14)
    found = solve_all(kite, "turn", turn, style=style, order=0)
    assert errors(found.points["meet"], [[pose(0.9 + each)[1] for each in turn]])[0] < 1e-10
