"""Tracing a motion by its own length: limit points and branch points against closed forms, and what
lies beyond them.
"""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import (
    Body,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    Revolute,
    SolveError,
    Spherical,
    Translational,
)
from kincheck.core.cli.main import main
from kincheck.core.kinematics.continuation.trace import trace

from ..support.mechanisms import A0, B0, C0, CRANK, D0, four_bar, mcpherson, slider_crank
from .test_chain import LEAN, chain

# The strut's limits of travel [m] to 18 digits, by other means than the package's: the six numbers
# of the knuckle's pose in 40 digits close two rods, the arm's axis and the strut's line (as in
# strut_oracle.py), and a secant rule makes the stroke stationary.
LIMITS = {1: 0.293337313746648221, -1: -0.316737084187394147}


def distance(a, b):
    return np.linalg.norm(np.subtract(a, b))


# Limit points


@cache
def strut_curve(direction, style="native"):
    return trace(
        mcpherson(),
        "stroke",
        direction=direction,
        length=5.0 if direction == 1 else 3.0,
        style=style,
    )


@pytest.mark.parametrize(("direction", "style"), [(1, "native"), (-1, "native"), (1, "relative")])
def test_limits_of_the_strut(direction, style):
    """To 1e-9 m and much better; the dip of the condition at +0.26 m on the way is no branch
    point.
    """
    (event,) = strut_curve(direction, style).events
    assert event.kind == "limit point"
    assert event.value == pytest.approx(LIMITS[direction], abs=1e-14)
    assert event.singularity.sigma < 1e-10
    assert "stroke" in event.singularity.owners
    assert {"lca", "knuckle"} <= set(event.singularity.moves)
    assert event.points["wheel"][2] == pytest.approx(0.101 + LIMITS[direction], abs=1e-12)


def test_the_limit_does_not_depend_on_the_steps():
    curve = trace(mcpherson(), "stroke", direction=-1, length=2.5, longest=0.11)
    assert curve.events[0].value == pytest.approx(strut_curve(-1).events[0].value, abs=1e-14)


def test_the_strut_goes_on_beyond():
    curve = strut_curve(-1)
    beyond = np.abs(curve.arc) > abs(curve.events[0].arc)
    assert (np.diff(curve.values[~beyond]) < 0.0).all()
    assert (np.diff(curve.values[beyond]) > 0.0).all()
    assert curve.values == pytest.approx(curve.points["wheel"][:, 2] - 0.101, abs=1e-14)
    assert curve.message == ""
    # the rods keep their lengths, there as before
    lengths = np.linalg.norm(curve.points["rod_end"] - np.array([1.14, 0.355, 0.1455]), axis=1)
    assert lengths == pytest.approx(lengths[0], abs=1e-14)


def test_a_rod_that_is_shorter_than_its_crank():
    """Limits where the rod stands upright; between them the slider takes both places that the crank
    leaves it.
    """
    rod = 0.1
    curve = trace(slider_crank(rod), "turn", length=4.0, longest=0.1)
    limit = np.arcsin(rod / CRANK)
    assert [event.value for event in curve.events] == pytest.approx([limit, -limit], abs=1e-12)
    assert curve.closed
    offset = curve.points["end"][:, 0] - CRANK * np.cos(curve.values)
    # 1e-16 under the root
    assert np.abs(offset) == pytest.approx(
        np.sqrt(rod**2 - (CRANK * np.sin(curve.values)) ** 2), abs=1e-9
    )
    first, second = (event.arc for event in curve.events)
    assert ((offset < 0.0) == ((curve.arc > first) & (curve.arc < second))).all()


def test_a_rocker_that_drives_its_crank():
    """Limits where crank and coupler are in line; the crank goes round, and the curve is closed."""
    rocked = replace(four_bar(), drivers=[replace(four_bar().drivers[0], name="rock", joint="D")])
    curve = trace(rocked, "rock", length=12.0, longest=0.1)
    crank, coupler, rocker, base = (
        distance(A0, B0),
        distance(B0, C0),
        distance(C0, D0),
        distance(A0, D0),
    )

    def angle(reach):
        return np.arccos((base**2 + rocker**2 - reach**2) / (2.0 * base * rocker))

    design = angle(distance(A0, C0))
    assert [event.value for event in curve.events] == pytest.approx(
        [angle(reach) - design for reach in (coupler + crank, coupler - crank)]
    )
    assert curve.closed
    assert curve.values[-1] == pytest.approx(0.0, abs=0.1)


