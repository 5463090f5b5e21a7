"""Checks of a joint's equations, and of variants of them.

Each is a function of one specimen that yields its findings. A motion admitted by the specimen must
be admitted by the variant too: position, velocity and acceleration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...algebra import Quat, quat, vec
from ...joints import Attachment, AxialJoint, Kind
from ...kinematics import MIXED
from ...primitives.base import Drive, Pose, Twist
from ...trajectory import Array
from .findings import (
    AMPLIFIED,
    ROUND_OFF,
    Finding,
    Limit,
    Verdict,
    fault_finding,
    judge_figures,
    skip,
    worst,
)
from .manifold import NEAR, STEP, Motion, Specimen, min_norm, newton, rank, smallest, times
from .traced_joint import (
    COLUMNS,
    POSES,
    CarriedPoint,
    Place,
    TracedJoint,
    execute,
    precise,
    rotate_vectors,
)

INDEPENDENT = Limit(0.0, "rows must be independent")
NAMED = Limit(0.0, "6 - rank must be named")
QUADRATIC = Limit(
    6.0, "quadratic from 1e-3: 3 passes; 2 more where an exact row is made up for by others"
)
ON_BRANCH = Limit(0.0, f"poses within {NEAR * STEP:g} of the design are on its branch")
FACTORS = (1e-6, 1e-3, 1e3)
# Offset of a joint a thousand kilometres from the global origin [m].
AWAY = 1e6


def composition(s: Specimen) -> Iterator[Finding]:
    """Check phi at the design position: zero, of finite numbers."""
    off = np.abs(s.traced.phi(s.traced.design(1)))
    yield judge_figures("design", off, ROUND_OFF, s.traced.names)


def freedoms(s: Specimen) -> Iterator[Finding]:
    """Check the rank of the rows, and 6 - rank against the freedoms named by the class."""
    found, t = rank(s.traced.rows(s.state)), s.traced
    apart = f"smallest singular value {smallest(s.exact).min():.2g}, rows of size one"
    lost = np.abs(len(t.names) - found)[None, :].astype(float)
    yield judge_figures("rank", lost, INDEPENDENT, ["rows less rank"], apart)
    left = 6 - (found - len(t.coordinates))
    relations = len(s.joint.relations) if isinstance(s.joint, AxialJoint) else 0
    names, named = s.joint.freedoms, len(s.joint.freedoms) - relations
    if s.joint.rows != t.rows_left:
        message = (
            f"rows = {s.joint.rows}, but the primitives have {t.rows_left} equations; do not define"
            " rows"
        )
        off = abs(s.joint.rows - t.rows_left)
        yield Finding("freedoms", Verdict.FAIL, off, 0.0, message=message)
    elif not names:
        yield fault_finding(
            "freedoms", "", f"leaves {left.min()} and names none: none can be driven"
        )
    else:
        text = f"leaves {int(left.max())}, names {named}: {', '.join(names)}"
        wrong = np.abs(left - named)[None, :].astype(float)
        yield judge_figures("freedoms", wrong, NAMED, message=text)


def derivatives(s: Specimen) -> Iterator[Finding]:
    """Check the rows against the derivative of phi: they have the same row space."""
    t, declared = s.traced, s.traced.rows(s.state)
    entrywise = np.abs(declared - s.exact).max(axis=(0, 2))
    others = [
        name for name, off in zip(t.names, entrywise, strict=True) if not off <= AMPLIFIED.value
    ]
    kind = f"equal to the derivative: {len(t.names) - len(others)} of {len(t.names)} rows" + (
        f", others equivalent: {', '.join(others)}" if others else ""
    )
    astray = np.concatenate([_outside(declared, s.exact), _outside(s.exact, declared)])
    names = [*t.names, *(f"derivative of {name}" for name in t.names)]
    yield judge_figures("rows", astray, AMPLIFIED, names, kind)


def _outside(rows: Array, space: Array) -> Array:
    """Return the relative part of each row outside the row space of `space`,
    shape (rows, lanes).
    """
    size = np.linalg.norm(rows, axis=2).T
    projected = np.stack(
        [min_norm(space, times(space, rows[:, k].T)) for k in range(rows.shape[1])]
    )
    off = np.linalg.norm(rows.transpose(1, 2, 0) - projected, axis=1)
    return off / np.where(size > 0.0, size, 1.0)


def right_sides(s: Specimen) -> Iterator[Finding]:
    """Check rows . v = nu and rows . a = gamma along motions admitted by phi."""
    _, velocity, acceleration = _defects(s.traced, s.motion)
    yield judge_figures("nu", velocity, AMPLIFIED, s.traced.names)
    yield judge_figures("gamma", acceleration, AMPLIFIED, s.traced.names)


def _defects(t: TracedJoint, motion: Motion, units: Any = 1.0) -> tuple[Array, Array, Array]:
    """Return the defects of a motion in position, velocity and acceleration, by row and pose,
    relative to the size of the row.

    Args:
        units: units of the equations' columns in those of the rates, shape (columns, 1).
    """
    state, rate, acceleration = motion
    jacobian = t.rows(state) * np.reshape(units, (1, 1, -1))
    size = np.linalg.norm(jacobian, axis=2).T
    size = np.where(size > 0.0, size, 1.0)
    velocity = (times(jacobian, rate) - t.nu(state)) / size
    bent = (times(jacobian, acceleration) - t.gamma(state, rate * units)) / size
    speed, pull = np.linalg.norm(rate, axis=0), np.linalg.norm(acceleration, axis=0)
    return (
        np.abs(t.phi(state) / size),
        np.abs(velocity) / (1.0 + speed),
        np.abs(bent) / (1.0 + speed**2 + pull),
    )


def convergence(s: Specimen) -> Iterator[Finding]:
    """Check Newton's iteration with the declared rows, from poses a little off the manifold."""
    off = s.rng.normal(size=s.rate.shape)
    start = s.traced.retract(s.state, 1e-3 * off / np.linalg.norm(off, axis=0))
    _, taken = newton(s.traced, start, s.traced.rows, 20)
    names = ["iterations from 1e-3"]
    yield judge_figures("newton", taken[None, :].astype(float), QUADRATIC, names)


