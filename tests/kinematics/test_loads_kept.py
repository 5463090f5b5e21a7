"""Whoever makes a mechanism from another keeps its masses and loads."""

from dataclasses import replace

import pytest
from kincheck import Body
from kincheck.adapters.shared.equivalents import in_own_frame, own_frame
from kincheck.core.kinematics import placed, places

from ..support.loaded_slider_crank import GRAVITY, case_of, loaded, pushed

SIMULATION = "kincheck.adapters.simulate.simulation"
REDUCTION = "kincheck.core.extensions.laboratory.stress.reduction"


def same_loads(a, b):
    assert (a.gravity, a.forces) == (b.gravity, b.forces)
    assert {each.name: each for each in a.bodies if each.mass} == {
        each.name: each for each in b.bodies if each.mass
    }


@pytest.mark.parametrize(
    "other",
    [
        lambda m: replace(m, points=m.points),
        lambda m: placed(m, places(m)),
        lambda m: pytest.importorskip(SIMULATION).with_joints_alone(m),
        lambda m: pytest.importorskip(REDUCTION).round_geometry(case_of(m), 9).mechanism,
    ],
    ids=["replace", "placed", "jointed", "rounded"],
)
def test_derived_mechanism_keeps_loads(other):
    mechanism = pushed()
    same_loads(other(mechanism), mechanism)


def test_loads_scale_with_length_unit():
    """A mechanism in another unit has forces in kg, s and that unit: Newton's law holds there."""
    case = case_of(loaded())
    frame, there = own_frame(case), in_own_frame(case).mechanism
    u, (crank, slider, _) = frame.unit, there.bodies
    assert u != 1.0
    assert (crank.mass, slider.mass) == (2.0, 3.5)
    assert crank.center_of_mass == frame.there((0.125, 0.0, 0.25))
    assert slider.center_of_mass == frame.there((2.0, 0.5, 0.0))
    assert crank.inertia[0] == 0.5 / u**2
    assert there.gravity == tuple(x / u for x in GRAVITY)
    spring, clock, push, twist = there.forces
    assert spring.points[0] == frame.there((4.0, 0.5, 0.0))
    assert (spring.stiffness, spring.damping, spring.free_length) == (800.0, 16.0, 1.75 / u)
    # stiffness times length is a force, in the same unit as a mass times gravity
    assert spring.stiffness * spring.free_length == 800.0 * 1.75 / u
    assert (clock.stiffness, clock.damping, clock.free_angle) == (4.0 / u**2, 0.5 / u**2, -0.25)
    assert (push.point, push.vector) == (frame.there((2.25, 0.5, 0.0)), (-8.0 / u, 0.0, 1.0 / u))
    assert twist.vector == (0.0, 0.0, 3.0 / u**2)


def test_own_frame_of_massless_case():
    plain = replace(loaded(), bodies=[Body("crank"), Body("slider"), Body("wall", fixed=True)])
    assert in_own_frame(case_of(plain)).mechanism.body("crank").center_of_mass is None
