"""Tracing a motion by its own length: limit points and branch points against closed forms, and what
lies beyond them.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import JointAngle, SolveError, cases
from kincheck.core.extensions.trace.curve import trace

from ...kinematics.test_redundancy import locomotive
from ...kinematics.test_singular import LIMITS
from ...support.examples import examples
from ...support.mechanisms import (
    CRANK,
    LEAN,
    ROD,
    chain,
    chain_end,
    circles_meet,
    four_bar,
    mcpherson,
    planar_four_bar,
    pushed,
)

(BAD_ARGUMENTS,) = examples(__file__, "bad_arguments")

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
def test_trace_limits_of_strut(direction, style):
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


def test_trace_limit_by_other_steps():
    curve = trace(mcpherson(), "stroke", direction=-1, length=2.5, longest=0.11)
    assert curve.events[0].value == pytest.approx(strut_curve(-1).events[0].value, abs=1e-14)


def test_trace_beyond_limit_point():
    curve = strut_curve(-1)
    beyond = np.abs(curve.arc) > abs(curve.events[0].arc)
    assert (np.diff(curve.values[~beyond]) < 0.0).all()
    assert (np.diff(curve.values[beyond]) > 0.0).all()
    assert curve.values == pytest.approx(curve.points["wheel"][:, 2] - 0.101, abs=1e-14)
    assert curve.message == ""
    # the rods keep their lengths, there as before
    lengths = np.linalg.norm(curve.points["rod_end"] - np.array([1.14, 0.355, 0.1455]), axis=1)
    assert lengths == pytest.approx(lengths[0], abs=1e-14)


def test_trace_limit_with_branch():
    """Bricard's hinge turns back at 30 degrees, folded flat: corrections do not converge there, and
    the limit is interpolated.
    """
    mechanism = cases.load("bricard").mechanism
    curve = trace(mechanism, mechanism.drivers[0].name, length=4.5)
    assert [event.value for event in curve.events] == pytest.approx([np.pi / 6.0], abs=1e-11)


# Branch points


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("loops", [1, 2])
def test_trace_branch_points_of_chain(loops, direction):
    """All links in line: the determinant changes its sign with an odd number of loops, and not with
    an even one.
    """
    curve = trace(chain(loops), "turn", length=4.5, direction=direction, longest=0.1)
    (event,) = curve.events
    assert event.kind == "branch point"
    assert event.value == pytest.approx(LEAN + direction * np.pi / 2.0, abs=1e-11)
    assert "turn" not in event.singularity.owners
    # straight on: the cranks stay parallel
    assert curve.points["end"] == pytest.approx(chain_end(loops, curve.values)[0], abs=1e-9)


@pytest.mark.parametrize("longer", [1e-8, 1e-4])
def test_trace_of_nearly_parallelogram(longer):
    """The coupler of a parallelogram is too long by a little: the crank locks up just before the
    change point, where a step is a thousand times as long as the bend of the curve.
    """
    crank, ground, lean = 0.15, 0.4, 0.2
    tip, rest = crank * np.array([np.cos(lean), np.sin(lean), 0.0]), (ground, 0.0, 0.0)
    coupler = ground + longer
    mechanism = planar_four_bar(tip, circles_meet(tip, coupler, rest, crank), rest)
    (event,) = trace(mechanism, "turn", length=0.7, direction=-1).events
    folded = coupler - crank  # from A's tip to D
    cosine = (crank**2 + ground**2 - folded**2) / (2.0 * crank * ground)
    assert event.kind == "limit point"
    assert event.value == pytest.approx(np.arccos(cosine) - lean, abs=1e-9)


def test_trace_without_singular_poses():
    """A whole turn of a crank, and back at the design."""
    curve = trace(four_bar(), "turn", length=12.0, longest=0.1)
    assert curve.closed
    assert curve.events == ()
    assert curve.values[-1] == pytest.approx(2.0 * np.pi, abs=0.1)
    assert curve.sigma.min() > 0.01


# Arguments and the command line


@pytest.mark.parametrize(
    ("arguments", "message"),
    BAD_ARGUMENTS,
    ids=str,
)
def test_trace_refuses_bad_arguments(arguments, message):
    with pytest.raises(SolveError, match=message):
        trace(mcpherson(), **({"driver": "stroke"} | arguments))


# Curves that close: events beside their beginning, the closing step and their length


# The closing step and the first one

PAST = [0.0, 1e-5, 0.002, 0.04]
"""How far the design is past a singular pose [rad]; zero stands for one that is nearer than a
millionth.
"""
BOTH_SIDES = sorted({side * (past or 3e-7) for past in PAST for side in (-1.0, 1.0)})
COARSE = 0.25
"""Longest step of closed curves: the coarser the walk, the harder are its ends."""


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("centre", "direction", "past"),
    [
        *((0.0, 1, past) for past in BOTH_SIDES[::2]),
        *((np.pi, -1, past) for past in BOTH_SIDES[1::2]),
    ],
)
def test_closed_curve_finds_dead_centres(centre, past, direction):
    mechanism, x, _ = pushed(centre + past)
    curve = trace(mechanism, "push", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed
    assert sorted(x + event.value for event in curve.events) == pytest.approx(
        [ROD - CRANK, ROD + CRANK], abs=1e-12
    )
    assert all(event.kind == "limit point" for event in curve.events)
    arcs = [abs(event.arc) for event in curve.events]
    assert arcs == sorted(arcs)
    assert arcs[-1] <= abs(curve.arc[-1])
    assert curve.points["pin"][-1] == pytest.approx(curve.points["pin"][0], abs=1e-12)


@pytest.mark.parametrize("style", ["native", "relative"])
def test_closed_curve_length_is_one_turn(style):
    """Wherever it begins; also where the coordinates are angles, which a turn does not bring
    back.
    """
    lengths = []
    for begins, longest in ((-0.04, 0.1), (0.002, 0.09), (1.0, 0.077)):
        mechanism, *_ = pushed(np.pi + begins)
        curve = trace(mechanism, "push", length=25.0, longest=longest, style=style)
        assert curve.closed
        assert len(curve.events) == 2
        lengths.append(curve.arc[-1])
    # steps of other lengths
    assert lengths[:2] == pytest.approx([lengths[2]] * 2, rel=1e-3)


@pytest.mark.parametrize(("past", "direction"), [(-0.1, 1), (-1e-5, -1), (1e-5, 1), (0.02, -1)])
def test_rocker_curve_finds_dead_centres(past, direction):
    """The four-bar that its rocker drives, with its crank beside the pose in which it stretches the
    coupler.
    """
    base, crank, coupler, rocker = 2.0, 0.5, 1.8, 1.2
    reach, rest = crank + coupler, (base, 0.0, 0.0)
    stretched = np.arccos((reach**2 + base**2 - rocker**2) / (2.0 * reach * base))
    pin = crank * np.array([np.cos(stretched + past), np.sin(stretched + past), 0.0])
    end = circles_meet(pin, coupler, rest, rocker)
    mechanism = planar_four_bar(pin, end, rest, "ball")
    mechanism = replace(mechanism, drivers=[JointAngle("rock", "rest")])
    curve = trace(mechanism, "rock", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed

    def inner(length):
        return np.pi - np.arccos((base**2 + rocker**2 - length**2) / (2.0 * base * rocker))

    design = np.arctan2(end[1], end[0] - base)
    expected = sorted(inner(length) for length in (coupler + crank, coupler - crank))
    found = sorted(design + event.value for event in curve.events)
    assert found == pytest.approx(expected, abs=1e-11)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("past", [-0.004, 0.03, 0.004, -0.03])
def test_branch_point_beside_closed_start(past):
    """All cranks in line, a little before or behind: once each way round, and the other one half a
    turn away.
    """
    direction = -1 if past in (-0.004, 0.03) else 1
    curve = trace(
        chain(1, np.pi / 2.0 + past), "turn", length=25.0, direction=direction, longest=COARSE
    )
    assert curve.closed
    turned = sorted(event.value % np.pi for event in curve.events)
    assert turned == pytest.approx([past % np.pi] * 2, abs=1e-8)
    on_curve = np.interp([abs(event.arc) for event in curve.events], abs(curve.arc), curve.values)
    assert [event.value for event in curve.events] == pytest.approx(on_curve, abs=1e-3)
    assert {event.kind for event in curve.events} == {"branch point"}


@pytest.mark.by_day(3)
@pytest.mark.parametrize("past", [-0.001, -0.004, 0.001, 0.004])
def test_branch_point_beside_open_start(past):
    """Seen by one of both directions."""
    curves = [
        trace(chain(2, np.pi / 2.0 + past), "turn", length=1.0, direction=way) for way in (1, -1)
    ]
    assert [event.value for curve in curves for event in curve.events] == pytest.approx(
        [past], abs=1e-8
    )


def test_open_curve_of_many_bodies():
    """The length is shared by all unknowns: each moves little at first."""
    curve = trace(chain(5), "turn", length=0.4)
    assert not curve.closed
    assert curve.arc[-1] == pytest.approx(0.4)


def test_trace_past_dead_rods():
    """One rod in its dead point is no branch point, for the other one holds; two are."""
    assert trace(locomotive(np.pi / 2.0), "turn", length=7.0, longest=0.1).events == ()
    curve = trace(locomotive(np.pi), "turn", length=3.5, longest=0.1)
    assert curve.events[0].kind == "branch point"