def test_a_limit_at_which_the_curve_branches_too():
    """Bricard's hinge turns back at 30 degrees, folded flat: corrections do not converge there, and
    the limit is interpolated.
    """
    mechanism = cases.load("bricard").mechanism
    curve = trace(mechanism, mechanism.drivers[0].name, length=4.5)
    assert [event.value for event in curve.events] == pytest.approx([np.pi / 6.0], abs=1e-11)


# Branch points


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("loops", [1, 2])
def test_change_points(loops, direction):
    """All links in line: the determinant changes its sign with an odd number of loops, and not with
    an even one.
    """
    curve = trace(chain(loops), "turn", length=4.5, direction=direction, longest=0.1)
    (event,) = curve.events
    assert event.kind == "branch point"
    assert event.value == pytest.approx(LEAN + direction * np.pi / 2.0, abs=1e-11)
    assert "turn" not in event.singularity.owners
    # straight on: the cranks stay parallel
    expected = np.column_stack([loops + np.sin(LEAN - curve.values), np.cos(LEAN - curve.values)])
    assert curve.points["end"][:, :2] == pytest.approx(expected, abs=1e-9)


def test_a_motion_without_singular_poses():
    """A whole turn of a crank, and back at the design."""
    curve = trace(four_bar(), "turn", length=12.0, longest=0.1)
    assert curve.closed
    assert curve.events == ()
    assert curve.values[-1] == pytest.approx(2.0 * np.pi, abs=0.1)
    assert curve.sigma.min() > 0.01


# The closing step and the first one

PAST = [0.0, 1e-5, 0.002, 0.04]
"""How far the design is past a singular pose [rad]; zero stands for one that is nearer than a
millionth.
"""
BOTH_SIDES = sorted({side * (past or 3e-7) for past in PAST for side in (-1.0, 1.0)})
COARSE = 0.25
"""Longest step of closed curves: the coarser the walk, the harder are its ends."""


def driven_slider(crank_angle):
    """A crank of 1 m and a rod of 2.5 m, driven at the slider; its dead centres are at x = 1.5 and
    3.5.
    """
    tip = (np.cos(crank_angle), np.sin(crank_angle), 0.0)
    x = tip[0] + np.sqrt(2.5**2 - tip[1] ** 2)
    mechanism = Mechanism(
        "slider",
        [Body("crank"), Body("rod"), Body("slider")],
        [
            Revolute("pivot", "ground", "crank", (0, 0, 0), (0, 0, 1)),
            Revolute("pin", "crank", "rod", tip, (0, 0, 1)),
            Spherical("ball", "rod", "slider", (x, 0, 0)),
            Translational("guide", "ground", "slider", (x, 0, 0), (1, 0, 0)),
        ],
        [Point("slider", "slider", (x, 0, 0))],
        [JointDisplacement("push", "guide")],
    )
    return mechanism, x