def intended_branch(s: Specimen) -> Iterator[Finding]:
    """Check that the branch tests accept poses of the intended branch."""
    tests = len(s.traced.programs["branch"].outputs)
    if not tests:
        yield fault_finding("branch tests", "", "none declared")
        return
    refused = (s.traced.branch(s.near) <= 0.0).astype(float)
    far = int((s.traced.branch(s.state) <= 0.0).sum())
    text = f"{tests} declared" + f"; {far} of {s.lanes} poses far from the design are refused" * (
        far > 0
    )
    yield judge_figures("branch tests", refused, ON_BRANCH, ["refused"], text)


def cost(s: Specimen) -> Iterator[Finding]:
    """Count the operations of the traced equations."""
    flops = {name: s.traced.programs[name].flops for name in ("phi", "rows", "gamma")}
    text = ", ".join(f"{name} {count}" for name, count in flops.items())
    yield Finding("operations", Verdict.PASS, float(sum(flops.values())), message=f"flops {text}")


def round_off(s: Specimen) -> Iterator[Finding]:
    """Check rounding errors against the same operations with 40 digits, at the poses and very
    near the design.
    """
    try:
        kind, lift = precise(40)
    except ModuleNotFoundError:
        yield skip("round-off", "mpmath is not installed: pip install mpmath")
        return

    def error(t: TracedJoint, state: Array) -> Array:
        true = execute(t.programs["phi"], kind, lift(state), lift)
        off = [lift(a) - b for a, b in zip(t.phi(state), true, strict=True)]
        return np.abs(np.array([np.broadcast_to(x, state.shape[1:]) for x in off]).astype(float))

    tiny = 1e-8
    shift = tiny * s.rng.normal(size=(s.traced.columns, 8))
    near = s.traced.retract(s.traced.design(8), shift)
    lost = error(s.traced, near).max() / tiny
    text = f"of a displacement of {tiny:g} from the design phi loses {lost:.1g}"
    off = error(s.traced, s.state[:, :8])
    yield judge_figures("round-off", off, ROUND_OFF, s.traced.names, text)


