"""Checks of a joint's equations, each a function of one specimen that yields its findings.

Small steps over the manifold lead from the design to the poses, so the poses are on the
intended branch. Motions through them have random admissible velocities and accelerations, from
exact derivatives of phi alone. The joint's own statements (rows, nu, gamma, branch) take no
part in either.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...joints import AxialJoint, Joint
from ...trajectory import Array
from ..findings import Finding, Verdict, judged
from .manifold import design, min_norm, newton, rank, smallest, straight, walk
from .traced import Place, TracedJoint

# Twelve steps of this length [rad, or units of the joint's size] lead far from the design.
STEP, STEPS = 0.15, 12
# Any joint must still be within its reach after this number of steps.
NEAR = 2
# Sums of some thirty products of numbers of size one, each rounded at 1e-16.
ROUND_OFF = 1e-13
ROUND_OFF_WHY = "round-off of sums of numbers of size one"
# ROUND_OFF over the smallest singular value of accepted poses (a twentieth of the value at design),
# and the same factor once more.
AMPLIFIED = 1e-10
AMPLIFIED_WHY = "round-off over the smallest singular value, x100"
DIFFERENCE_WHY = "truncation and round-off of differences at step 0.01 (1e-13), x1e4"
NEWTON_WHY = "quadratic from 1e-3: 3 passes; 2 more where an exact row is made up for by others"


@dataclass(frozen=True, eq=False)
class Specimen:
    """A joint, its equations and motions admitted by the joint.

    Attributes:
        state: poses on the manifold, shape (size, lanes), in the layout of `TracedJoint`.
        near: earlier poses of the walk, near the design.
        rate, acceleration: an admissible motion through each pose, shape (columns, lanes).
        exact: the Jacobian of phi at each pose, shape (lanes, rows, columns).
    """

    joint: Joint
    place: Place
    traced: TracedJoint
    near: Array
    state: Array
    rate: Array
    acceleration: Array
    exact: Array
    rng: np.random.Generator

    @property
    def lanes(self) -> int:
        """Number of poses."""
        return self.state.shape[1]


def specimen(joint: Joint, place: Place, lanes: int, rng: np.random.Generator) -> Specimen:
    """Return the joint with random poses and motions on its manifold, one of each a lane.

    Raises:
        MechanismError, or any error of the joint's own code: the equations cannot be traced.
    """
    traced = TracedJoint(joint, place)
    directions = rng.normal(size=(traced.columns, lanes))
    start, _ = newton(traced, design(traced, lanes), traced.exact, 10)
    way = walk(traced, start, straight(directions, STEP), STEPS)
    state = way[-1]
    exact = traced.exact(state)
    rate = _along(exact, rng.normal(size=directions.shape))
    bent = traced.jets(state, rate, np.zeros_like(rate))[2]
    acceleration = _along(exact, rng.normal(size=rate.shape)) - min_norm(exact, bent)
    return Specimen(joint, place, traced, way[NEAR], state, rate, acceleration, exact, rng)


def _along(jacobian: Array, wanted: Array) -> Array:
    """Return the part of the wanted rates admitted by the rows."""
    return wanted - min_norm(jacobian, times(jacobian, wanted))


def times(jacobian: Array, rate: Array) -> Array:
    """Multiply rows by rates, shapes (lanes, rows, columns) and (columns,
    lanes) -> (rows, lanes).
    """
    return np.einsum("lmn,nl->ml", jacobian, rate)


def composition(s: Specimen) -> Iterator[Finding]:
    """Check phi at the design position, and that all its numbers are finite."""
    remedy = (
        "phi must vanish at the design position: check the constants that primitives() makes of the"
        " geometry"
    )
    yield judged(
        "design",
        np.abs(s.traced.phi(design(s.traced, 1))),
        ROUND_OFF,
        ROUND_OFF_WHY,
        s.traced.names,
        remedy=remedy,
    )


def freedoms(s: Specimen) -> Iterator[Finding]:
    """Check the rank of the rows, and 6 - rank against the freedoms named by the class."""
    found, t = rank(s.traced.rows(s.state)), s.traced
    apart = f"smallest singular value {smallest(s.exact).min():.2g}, rows of size one"
    lost = np.abs(len(t.names) - found)[None, :].astype(float)
    yield judged(
        "rank",
        lost,
        0.0,
        "rows must be independent",
        ["rows less rank"],
        apart,
        "take out the dependent row, or repair it",
    )
    left = 6 - (found - len(t.coordinates))
    relations = len(s.joint.relations) if isinstance(s.joint, AxialJoint) else 0
    names, stated = s.joint.freedoms, len(s.joint.freedoms) - relations
    if s.joint.rows != t.rows_left:
        message = (
            f"rows = {s.joint.rows}, but the primitives have {t.rows_left} equations; do not define"
            " rows"
        )
        yield Finding(
            "freedoms", Verdict.FAIL, abs(s.joint.rows - t.rows_left), 0.0, message=message
        )
    elif not names:
        yield Finding(
            "freedoms",
            Verdict.PASS,
            message=f"leaves {left.min()} and names none: none can be driven",
        )
    else:
        text = f"leaves {int(left.max())}, names {stated}: {', '.join(names)}"
        wrong = np.abs(left - stated)[None, :].astype(float)
        yield judged(
            "freedoms",
            wrong,
            0.0,
            "6 - rank must be named",
            message=text,
            remedy="name each freedom that is left, or add the missing row",
        )


def derivatives(s: Specimen) -> Iterator[Finding]:
    """Check the rows against the derivative of phi (same row space), and the two methods of
    differentiation against each other.
    """
    t, declared = s.traced, s.traced.rows(s.state)
    entrywise = np.abs(declared - s.exact).max(axis=2).T
    exact = [
        name
        for name, worst in zip(t.names, entrywise.max(axis=1), strict=True)
        if worst <= AMPLIFIED
    ]
    others = [name for name in t.names if name not in exact]
    kind = f"equal to the derivative: {len(exact)} of {len(t.names)} rows" + (
        f", others equivalent: {', '.join(others)}" if others else ""
    )
    astray = np.concatenate([_outside(declared, s.exact), _outside(s.exact, declared)])
    names = [*t.names, *(f"derivative of {name}" for name in t.names)]
    remedy = "what is named is no combination of the others' rows: differentiate phi again"
    yield judged("rows", astray, AMPLIFIED, AMPLIFIED_WHY, names, kind, remedy)
    apart = np.abs(t.differences(s.state) - s.exact).max(axis=2).T
    yield judged(
        "differences",
        apart,
        1e-9,
        DIFFERENCE_WHY,
        t.names,
        remedy="phi is not smooth: no abs, min or max in an equation",
    )


def _outside(rows: Array, space: Array) -> Array:
    """Return the relative part of each row outside the row space of `space`,
    shape (rows, lanes).
    """
    size = np.linalg.norm(rows, axis=2).T
    projected = np.stack(
        [min_norm(space, times(space, rows[:, k].T)) for k in range(rows.shape[1])]
    )
    return np.linalg.norm(rows.transpose(1, 2, 0) - projected, axis=1) / np.where(
        size > 0.0, size, 1.0
    )


def right_sides(s: Specimen) -> Iterator[Finding]:
    """Check rows . v = nu and rows . a = gamma along motions admitted by phi."""
    _, velocity, acceleration = defects(s.traced, s.state, s.rate, s.acceleration)
    names = s.traced.names
    yield judged(
        "nu",
        velocity,
        AMPLIFIED,
        AMPLIFIED_WHY,
        names,
        remedy="rows . v must be nu where phi stays zero; a joint has nu = 0",
    )
    remedy = (
        "rows . a must be gamma where phi stays zero: differentiate rows . v = nu once more, and"
        " move all but rows . a to the right"
    )
    yield judged("gamma", acceleration, AMPLIFIED, AMPLIFIED_WHY, names, remedy=remedy)


def defects(
    t: TracedJoint, state: Array, rate: Array, acceleration: Array, units: Any = 1.0
) -> tuple[Array, Array, Array]:
    """Return the defects of a motion in position, velocity and acceleration, by row and pose,
    relative to the size of the row.

    Args:
        units: units of the equations' columns in those of the rates, shape (columns, 1).
    """
    jacobian = t.rows(state) * np.reshape(units, (1, 1, -1))
    size = np.linalg.norm(jacobian, axis=2).T
    size = np.where(size > 0.0, size, 1.0)
    velocity = (times(jacobian, rate) - t.nu(state)) / size
    bent = (times(jacobian, acceleration) - t.gamma(state, rate * units)) / size
    speed, turn = np.linalg.norm(rate, axis=0), np.linalg.norm(acceleration, axis=0)
    return (
        np.abs(t.phi(state) / size),
        np.abs(velocity) / (1.0 + speed),
        np.abs(bent) / (1.0 + speed**2 + turn),
    )


def convergence(s: Specimen) -> Iterator[Finding]:
    """Check Newton's iteration with the declared rows, from poses a little off the manifold."""
    off = s.rng.normal(size=s.rate.shape)
    start = s.traced.retract(s.state, 1e-3 * off / np.linalg.norm(off, axis=0))
    _, taken = newton(s.traced, start, s.traced.rows, 20)
    remedy = (
        "the rows have the right space but not the size or sign of the derivative, so a step is too"
        " long or too short"
    )
    yield judged(
        "newton",
        taken[None, :].astype(float),
        6.0,
        NEWTON_WHY,
        ["iterations from 1e-3"],
        remedy=remedy,
    )


def intended_branch(s: Specimen) -> Iterator[Finding]:
    """Check that the branch tests accept poses of the intended branch."""
    tests = len(s.traced.programs["branch"].outputs)
    if not tests:
        yield Finding("branch tests", Verdict.PASS, message="none declared")
        return
    refused = (s.traced.branch(s.near) <= 0.0).astype(float)
    far = int((s.traced.branch(s.state) <= 0.0).sum())
    text = f"{tests} declared" + f"; {far} of {s.lanes} poses far from the design are refused" * (
        far > 0
    )
    remedy = "a test must be positive on the branch of the design position: turn its sign"
    yield judged(
        "branch tests",
        refused,
        0.0,
        f"poses within {NEAR * STEP:g} of the design are on its branch",
        ["refused"],
        text,
        remedy,
    )
