"""Native residuals and rows against the paper's: unsimplified equations, and rows as printed."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from kincheck.core import primitives as p
from kincheck.core.algebra import Quat, Vec3, cross
from kincheck.core.extensions.laboratory.paper.operations import (
    PrintedDot11,
    PrintedDot12,
    PrintedDot21,
    chain,
    conditions,
    skew,
)
from kincheck.core.extensions.laboratory.paper.rows import PaperDot12

from ...oracles import naive
from ...support.specimens import (
    LANES,
    alike,
    body,
    direction,
    discovered,
    entry,
    frame,
    make,
    rotation,
    vector,
)

# Sums of a dozen products of numbers up to ten, each rounded at 1e-16.
ROUND_OFF = 1e-13


@pytest.fixture
def rng():
    return np.random.default_rng(943745)


def lane(value, k):
    """One lane of a vector, a primitive or a scalar, as plain numbers."""
    if isinstance(value, Vec3 | Quat):
        return np.array([float(lane(x, k)) for x in value])
    if is_dataclass(value):
        return type(value)(
            **{each.name: lane(getattr(value, each.name), k) for each in fields(value)}
        )
    return float(np.broadcast_to(value, LANES)[k])


def half(phi, L):
    """|d| - L as (|d|^2 - L^2) / (2 L)."""
    return phi * (1.0 + phi / (2.0 * L))


def twist(i, j, x):
    return naive.dot10(i, j, x.f_i, x.g_j) - naive.dot10(i, j, x.g_i, x.f_j)


NO_ARM = np.zeros(3)
TWINS = {
    PaperDot12: lambda x, i, j: naive.dot12(i, j, np.eye(3), np.eye(3)),
    p.Dot10: lambda x, i, j: [naive.dot10(i, j, x.a, x.b) - x.a @ x.b],
    p.ConstantVelocity: lambda x, i, j: [twist(i, j, x) - twist(naive.GROUND, naive.GROUND, x)],
    p.Dot11: lambda x, i, j: naive.dot11(i, j, (x.f, x.g, x.h), (x.f, x.g, x.h)),
    p.Dot20: lambda x, i, j: [naive.dot20(i, j, x.a, x.s_i, x.s_j) - x.a @ x.d0 - x.drive.c],
    p.Spherical: lambda x, i, j: naive.spherical(i, j, x.s_i, x.s_j),
    p.NamedSlide: lambda x, i, j: naive.spherical(i, j, x.s_i, x.s_j) - x.drive.c * (i.A @ x.h),
    p.Distance: lambda x, i, j: half(naive.distance(i, j, x.s_i, x.s_j, x.length), x.length),
    p.DrivenCoordinate: lambda x, i, j: [
        x.k @ (naive.line(naive.GROUND, j, NO_ARM, x.s) - x.s) - x.drive.c
    ],
}
"""Primitives with the same phi as the paper's -> that phi of one lane. The others are compared
below, where they agree.
"""

SAME_PHI = [kind for kind in discovered() if entry(TWINS, kind)]


@pytest.mark.parametrize("kind", SAME_PHI)
def test_primitive_phi_equals_paper(kind, rng):
    """At any pose. The bodies' axes are the global ones at design, which is all the paper's frames
    may be asked to be.
    """
    specimen = make(kind, rng)
    i, j = body(rng), body(rng)
    found = np.array(specimen.primitive.phi(i.pose, j.pose))
    for k in range(0, LANES, 20):
        x = lane(specimen.primitive, k)
        # the design position of body i is the origin, that of body j such that d0 lies between the
        # points
        origin = x.d0 + x.s_i - x.s_j if hasattr(x, "d0") else np.zeros(3)
        at_i = naive.Body(lane(i.u, k), lane(i.q, k))
        at_j = naive.Body(origin + lane(j.u, k), lane(j.q, k))
        assert found[:, k] == pytest.approx(
            entry(TWINS, kind)(x, at_i, at_j), rel=ROUND_OFF, abs=ROUND_OFF
        )


def test_dot12_equals_paper_to_first_order(rng):
    """(17) and the Euler parameters agree up to the square of the misalignment, in global axes."""
    i, off = body(rng), direction(rng)
    for tilt in (1e-2, 1e-3):
        j = replace(i, q=rotation(off, tilt) * i.q)
        found = np.array(p.Dot12().phi(i.pose, j.pose))
        for k in range(0, LANES, 20):
            at_i, at_j = (naive.Body(np.zeros(3), lane(each.q, k)) for each in (i, j))
            paper = at_i.A @ naive.dot12(at_i, at_j, np.eye(3), np.eye(3))
            assert found[:, k] == pytest.approx(paper, abs=tilt**2)
            assert np.linalg.norm(found[:, k]) == pytest.approx(tilt, rel=1e-3)


def test_dot21_equals_paper_without_relative_turn(rng):
    """(23) with the bodies turned alike; otherwise (23) sees body j's arm turn, the const-C form
    does not.
    """
    specimen = make(p.Dot21, rng)
    arms = vector(rng)
    i, other = body(rng), body(rng)
    for j, same in ((alike(i, other)[1], True), (other, False)):
        found = np.array(specimen.primitive.phi(i.pose, j.pose))
        worst = 0.0
        for k in range(0, LANES, 20):
            x, s_j = lane(specimen.primitive, k), lane(arms, k)
            at_i = naive.Body(lane(i.u, k), lane(i.q, k))
            at_j = naive.Body(x.e0 + lane(j.u, k), lane(j.q, k))
            paper = naive.dot21(at_i, at_j, (x.f, x.g), x.e0 + s_j, s_j)
            worst = max(worst, np.abs(found[:, k] - paper).max())
        assert worst <= 1e2 * ROUND_OFF if same else worst > 0.1  # arms and displacements reach ten


# The rows as the paper prints them are the rows of the row styles: conventional ones before,


# Rows as printed

# Sums of a few dozen products of numbers up to ten, each rounded at 1e-16.
OF_ROWS = 1e-12


def off(found, expected):
    """The largest difference; numbers that are none make it none."""
    return np.abs(np.array(found) - np.array(expected)).max()


def entries(rows):
    return np.array([np.broadcast_to(x, (1000,)) for row in rows for block in row for x in block])


def gammas(equations, i, j):
    own = [each.in_axes_of(equations[0]).motion for each in (i, j)]
    return np.array([x for each in equations for x in each.gamma(i.pose, j.pose, *own)])


@pytest.mark.parametrize("formed", [True, False])
@pytest.mark.parametrize("number", range(5))
def test_printed_dot_products_equal_conventional_rows(rng, number, formed):
    """At any pose; the printed ones take positions, and are zero where a . b and a . d are."""
    f, g, h = frame(rng)
    s_i, s_j = vector(rng), vector(rng)
    condition = conditions(f, g, h, s_i, s_j)[number]
    printed, conventional = (
        condition.printed_rows(formed=formed),
        condition.unsimplified_rows("conventional"),
    )
    i, j = body(rng), body(rng)
    placed = replace(j, u=s_i - s_j + j.u)
    for mine, theirs in zip(printed, conventional, strict=True):
        assert off(mine.phi(i.pose, placed.pose), theirs.phi(i.pose, j.pose)) <= OF_ROWS
    rows, expected = (
        [row for e in each for row in e.rows(i.pose, p.pose)]
        for each, p in ((printed, placed), (conventional, j))
    )
    assert off(entries(rows), entries(expected)) <= OF_ROWS
    assert off(gammas(printed, i, placed), gammas(conventional, i, j)) <= 100.0 * OF_ROWS


@pytest.mark.parametrize("formed", [True, False])
def test_printed_simplified_rows_equal_paper_style(rng, formed):
    """The rows at any pose; d11's gamma where the condition holds, for it is simplified too."""
    f, g, h = frame(rng)
    s_i, s_j = vector(rng), vector(rng)
    paper = {
        each.name: each.simplified_rows("paper")
        for each in conditions(f, g, h, s_i, s_j)
        if each.is_simplified
    }
    i, j = body(rng), body(rng)
    placed = replace(j, u=s_i - s_j + j.u)
    printed = {
        "d11": PrintedDot11(f, g, formed=formed),
        "d12": PrintedDot12(i.pose.A.T.times(j.pose.A)),
        "d21": PrintedDot21(f, g),
    }
    assert printed.keys() == paper.keys()
    for name, mine in printed.items():
        (theirs,) = paper[name]
        assert (
            off(entries(mine.rows(i.pose, placed.pose)), entries(theirs.rows(i.pose, j.pose)))
            <= OF_ROWS
        )
    (d21,) = paper["d21"]
    gamma = PrintedDot21(f, g).gamma(
        i.pose, placed.pose, i.in_axes_of(d21).motion, j.in_axes_of(d21).motion
    )
    assert off(gammas([d21], i, j), gamma) <= 1e-10
    pinned = replace(
        i,
        q=i.q * rotation(h, rng.uniform(-3.0, 3.0, 1000)),
        w=i.w + rng.normal(size=1000) * i.pose.turn(h),
    )
    assert off(gammas([printed["d11"]], i, pinned), gammas(paper["d11"], i, pinned)) <= OF_ROWS
    assert np.abs(gammas([printed["d11"]], i, pinned)).max() > 1.0
    # no turning, no gamma
    assert off(gammas([printed["d11"]], *alike(i, pinned)), 0.0) <= OF_ROWS


def test_printed_chain_and_skew():
    a, b = Vec3(1.0, 2.0, 3.0), Vec3(-2.0, 5.0, 7.0)
    assert skew(a) @ b == cross(a, b)
    assert chain(b, skew(a)) == cross(b, a)
