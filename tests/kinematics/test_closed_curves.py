"""Curves that close: events beside their beginning, the closing step and their length."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import JointAngle
from kincheck.core.kinematics.continuation.trace import trace

from ..support.mechanisms import CRANK, ROD, chain, circles_meet, planar_four_bar, pushed

# The closing step and the first one

PAST = [0.0, 1e-5, 0.002, 0.04]
"""How far the design is past a singular pose [rad]; zero stands for one that is nearer than a
millionth.
"""
BOTH_SIDES = sorted({side * (past or 3e-7) for past in PAST for side in (-1.0, 1.0)})
COARSE = 0.25
"""Longest step of closed curves: the coarser the walk, the harder are its ends."""


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


@pytest.mark.parametrize(("past", "direction"), [(-0.03, 1), (-0.004, -1), (0.004, 1), (0.03, -1)])
def test_branch_point_beside_closed_start(past, direction):
    """All cranks in line, a little before or behind: once each way round, and the other one half a
    turn away.
    """
    mechanism = chain(1, np.pi / 2.0 + past)
    curve = trace(mechanism, "turn", length=25.0, direction=direction, longest=COARSE)
    assert curve.closed
    turned = sorted(event.value % np.pi for event in curve.events)
    assert turned == pytest.approx([past % np.pi] * 2, abs=1e-8)
    on_curve = np.interp([abs(event.arc) for event in curve.events], abs(curve.arc), curve.values)
    assert [event.value for event in curve.events] == pytest.approx(on_curve, abs=1e-3)
    assert {event.kind for event in curve.events} == {"branch point"}


@pytest.mark.parametrize("past", [-0.004, -0.001, 0.001, 0.004])
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
