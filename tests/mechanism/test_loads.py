"""Masses, inertia and force elements as descriptions: what is refused, and with which words."""

import numpy as np
import pytest
from kincheck import Body, Mechanism, MechanismError, Revolute, Spherical
from kincheck.core.mechanism import body
from kincheck.core.mechanism.body import Dimension, inertia_matrix
from kincheck.core.mechanism.loads import (
    ELEMENTS,
    Axes,
    Force,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)

from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X, Z

(BAD_MASSES,) = examples(__file__, "bad_masses")

BALL = (2.0, 2.0, 2.0, 0.0, 0.0, 0.0)
APART = (ORIGIN, (0.0, 3.0, 4.0))


def test_body_without_mass():
    assert Body("a") == Body("a", ORIGIN, mass=0.0)
    assert Body("a").center_of_mass is None
    assert not Mechanism("m", [Body("a")], []).has_loads


def test_body_mass_defaults_to_origin():
    body = Body("a", origin=(1.0, 2.0, 3.0), mass=2)
    assert (body.mass, body.center_of_mass, body.inertia) == (2.0, (1.0, 2.0, 3.0), None)
    assert Mechanism("m", [body], []).has_loads


def test_inertia_matrix_of_six_numbers():
    matrix = inertia_matrix((4.0, 5.0, 6.0, 0.1, 0.2, 0.3))
    np.testing.assert_array_equal(matrix, [[4.0, 0.1, 0.3], [0.1, 5.0, 0.2], [0.3, 0.2, 6.0]])


@pytest.mark.parametrize(
    ("values", "message"),
    BAD_MASSES,
    ids=str,
)
def test_impossible_mass_is_refused(values, message):
    with pytest.raises(MechanismError, match="body 'a'") as caught:
        Body("a", **values)
    assert message in str(caught.value)


def test_inertia_of_rounded_plate_is_accepted():
    assert Body("plate", mass=1.0, inertia=(0.333333, 0.333333, 0.666667, 0.0, 0.0, 0.0)).inertia


@pytest.mark.parametrize(
    ("kind", "given", "message"),
    [
        (SpringDamper, ("a", "b", (X, X), 1.0), "its points coincide at x = 1 m, y = 0 m, z = 0 m"),
        (SpringDamper, ("a", "a", APART, 1.0), "needs two different bodies"),
        (SpringDamper, ("a", "b", APART, -1.0), "stiffness is -1.0"),
        (SpringDamper, ("a", "b", APART, 1.0, -2.0), "damping is -2.0"),
        (SpringDamper, ("a", "b", APART, 1.0, 0.0, -1.0), "free_length is -1.0"),
        (TorsionSpringDamper, ("hinge", float("inf")), "stiffness is inf"),
        (Force, ("a", ORIGIN, (1.0, 0.0)), "a force [x, y, z]"),
        (Force, ("a", ORIGIN, X, "local"), "frame is 'local'"),
        (Torque, ("a", (float("nan"), 0.0, 0.0)), "is not finite"),
    ],
    ids=str,
)
def test_impossible_force_element_is_refused(kind, given, message):
    with pytest.raises(MechanismError, match="force 's'") as caught:
        kind("s", *given)
    assert message in str(caught.value)


def test_spring_free_length_defaults_to_design():
    assert SpringDamper("s", "a", "b", APART, 1.0).free_length == 5.0
    assert SpringDamper("s", "a", "b", APART, 1.0, free_length=0.0).free_length == 0.0


def test_force_element_with_unknown_name():
    hinge = Revolute("hinge", "ground", "a", ORIGIN, Z)
    ball = Spherical("ball", "ground", "b", ORIGIN)
    bodies = [Body("a"), Body("b")]

    def with_force(*forces):
        return Mechanism("m", bodies, [hinge, ball], forces=forces)

    good = with_force(
        SpringDamper("spring", "ground", "a", APART, 1.0),
        TorsionSpringDamper("torsion", "hinge", 1.0),
        Force("push", "a", ORIGIN, X, "body"),
    )
    assert good.has_loads
    assert good.force("push").frame is Axes.BODY
    for force, message in (
        (SpringDamper("s", "ground", "c", APART, 1.0), "there is no body 'c'"),
        (Torque("s", "c", X), "there is no body 'c'"),
        (TorsionSpringDamper("s", "hing", 1.0), "did you mean 'hinge'"),
        (TorsionSpringDamper("s", "ball", 1.0), "has no rotation"),
    ):
        with pytest.raises(MechanismError) as caught:
            with_force(force)
        assert message in str(caught.value)
        assert caught.value.key.startswith("forces.s")
    with pytest.raises(MechanismError, match="used more than once"):
        with_force(Torque("s", "a", X), Torque("s", "a", X))


def test_gravity_must_be_finite_vector():
    assert Mechanism("m", [Body("a")], [], gravity=[0, 0, -9.81]).gravity == (0, 0, -9.81)
    for bad in ((0.0, -9.81), (0.0, 0.0, float("nan"))):
        with pytest.raises(MechanismError, match="gravity"):
            Mechanism("m", [Body("a")], [], gravity=bad)


def test_force_element_type_names():
    assert sorted(ELEMENTS) == [
        "bushing",
        "force",
        "spring_damper",
        "torque",
        "torsion_spring_damper",
    ]


DIMENSIONS = {name: each for name, each in vars(body).items() if isinstance(each, Dimension)}


@pytest.mark.parametrize("dimension", DIMENSIONS.values(), ids=DIMENSIONS)
def test_unit_of_length_follows_unit_text(dimension):
    """A newton is a kg m/s^2: the unit's own text says the power of the length."""
    above, _, below = str(dimension).partition("/")
    powers = {"N": 1, "m": 1, "m^2": 2}
    power = sum(powers.get(each, 0) for each in above.split())
    power -= sum(powers.get(each, 0) for each in below.split("/"))
    assert dimension.in_kg_and_s(3.0, 1e-3) == pytest.approx(3.0 * 1e3**power, rel=1e-14)
