"""The checks of a joint's equations: each a function of one specimen that gives its findings.

Poses are reached from the design by small steps over the manifold, so they are on the intended
branch; motions through them have random admissible velocities and accelerations, from the exact
derivatives of phi alone. Nothing the joint says of itself (rows, nu, gamma, branch) takes part in
making them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...joints import AxialJoint, Joint
from ...kinematics.formulation.constraints import Style
from ...trajectory import Array
from .findings import Finding, Verdict, judged
from .manifold import design, min_norm, newton, rank, smallest, straight, walk
from .scalars import execute, precise
from .traced import Place, TracedJoint

# Twelve steps of this length [rad, or units of the joint's size] leave the design far behind.
STEP, STEPS = 0.15, 12
# After so many of them any joint must still be within its reach.
NEAR = 2
# Sums of some thirty products of numbers of size one, each rounded at 1e-16.
ROUND_OFF = 1e-13
ROUND_OFF_WHY = "round-off of sums of numbers of size one"
# The same, divided by the smallest singular value that poses may have (a twentieth of that at
# design), and once more.
AMPLIFIED = 1e-10
AMPLIFIED_WHY = "round-off over the smallest singular value, x100"
DIFFERENCE_WHY = "truncation and round-off of differences at step 0.01 (1e-13), x1e4"
NEWTON_WHY = "quadratic from 1e-3: 3 passes; 2 more where an exact row is made up for by others"


@dataclass(frozen=True, eq=False)
class Specimen:
    """A joint, its equations, and motions that it admits.

    Attributes:
        state: poses on the manifold, shape (size, lanes), as `TracedJoint` has them.
        near: poses that were passed on the way, near the design.
        rate, acceleration: of an admissible motion through each, shape (columns, lanes).
        exact: the Jacobian of phi there, shape (lanes, rows, columns).
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
    """The joint with that many poses and motions on its manifold.

    Raises:
        MechanismError, or what the joint's own code raises: its equations cannot be traced.
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
    """The part of the wanted rates that the rows allow."""
    return wanted - min_norm(jacobian, times(jacobian, wanted))


def times(jacobian: Array, rate: Array) -> Array:
    """Rows times rates, (lanes, rows, columns) and (columns, lanes) -> (rows, lanes)."""
    return np.einsum("lmn,nl->ml", jacobian, rate)


def composition(s: Specimen) -> Iterator[Finding]:
    """phi at the design position, and whether all numbers are finite."""
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
    """Rank of the rows, and what they leave of six freedoms against what the class says."""
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
    """The rows against the derivative of phi: the same row space; and the two ways to differentiate
    against each other.
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
    """The part of each row (relative) that is no combination of the rows of the space, shape (rows,
    lanes).
    """
    size = np.linalg.norm(rows, axis=2).T
    projected = np.stack(
        [min_norm(space, times(space, rows[:, k].T)) for k in range(rows.shape[1])]
    )
    return np.linalg.norm(rows.transpose(1, 2, 0) - projected, axis=1) / np.where(
        size > 0.0, size, 1.0
    )


def right_sides(s: Specimen) -> Iterator[Finding]:
    """rows . v = nu and rows . a = gamma along motions that phi admits."""
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
    """How far a motion is from the equations: position, velocity, acceleration, by row and pose,
    relative to the row's size.

    Args:
        units: of the columns of the equations in those of the rates, shape (columns, 1).
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
    """Newton's iteration with the declared rows, from a little off the manifold."""
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
    """The branch tests where no branch was left."""
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


def cost(s: Specimen) -> Iterator[Finding]:
    """Operations of the traced equations, beside those of the conventional form where there is
    one.
    """

    def flops(t: TracedJoint) -> dict[str, int]:
        return {name: t.programs[name].flops for name in ("phi", "rows", "gamma")}

    own, other = flops(s.traced), _conventional(s)
    text = ", ".join(f"{name} {count}" for name, count in own.items())
    if other is not None:
        text += "; in conventional form " + ", ".join(
            f"{name} {count}" for name, count in flops(other).items()
        )
    yield Finding("operations", Verdict.PASS, float(sum(own.values())), message=f"flops {text}")


def _conventional(s: Specimen) -> TracedJoint | None:
    try:
        return TracedJoint(s.joint, s.place, Style.CONVENTIONAL)
    except KeyError:  # a primitive of the user's own has no twin there
        return None


def round_off(s: Specimen) -> Iterator[Finding]:
    """Rounding errors: the same operations with 40 digits, at the poses and very near the
    design.
    """
    try:
        kind, lift = precise(40)
    except ModuleNotFoundError:
        yield Finding(
            "round-off", Verdict.SKIP, message="mpmath is not installed: pip install mpmath"
        )
        return

    def error(t: TracedJoint, state: Array) -> Array:
        true = execute(t.programs["phi"], kind, lift(state), lift)
        return np.abs(
            np.array(
                [
                    np.broadcast_to(lift(a) - b, state.shape[1:])
                    for a, b in zip(t.phi(state), true, strict=True)
                ]
            ).astype(float)
        )

    few = s.state[:, :8]
    tiny = 1e-8
    near = s.traced.retract(design(s.traced, 8), tiny * s.rng.normal(size=(s.traced.columns, 8)))
    lost = {"here": error(s.traced, near).max() / tiny}
    other = _conventional(s) if not s.traced.coordinates else None
    if other is not None:
        lost["in conventional form"] = error(other, near).max() / tiny
    text = f"of a displacement of {tiny:g} from the design phi loses " + ", ".join(
        f"{x:.1g} {where}" for where, x in lost.items()
    )
    yield judged(
        "round-off",
        error(s.traced, few),
        ROUND_OFF,
        ROUND_OFF_WHY,
        s.traced.names,
        text,
        "a difference of large numbers is formed: start from what changed",
    )
