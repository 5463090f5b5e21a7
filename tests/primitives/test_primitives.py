"""Every primitive against its own derivatives.

The equations run over any scalar, so phi is differentiated by running it on jets: no step size, no
symbolic work. States are lanes: a thousand random ones are one evaluation. The primitives are
discovered; one without a maker in specimens.py fails.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck.core import primitives as p
from kincheck.core.algebra import Vec3
from kincheck.core.primitives import GROUND_POSE, Drive, Primitive

from ..support.specimens import (
    MAKERS,
    admissible,
    body,
    direction,
    discovered,
    in_body_axes,
    lanes,
    make,
    retyped,
    rotation,
    vector,
)

# Sums of some thirty products of numbers of size one, each rounded at 1e-16; relative to the
# largest of their terms.
ROUND_OFF = 1e-13

TYPES = discovered()
SIMPLIFIED = [kind for kind in MAKERS if MAKERS[kind](np.random.default_rng(0)).on_manifold]


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


def defect(row, rates, right, derivative):
    """|row . rates - right - derivative| by lane, relative to the largest number involved."""
    terms = [
        x * y
        for block, part in zip(row, rates, strict=True)
        for x, y in zip(block, part, strict=True)
    ]
    numbers = lanes((*terms, -right, -derivative))
    # a row may meet nothing but zeros
    largest = np.maximum(np.abs(numbers).max(axis=0), np.finfo(float).tiny)
    return np.abs(numbers.sum(axis=0)) / largest


def phi_jets(specimen, i, j):
    primitive, drive = specimen.primitive, specimen.drive
    driven = primitive if drive is None else replace(primitive, drive=drive.jets)
    return driven.phi(i.jets, j.jets)


def defects(specimen, i, j):
    """By lane, d phi / dt against rows . velocity - nu, and d2 phi / dt2 against rows .
    acceleration - gamma.
    """
    primitive, phi = specimen.primitive, phi_jets(specimen, i, j)
    rows, nu = primitive.rows(i.pose, j.pose), primitive.nu(i.pose, j.pose)
    i, j = i.in_axes_of(primitive), j.in_axes_of(primitive)
    gamma = primitive.gamma(i.pose, j.pose, i.motion, j.motion)
    every = [*zip(rows, phi, nu, gamma, strict=True)]
    velocity, acceleration = (i.v, i.w, j.v, j.w), (i.v_t, i.w_t, j.v_t, j.w_t)
    return (
        np.max([defect(row, velocity, right, x.v) for row, x, right, _ in every], axis=0),
        np.max([defect(row, acceleration, right, x.a) for row, x, _, right in every], axis=0),
    )


def worst_defect(specimen, rng):
    i, j = admissible(specimen, rng)
    any_velocity = replace(j, v=vector(rng), w=vector(rng))
    return max(defects(specimen, i, any_velocity)[0].max(), defects(specimen, i, j)[1].max())


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind.n > 1])
def test_primitive_steady_rows(kind, rng):
    """Global directions, of shifts or else of turns of body i, that are the same in all poses; and
    no other rows are.
    """
    specimen = make(kind, rng)
    i, j = admissible(specimen, rng)
    steady = True
    for row in specimen.primitive.rows(i.pose, j.pose):
        shift, turn = lanes(row.ri), lanes(i.pose.turn(row.pi) if in_body_axes(kind) else row.pi)
        along = shift if np.abs(shift).max() > 0.0 else turn
        # round-off of turning there and back
        steady = steady and float(np.ptp(along, axis=1).max()) <= 1e-14
    assert steady == kind.steady


@pytest.mark.parametrize("kind", TYPES)
def test_primitive_phi_vanishes_on_manifold(kind, rng):
    """The makers' manifold is where phi = 0, and its motions are those with rows . velocity =
    nu.
    """
    specimen = make(kind, rng)
    if specimen.on_manifold is None:
        undriven = (
            replace(specimen.primitive, drive=Drive()) if specimen.drive else specimen.primitive
        )
        if issubclass(kind, p.Distance):
            undriven = replace(undriven, length=undriven.design_length)
        at_design = lanes(undriven.phi(GROUND_POSE, GROUND_POSE))
        gap = np.array([*undriven.d0]) if issubclass(kind, p.Spherical) else 0.0
        # what native residuals are expanded about is exactly zero there; other styles round
        assert np.abs(at_design - gap).max() <= (0.0 if kind in MAKERS else ROUND_OFF)
        return
    i, j = admissible(specimen, rng)
    for phi in phi_jets(specimen, i, j):
        assert np.abs(phi.x).max() <= ROUND_OFF
        assert np.abs(phi.v).max() <= ROUND_OFF * 10.0  # velocities reach ten


@pytest.mark.parametrize("kind", TYPES)
def test_primitive_rows_are_phi_derivative(kind, rng):
    """For any velocity: exact rows at any pose, simplified ones on their manifold."""
    specimen = make(kind, rng)
    i, j = admissible(specimen, rng)
    assert len(specimen.primitive.phi(i.pose, j.pose)) == kind.n
    any_velocity = replace(j, v=vector(rng), w=vector(rng))
    assert defects(specimen, i, any_velocity)[0].max() <= ROUND_OFF


@pytest.mark.parametrize("kind", TYPES)
def test_primitive_gamma_completes_second_derivative(kind, rng):
    """For any acceleration: exact ones at any pose and velocity, simplified ones where both are
    admissible.
    """
    specimen = make(kind, rng)
    assert defects(specimen, *admissible(specimen, rng))[1].max() <= ROUND_OFF


def of_residual(primitive, *methods):
    """The primitive as a user has it who writes phi alone."""
    own = {method: getattr(Primitive, method) for method in methods or ("rows", "nu", "gamma")}
    return retyped(primitive, type("OfResidual", (type(primitive),), own))


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind in MAKERS])
def test_primitive_of_phi_alone_is_exact(kind, rng):
    """At any pose and velocity, on the manifold or not."""
    specimen = make(kind, rng)
    derived = replace(specimen, primitive=of_residual(specimen.primitive))
    assert np.max(defects(derived, body(rng), body(rng))) <= ROUND_OFF


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind in MAKERS])
def test_primitive_of_rows_without_gamma(kind, rng):
    specimen = make(kind, rng)
    derived = replace(specimen, primitive=of_residual(specimen.primitive, "gamma"))
    assert defects(derived, *admissible(specimen, rng))[1].max() <= ROUND_OFF


@pytest.mark.parametrize("kind", SIMPLIFIED)
def test_simplified_rows_error_by_misalignment(kind, rng):
    """Off the manifold simplified rows are wrong, in proportion: why Newton converges, and why they
    need care.
    """
    specimen = make(kind, rng)
    i, j = admissible(specimen, rng)
    off = direction(rng)
    v, w = vector(rng), vector(rng)
    found = []
    for tilt in (1e-5, 1e-3):
        tilted = replace(j, q=rotation(off, tilt) * j.q, v=v, w=w)
        found.append(np.median(defects(specimen, i, tilted)[0]) / tilt)
    assert 0.05 < found[0] < 5.0
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_simplified_gamma_at_inadmissible_velocity(rng):
    specimen = make(p.Dot11, rng)
    i, j = admissible(specimen, rng)
    assert defects(specimen, i, replace(j, w=vector(rng)))[1].max() > 0.1


# The battery can fail: each of these mistakes is found


def changed(primitive, method, change):
    """The primitive with what one of its methods gives changed."""
    original = getattr(type(primitive), method)
    mutant = type(
        "Mutant",
        (type(primitive),),
        {method: lambda self, *arguments: change(original(self, *arguments))},
    )
    return retyped(primitive, mutant)


def nudged(values):
    return values[0] + 1e-9, *values[1:]


def row_nudged(rows):
    return rows[0]._replace(pj=rows[0].pj + Vec3(0.0, 1e-9, 0.0)), *rows[1:]


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("method", ["rows", "gamma", "nu"])
def test_battery_finds_small_mistake(kind, method, rng):
    specimen = make(kind, rng)
    assert worst_defect(specimen, rng) <= ROUND_OFF
    wrong = changed(specimen.primitive, method, row_nudged if method == "rows" else nudged)
    assert worst_defect(replace(specimen, primitive=wrong), rng) > 10.0 * ROUND_OFF


def test_battery_finds_printed_dot11_gamma(rng):
    """(16) as printed has wrong signs (formulation section 9); in native axes its second row comes
    out negated.
    """
    specimen = make(p.Dot11, rng)
    printed = changed(specimen.primitive, "gamma", lambda values: (values[0], -values[1]))
    assert worst_defect(replace(specimen, primitive=printed), rng) > 0.1


def test_battery_refuses_unknown_primitive(rng):
    """Neither a new type nor one that adds fields to a known one slips through."""

    @dataclass(frozen=True)
    class New(Primitive):
        n = 1

    @dataclass(frozen=True)
    class More(p.Dot10):
        extra: Vec3

    for kind in (New, More):
        with pytest.raises(AssertionError, match="add a maker"):
            make(kind, rng)


def test_derivation_tells_short_lived_vectors_apart():
    """A vector that is made for one turn is gone before the next one is made in its place."""
    count = 50

    @dataclass(frozen=True)
    class Sum(Primitive):
        n = 1

        def phi(self, i, j):
            turned = [i.turn(Vec3(0.1 * k, 0.3 * k, 0.7 * k)) for k in range(count)]
            return (sum(a.x * k for k, a in enumerate(turned)),)

    (row,) = Sum().rows(GROUND_POSE, GROUND_POSE)
    squares = sum(k * k for k in range(count))
    # e_x . (dpi x a) = dpi . (a x e_x)
    assert [*row.pi] == pytest.approx([0.0, 0.7 * squares, -0.3 * squares], rel=1e-13)