def exchange(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with both bodies exchanged."""
    if not s.joint.symmetric:
        yield skip("exchange", "symmetric = False: geometry belongs to one of the bodies")
        return
    back = replace(s.joint.reversed(), i=s.joint.i, j=s.joint.j)
    other = TracedJoint(back, Place((s.place.origins[1], s.place.origins[0]), s.place.unit))

    def exchange_bodies(a: Array, half: int) -> Array:
        # a coordinate describes body j relative to body i
        return np.concatenate([a[half : 2 * half], a[:half], -a[2 * half :]])

    motion = (
        exchange_bodies(s.state, POSES // 2),
        exchange_bodies(s.rate, COLUMNS),
        exchange_bodies(s.acceleration, COLUMNS),
    )
    yield _same("exchange", s, other, motion)


def rigid_motion(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with both bodies turned and shifted together, and residuals
    off the manifold.
    """
    q = s.rng.normal(size=4)
    q /= np.linalg.norm(q)
    shift = s.rng.normal(size=(3, 1))

    def turn(a: Array) -> Array:
        return rotate_vectors(q[None], a.T).T

    def pose(state: Array) -> Array:
        parts: list[Array] = []
        for k, origin in enumerate(s.traced.origins[:, :, None]):
            u, e = state[7 * k : 7 * k + 3], state[7 * k + 3 : 7 * k + 7]
            parts += [turn(origin + u) + shift - origin, np.stack([*(quat(q) * quat(e))])]
        return np.concatenate([*parts, state[POSES:]])

    def rates(a: Array) -> Array:
        return np.concatenate([*(turn(a[3 * k : 3 * k + 3]) for k in range(4)), a[2 * COLUMNS :]])

    motion = (pose(s.state), rates(s.rate), rates(s.acceleration))
    yield _same("rigid motion", s, s.traced, motion)
    off = s.traced.retract(s.state, 0.3 * s.rng.normal(size=s.rate.shape))
    here, there = s.traced.phi(off), s.traced.phi(pose(off))
    parts = s.traced.parts
    apart = np.array(
        [
            np.abs(np.linalg.norm(here[a:b], axis=0) - np.linalg.norm(there[a:b], axis=0))
            for a, b in parts
        ]
    )
    names = [s.traced.names[first].split(" row")[0] for first, _ in parts]
    yield judge_figures("residual elsewhere", apart, ROUND_OFF, names)


def axis_lengths(s: Specimen) -> Iterator[Finding]:
    """Check the same motion with longer directions, and the same residuals off the manifold.

    A multiple of a row has the same solutions; but a row may become so small or large that no
    solution meets its tolerance.
    """
    longer = s.joint.mapped({Kind.DIRECTION: lambda axis: tuple(137.0 * x for x in axis)})
    long = TracedJoint(replace(s.joint, **longer), s.place)
    met = _same("axis lengths", s, long, s.motion)
    off = s.traced.retract(s.state, 0.3 * s.rng.normal(size=s.rate.shape))
    apart = np.abs(s.traced.phi(off) - long.phi(off))
    where = "where it is not met"
    unmet = judge_figures("axis lengths", apart, ROUND_OFF, s.traced.names, where)
    yield worst(met, unmet)


def size_and_place(s: Specimen) -> Iterator[Finding]:
    """Check the same motion of the joint scaled up and down, and far from the origin."""
    found: list[Finding] = []
    slides = [k for k, name in enumerate(s.traced.coordinates) if name.endswith(".translation")]
    for factor in FACTORS:
        large = TracedJoint(s.joint.scaled(factor), s.place.scaled(factor))
        state, units = s.state.copy(), np.ones((s.traced.columns, 1))
        state[[0, 1, 2, 7, 8, 9, *(POSES + k for k in slides)]] *= factor * s.place.unit
        units[[0, 1, 2, 6, 7, 8, *(2 * COLUMNS + k for k in slides)]] *= factor * s.place.unit
        motion, text = (state, s.rate, s.acceleration), f"worst at x {factor:g}"
        found.append(_same("size", s, large, motion, units, text))
    yield worst(*found)
    shifted = s.joint.mapped({Kind.POSITION: lambda point: tuple(x + AWAY for x in point)})
    (a, b), unit = s.place.origins, s.place.unit
    away = Place((tuple(x + AWAY for x in a), tuple(x + AWAY for x in b)), unit)
    far = TracedJoint(replace(s.joint, **shifted), away)
    yield _same("place", s, far, s.motion)


def named_coordinates(s: Specimen) -> Iterator[Finding]:
    """Check the same motion by the mixed formulation: the joint's coordinates are unknowns."""
    if not isinstance(s.joint, AxialJoint):
        yield skip("mixed style", "no AxialJoint: it has no coordinates of its own")
        return
    mixed = TracedJoint(s.joint, s.place, MIXED)
    own = slice(2 * COLUMNS, None)
    still = np.zeros((len(mixed.coordinates), s.lanes))
    state = np.concatenate([s.state[:POSES], still])
    state, _ = newton(mixed, state, mixed.rows, 30, own)
    jacobian = mixed.rows(state)
    rate, acceleration = (
        np.concatenate([each[: 2 * COLUMNS], still]) for each in (s.rate, s.acceleration)
    )
    rate[own] = min_norm(jacobian, mixed.nu(state) - times(jacobian, rate), own)
    bent = mixed.gamma(state, rate) - times(jacobian, acceleration)
    acceleration[own] = min_norm(jacobian, bent, own)
    met = _same("mixed style", s, mixed, (state, rate, acceleration))
    speed = 1.0 + np.linalg.norm(rate, axis=0)
    off = [
        np.abs(coordinate(s, s.joint, name.rpartition(".")[2])[0][1] - own_rate) / speed
        for name, own_rate in zip(mixed.coordinates, rate[own], strict=True)
    ]
    remedy = "mixed() must name the joint's own coordinates, body j relative to body i"
    named = judge_figures("mixed style", np.array(off), AMPLIFIED, mixed.coordinates, remedy=remedy)
    yield worst(met, named)


def _same(
    check: str,
    s: Specimen,
    other: TracedJoint,
    motion: Motion,
    units: Any = 1.0,
    message: str = "",
) -> Finding:
    """Check that a motion of the specimen satisfies other equations too, and that these leave the
    same number of freedoms.
    """
    largest = np.max(_defects(other, motion, units), axis=0)
    mine = rank(s.exact) - len(s.traced.coordinates)
    theirs = rank(other.rows(motion[0]) * np.reshape(units, (1, 1, -1))) - len(other.coordinates)
    figures = np.vstack([largest, np.abs(theirs - mine)])
    return judge_figures(check, figures, AMPLIFIED, [*other.names, "rank"], message)


# Drivers of a joint's own coordinates, against the definition of these

FREEDOMS = ("rotation", "translation")
WHATS = ("value", "rate", "acceleration", "force", "turns")
WAY = 6.0
"""Largest further angle at which an angle's driver is examined [rad], almost a turn."""


def driver(s: Specimen) -> Iterator[Finding]:
    """Check every drivable coordinate of the joint."""
    joint = s.joint
    driven = [each for each in joint.freedoms if each in FREEDOMS]
    if not isinstance(joint, AxialJoint) or not driven:
        yield skip("driver", "it has no coordinate that can be driven")
        return
    names = [f"{freedom}: {what}" for freedom in driven for what in WHATS]
    figures = np.concatenate([_driver_defects(s, joint, freedom) for freedom in driven])
    yield judge_figures("driver", figures, AMPLIFIED, names)


def _body_point(s: Specimen, k: int, arm: Array) -> CarriedPoint:
    state, rate, acceleration = (
        x[size * k : size * (k + 1)].T
        for x, size in ((s.state, 7), (s.rate, COLUMNS), (s.acceleration, COLUMNS))
    )
    rates = (*np.split(rate, 2, axis=1), *np.split(acceleration, 2, axis=1))
    return CarriedPoint.of(
        rotate_vectors(state[:, 3:], arm), s.traced.origins[k] + state[:, :3], *rates
    )


def coordinate(s: Specimen, joint: AxialJoint, freedom: str) -> tuple[list[Array], Array]:
    """Return a coordinate of the joint with its rate and acceleration, by their definition, and the
    wrench of a unit effort on both bodies, lengths in the unit of the place.

    Returns:
        Three arrays of shape (lanes,), and one of shape (12, lanes): force and torque about the
        origin, of the first body, then of the second.
    """
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    point = np.array(joint.point) / s.place.unit
    i, j = (_body_point(s, k, point - s.traced.origins[k]) for k in range(2))
    h = rotate_vectors(s.state[3:7].T, axis)
    return _rotation(s, i, j, h, axis) if freedom == "rotation" else _slide(i, j, h)


def _driver_defects(s: Specimen, joint: AxialJoint, freedom: str) -> Array:
    """Return the defects of one coordinate's driver as named by `WHATS`, shape (5, lanes)."""
    (c, c_t, c_tt), wrench = coordinate(s, joint, freedom)
    scaled = joint.scaled(1.0 / s.place.unit)
    attached = (Attachment(vec(tuple(origin))) for origin in s.traced.origins)
    measured: Any = scaled.measured(freedom, *attached)
    primitive, per_rate = (_with_drive(measured, c, rate, c_tt) for rate in (c_t, 1.0))
    poses = _poses(s.state)
    twists = [Twist(vec(tuple(x[:3])), vec(tuple(x[3:]))) for x in (s.rate[:6], s.rate[6:12])]
    (row,), (phi,) = primitive.rows(*poses), primitive.phi(*poses)
    (nu,), (one,), (gamma,) = (
        primitive.nu(*poses),
        per_rate.nu(*poses),
        primitive.gamma(*poses, *twists),
    )
    entries = np.array([x + np.zeros(s.lanes) for part in row for x in part])
    rates, accelerations = s.rate[: 2 * COLUMNS], s.acceleration[: 2 * COLUMNS]
    speed, pull = np.linalg.norm(rates, axis=0), np.linalg.norm(accelerations, axis=0)
    there, further = s.state, 0.0
    if freedom == "rotation":
        further = np.linspace(-WAY, WAY, s.lanes)
        there = _turned_on(s, joint, further)
    lost, far = _turns(measured, there, c + further, turning=freedom == "rotation")
    figures = (
        np.maximum(np.abs(phi), np.abs(far)),
        ((entries * rates).sum(axis=0) - nu) / (1.0 + speed),
        ((entries * accelerations).sum(axis=0) - gamma) / (1.0 + speed**2 + pull),
        np.abs(entries - one * wrench).max(axis=0),
        lost,
    )
    size = np.linalg.norm(entries, axis=0)
    return np.abs(figures) / np.where(size > 0.0, size, 1.0)


def _poses(state: Array) -> list[Pose]:
    return [Pose.of(vec(tuple(x[:3])), quat(x[3:])) for x in (state[:7], state[7:POSES])]


def _with_drive(measured: Any, c: Any, c_t: Any = 0.0, c_tt: Any = 0.0) -> Any:
    return replace(measured, drive=Drive(c, c_t, c_tt, np.cos(0.5 * c), np.sin(0.5 * c)))


def _turned_on(s: Specimen, joint: AxialJoint, angle: Array) -> Array:
    """Return the state with body j turned further about the axis."""
    h, state = rotate_vectors(s.state[3:7].T, np.array(joint.axis)), s.state.copy()
    h /= np.linalg.norm(h, axis=1)[:, None]
    arm = np.array(joint.point) / s.place.unit - s.traced.origins[1]
    turn = Quat(np.cos(0.5 * angle), vec([*(np.sin(0.5 * angle) * h.T)]))
    state[10:14] = np.array([*(turn * quat(s.state[10:14]))])
    state[7:10] += (rotate_vectors(s.state[10:14].T, arm) - rotate_vectors(state[10:14].T, arm)).T
    return state


def _turns(measured: Any, state: Array, c: Array, *, turning: bool) -> tuple[Array, Array]:
    """Return one where a branch test refuses the drive's value, or accepts a zero of phi a turn
    further; and phi.
    """
    pair = _poses(state)
    wrong = np.zeros(state.shape[1], np.bool_)
    at_turns: list[Array] = []
    for turns in (0, 1) if turning else (0,):
        primitive = _with_drive(measured, c + 2.0 * np.pi * turns)
        (phi,) = primitive.phi(*pair)
        tests = [np.ones_like(c), *primitive.branch(*pair)]
        accepted = np.min(np.broadcast_arrays(*tests), axis=0) > 0.0
        wrong |= accepted & (np.abs(phi) < AMPLIFIED.value) if turns else ~accepted
        at_turns.append(phi + 0.0 * c)
    return wrong.astype(np.float64), at_turns[0]


def _slide(i: CarriedPoint, j: CarriedPoint, h: Array) -> tuple[list[Array], Array]:
    """Return the displacement with its rates, and the wrench of a unit force on both bodies."""
    d, d_t, d_tt = j.place - i.place, j.v - i.v, j.a - i.a
    h_t = np.cross(i.w, h)
    h_tt = np.cross(i.w_t, h) + np.cross(i.w, h_t)
    acceleration = _dot(h, d_tt) + 2.0 * _dot(h_t, d_t) + _dot(h_tt, d)
    values = [_dot(h, d), _dot(h, d_t) + _dot(h_t, d), acceleration]
    # the force on the first body acts at the same place, beyond its own point
    torques = -np.cross(i.arm + d, h), np.cross(j.arm, h)
    return values, np.hstack([-h, torques[0], h, torques[1]]).T


def _rotation(
    s: Specimen, i: CarriedPoint, j: CarriedPoint, h: Array, axis: Array
) -> tuple[list[Array], Array]:
    """Return the angle with its rates, and the wrench of a unit couple on both bodies."""
    p, q = s.state[3:7], s.state[10:14]
    cosine = (p * q).sum(axis=0)
    # axis . (vector part of conjugate(p) q)
    vector = p[0] * q[1:] - q[0] * p[1:] - np.cross(p[1:], q[1:], axis=0)
    angle = 2.0 * np.arctan2(axis @ vector, cosine)
    w, w_t = j.w - i.w, j.w_t - i.w_t
    values = [angle, _dot(h, w), _dot(h, w_t) + _dot(np.cross(i.w, h), w)]
    return values, np.hstack([0.0 * h, -h, 0.0 * h, h]).T


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=1)
