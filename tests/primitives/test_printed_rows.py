"""The rows as the paper prints them are the rows of the row styles: conventional ones before,
simplified ones after.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.algebra import Vec3, cross
from kincheck.core.studies.paper.textbook import (
    PrintedDot11,
    PrintedDot12,
    PrintedDot21,
    chain,
    conditions,
    skew,
)

from ..support.specimens import alike, body, frame, rotation, vector

# Rows as printed

SEED = 943745
# Sums of a few dozen products of numbers up to ten, each rounded at 1e-16.
ROUND_OFF = 1e-12


@pytest.fixture
def rng():
    return np.random.default_rng(SEED)


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
def test_dot_products_as_printed_are_the_conventional_rows(rng, number, formed):
    """At any pose; the printed ones take positions, and are zero where a . b and a . d are."""
    f, g, h = frame(rng)
    s_i, s_j = vector(rng), vector(rng)
    condition = conditions(f, g, h, s_i, s_j)[number]
    printed, conventional = condition.printed(formed=formed), condition.unsimplified("conventional")
    i, j = body(rng), body(rng)
    placed = replace(j, u=s_i - s_j + j.u)
    for mine, theirs in zip(printed, conventional, strict=True):
        assert off(mine.phi(i.pose, placed.pose), theirs.phi(i.pose, j.pose)) <= ROUND_OFF
    rows, expected = (
        [row for e in each for row in e.rows(i.pose, p.pose)]
        for each, p in ((printed, placed), (conventional, j))
    )
    assert off(entries(rows), entries(expected)) <= ROUND_OFF
    assert off(gammas(printed, i, placed), gammas(conventional, i, j)) <= 100.0 * ROUND_OFF


@pytest.mark.parametrize("formed", [True, False])
def test_simplified_rows_as_printed_are_the_papers(rng, formed):
    """The rows at any pose; d11's gamma where the condition holds, for it is simplified too."""
    f, g, h = frame(rng)
    s_i, s_j = vector(rng), vector(rng)
    paper = {
        each.name: each.simplified("paper")
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
            <= ROUND_OFF
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
    assert off(gammas([printed["d11"]], i, pinned), gammas(paper["d11"], i, pinned)) <= ROUND_OFF
    assert np.abs(gammas([printed["d11"]], i, pinned)).max() > 1.0
    # no turning, no gamma
    assert off(gammas([printed["d11"]], *alike(i, pinned)), 0.0) <= ROUND_OFF


def test_chain_and_skew():
    a, b = Vec3(1.0, 2.0, 3.0), Vec3(-2.0, 5.0, 7.0)
    assert skew(a) @ b == cross(a, b)
    assert chain(b, skew(a)) == cross(b, a)