@pytest.mark.parametrize(
    ("centre", "direction", "past"),
    [
        *((0.0, 1, past) for past in BOTH_SIDES[::2]),
        *((np.pi, -1, past) for past in BOTH_SIDES[1::2]),
    ],
)
def test_both_dead_centres_wherever_the_curve_begins(centre, past, direction):
    mechanism, x = driven_slider(centre + past)
    curve = trace(mechanism, "push", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed
    assert sorted(x + event.value for event in curve.events) == pytest.approx([1.5, 3.5], abs=1e-12)
    assert all(event.kind == "limit point" for event in curve.events)
    arcs = [abs(event.arc) for event in curve.events]
    assert arcs == sorted(arcs)
    assert arcs[-1] <= abs(curve.arc[-1])
    assert curve.points["slider"][-1] == pytest.approx(curve.points["slider"][0], abs=1e-12)


@pytest.mark.parametrize("style", ["native", "relative"])
def test_the_length_of_a_closed_curve_is_that_of_one_turn(style):
    """Wherever it begins; also where the coordinates are angles, which a turn does not bring
    back.
    """
    lengths = []
    for begins in (-0.04, 0.002, 1.0):
        mechanism, _ = driven_slider(np.pi + begins)
        curve = trace(mechanism, "push", length=25.0, longest=0.1, style=style)
        assert curve.closed
        assert len(curve.events) == 2
        lengths.append(curve.arc[-1])
    # steps of other lengths
    assert lengths[:2] == pytest.approx([lengths[2]] * 2, rel=1e-3)


@pytest.mark.parametrize(("past", "direction"), [(-0.1, 1), (-1e-5, -1), (1e-5, 1), (0.02, -1)])
def test_both_dead_centres_of_a_rocker(past, direction):
    """The four-bar that its rocker drives, with its crank beside the pose in which it stretches the
    coupler.
    """
    pivot, base, crank, coupler, rocker = (0.0, 0.0, 0.0), 2.0, 0.5, 1.8, 1.2
    reach = crank + coupler
    stretched = np.arccos((reach**2 + base**2 - rocker**2) / (2.0 * reach * base))
    pin = (crank * np.cos(stretched + past), crank * np.sin(stretched + past), 0.0)
    d = np.hypot(base - pin[0], pin[1])
    at = np.arctan2(-pin[1], base - pin[0]) + np.arccos(
        (d**2 + coupler**2 - rocker**2) / (2.0 * d * coupler)
    )
    end, z = (pin[0] + coupler * np.cos(at), pin[1] + coupler * np.sin(at), 0.0), (0.0, 0.0, 1.0)
    mechanism = Mechanism(
        "rocked",
        [Body("crank"), Body("coupler"), Body("rocker")],
        [
            Revolute("A", "ground", "crank", pivot, z),
            Revolute("B", "crank", "coupler", pin, z),
            Spherical("C", "coupler", "rocker", end),
            Revolute("D", "ground", "rocker", (base, 0.0, 0.0), z),
        ],
        [Point("C", "rocker", end)],
        [JointAngle("rock", "D")],
    )
    curve = trace(mechanism, "rock", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed

    def inner(length):
        return np.pi - np.arccos((base**2 + rocker**2 - length**2) / (2.0 * base * rocker))

    design = np.arctan2(end[1], end[0] - base)
    expected = sorted(inner(length) for length in (coupler + crank, coupler - crank))
    assert sorted(design + event.value for event in curve.events) == pytest.approx(
        expected, abs=1e-11
    )


@pytest.mark.parametrize(("past", "direction"), [(-0.03, 1), (-0.004, -1), (0.004, 1), (0.03, -1)])
def test_a_branch_point_beside_the_beginning(past, direction):
    """All cranks in line, a little before or behind: once each way round, and the other one half a
    turn away.
    """
    mechanism = chain(1, np.pi / 2.0 + past)
    curve = trace(mechanism, "turn", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed
    turned = sorted(event.value % np.pi for event in curve.events)
    assert turned == pytest.approx([past % np.pi] * 2, abs=1e-8)
    assert {event.kind for event in curve.events} == {"branch point"}


@pytest.mark.parametrize("past", [-0.004, -0.001, 0.001, 0.004])
def test_a_branch_point_beside_an_open_beginning(past):
    """Seen by one of both directions."""
    curves = [
        trace(chain(2, np.pi / 2.0 + past), "turn", length=1.0, direction=way) for way in (1, -1)
    ]
    assert [event.value for curve in curves for event in curve.events] == pytest.approx(
        [past], abs=1e-8
    )


def test_many_bodies_are_not_back_when_they_have_hardly_left():
    """The length is shared by all unknowns: each moves little at first."""
    curve = trace(chain(5), "turn", length=0.4)
    assert not curve.closed
    assert curve.arc[-1] == pytest.approx(0.4)


# Arguments and the command line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"driver": "steer"}, "no driver 'steer'; known: stroke"),
        ({"direction": 2}, "direction is 2, expected 1"),
        ({"length": -1.0}, "length is -1.0, expected a positive number"),
        ({"longest": np.nan}, "longest is nan"),
        ({"tol": 0.0}, "tol is 0.0"),
        ({"style": "dads"}, "no style 'dads'; known: native, paper"),
        ({"points": ["hub"]}, "no point 'hub'; known: rod_end, wheel"),
    ],
)
def test_what_makes_no_sense(arguments, message):
    with pytest.raises(SolveError, match=message):
        trace(mcpherson(), **({"driver": "stroke"} | arguments))


def test_the_command_line(tmp_path, capsys):
    file = tmp_path / "curve.json"
    assert main(["trace", "mcpherson_strut", "--length", "2.5", "--json", str(file)]) == 0
    assert "limit point at stroke = -0.316737084 m" in capsys.readouterr().out
    found = json.loads(file.read_text())
    assert found["schema"] == "kincheck-trace/1"
    (event,) = found["curves"][1]["events"]
    assert event["value"] == pytest.approx(LIMITS[-1], abs=1e-14)
    assert event["nearest_pose"]["kind"] == "lock-up"
    assert main(["trace", "mcpherson_strut", "--driver", "strok"]) == 2
    assert "did you mean 'stroke'" in capsys.readouterr().err
