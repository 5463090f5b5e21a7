"""Whoever makes a mechanism from another keeps its masses and loads."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from kincheck import cases
from kincheck.adapters.shared.equivalents import in_own_frame, jointed, own_frame
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.kinematics.formulation.constraints import frames, structure
from kincheck.core.kinematics.formulation.parameters import placed, places
from kincheck.core.kinematics.structure.components import components, describe_components
from kincheck.core.kinematics.verified.exact import exact_mechanism
from kincheck.core.mechanism.body import Body
from kincheck.core.mechanism.loads import Force, SpringDamper
from kincheck.core.mechanism.mechanism import Mechanism
from kincheck.core.studies.stress.reduction import reduced, rounded

from ..support.loaded import GRAVITY, loaded, pushed


def case_of(mechanism: Mechanism) -> Case:
    sweep = Sweep(mechanism.drivers[0].name, np.linspace(0.0, 0.25, 3))
    return with_all_coordinates(
        Case(mechanism.name, "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    )


def same_loads(a: Mechanism, b: Mechanism) -> None:
    assert (a.gravity, a.forces) == (b.gravity, b.forces)
    assert {each.name: each for each in a.bodies if each.mass} == {
        each.name: each for each in b.bodies if each.mass
    }


@pytest.mark.parametrize(
    "other",
    [
        lambda m: replace(m, points=m.points),
        lambda m: placed(m, places(m)),
        jointed,
        lambda m: rounded(case_of(m), 9).mechanism,
    ],
    ids=["replace", "placed", "jointed", "rounded"],
)
def test_loads_stay(other):
    mechanism = pushed()
    same_loads(other(mechanism), mechanism)


def test_exact_numbers_are_those_of_the_loads():
    pytest.importorskip("flint")
    mechanism = pushed()
    found = exact_mechanism(mechanism, Fraction)
    assert [float(each.ball) for each in found.gravity] == list(mechanism.gravity)
    assert [float(each.mass.ball) for each in found.bodies] == [b.mass for b in mechanism.bodies]
    assert [each.name for each in found.forces] == [each.name for each in mechanism.forces]


def test_added_bodies_have_no_mass():
    added = {each.name: each.mass for each in jointed(pushed()).bodies}
    assert len(added) == 3 + 4  # of a rod, and three slides
    assert sum(added.values()) == 5.5


def test_components_do_not_depend_on_masses():
    """Two loops alike but for their masses are one program."""
    light = loaded()
    heavy = replace(light, bodies=[replace(each, mass=7.0) for each in light.bodies], forces=())

    def programs(mechanism):
        """The structure of each component, with its numbers."""
        parts = components(mechanism, frames(mechanism))
        every = [each.name for each in mechanism.points], [each.name for each in mechanism.moving]
        numbers: list[list[float]] = [[] for _ in parts]
        found = describe_components(mechanism, parts, *every)
        return [
            (structure(each.section, own), own) for each, own in zip(found, numbers, strict=True)
        ]

    assert programs(heavy) == programs(light)


def test_loads_in_the_unit_of_a_small_mechanism():
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


def test_a_case_without_loads_is_in_its_own_frame_as_before():
    for body in in_own_frame(cases.load("andrews_squeezer")).mechanism.bodies:
        assert isinstance(body, Body)
    plain = replace(loaded(), bodies=[Body("crank"), Body("slider"), Body("wall", fixed=True)])
    assert in_own_frame(case_of(plain)).mechanism.body("crank").center_of_mass is None


def test_shrinking_drops_the_loads_of_parts_that_go():
    """The two forces on the slider go; the others keep a case as it is."""
    case = case_of(loaded())

    def still(smaller):
        return any(each.name == "clock" for each in smaller.mechanism.forces)

    small, _ = reduced(case, still)
    assert [each.name for each in small.mechanism.forces] == ["clock"]
    assert [each.name for each in small.mechanism.moving] == ["crank"]
    assert small.mechanism.body("crank").mass == 2.0
    assert small.mechanism.gravity == GRAVITY


def test_places_of_force_elements_move_with_a_frame():
    spring, _, push, _ = loaded().forces
    assert isinstance(spring, SpringDamper)
    assert isinstance(push, Force)
    moved = spring.in_frame(lambda p: (p[0] + 1.0, p[1], p[2]))
    assert moved == replace(spring, points=((5.0, 0.5, 0.0), (3.0, 0.5, 0.0)))
    assert push.in_frame(lambda p: p, 2.0).vector == (-4.0, 0.0, 0.5)
