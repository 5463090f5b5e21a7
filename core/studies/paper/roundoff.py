"""Round-off of rows: float64 against the same equations in 50-digit arithmetic, on exactly the same
inputs.

Two bodies meet the condition up to a tilt as before Newton's last iteration: no product cancels by
luck. Their velocities are admissible, of 1 m/s and 1 rad/s in size. Poses are made from Euler
parameters in either arithmetic: the rounding of A(p) counts too.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, cast

import msgspec
import numpy as np

from ...algebra import Quat, Vec3, cross
from ...errors import KincheckError
from ...primitives import Pose, Twist
from ...trajectory import Array
from .operations import AXES, DOTS, SIMPLIFIED
from .textbook import Condition, conditions

DIGITS = 50
DISTANCES = (1.0, 1e3, 1e6)
TILT = 1e-6
# Arms and positions are on a grid that holds all of 1e6 m in 53 digits: sums and differences of
# them are exact, and so all ways get the same inputs, be they displacements from the design or
# positions.
GRID = 2.0**32

WAYS = {"printed": "as printed", **AXES}
"""Row style -> how it is named. As printed, (22) is summed from the left; the row styles take r_j -
r_i first.
"""


class Error(msgspec.Struct, frozen=True):
    """Largest absolute error over the entries of the rows of one state: root mean square and
    maximum over the states.
    """

    rms: float
    max: float


class RoundOff(msgspec.Struct, frozen=True):
    """Errors of one condition in one way of writing it [m, m/s^2 or 1/s^2, or -].

    Attributes:
        rows: DOTS or SIMPLIFIED, as in `Counted`.
        distance: of the bodies from the global origin [m]; null if positions do not enter.
    """

    condition: str
    rows: str
    way: str
    distance: float | None
    residual: Error
    jacobian: Error
    gamma: Error


@dataclass(frozen=True)
class Moving:
    """A body on its way: position, Euler parameters, velocity and angular velocity, global axes;
    lanes of states.
    """

    u: Vec3
    q: Quat
    v: Vec3
    w: Vec3

    def motion(self, body_axes: bool) -> Twist:
        """The velocities in the order of the rows' columns."""
        return (
            Twist(self.v, Pose.of(self.u, self.q).A.T @ self.w)
            if body_axes
            else Twist(self.v, self.w)
        )


@dataclass(frozen=True)
class States:
    """Random joints between two bodies on their way; lanes of them.

    Attributes:
        e0: from the origin of body i to the origin of body j at design, with P_i at P_j.
    """

    conditions: tuple[Condition, ...]
    i: Moving
    j: Moving
    e0: Vec3


def measure_roundoff(seed: int, states: int) -> list[RoundOff]:
    """Return the errors of the conditions of Table 3 in all ways, over random states.

    Raises:
        KincheckError: mpmath is not installed.
    """
    try:
        mpmath: Any = importlib.import_module("mpmath")
    except ImportError:
        raise KincheckError(
            "bench formulation: mpmath is not installed, expected for the 50-digit arithmetic; pip"
            " install mpmath"
        ) from None
    found: list[RoundOff] = []
    with mpmath.workdps(DIGITS):
        for number, name in enumerate(("d10", "d11", "d12", "d20", "d21")):
            for distance in DISTANCES if name in ("d20", "d21") else DISTANCES[:1]:
                known = _states(
                    np.random.default_rng(seed), states, distance, turning=name in ("d10", "d11")
                )
                for rows, style, equations in _written(known.conditions[number]):
                    j = replace(known.j, u=known.e0 + known.j.u) if style == "printed" else known.j
                    errors = _errors(equations, known.i, j, mpmath.mpf)
                    found.append(
                        RoundOff(
                            name,
                            rows,
                            WAYS[style],
                            distance if name in ("d20", "d21") else None,
                            *errors,
                        )
                    )
    return found


def _written(condition: Condition) -> Iterator[tuple[str, str, Sequence[Any]]]:
    """Return rows, style and equations of all ways to write a condition."""
    yield DOTS, "printed", condition.printed(formed=True)
    for style in ("conventional", "paper", "native"):
        yield DOTS, style, condition.unsimplified(style)
    for style in ("paper", "native") if condition.is_simplified else ():
        yield SIMPLIFIED, style, condition.simplified(style)


def _errors(
    equations: Sequence[Any], i: Moving, j: Moving, exact: Callable[[Any], Any]
) -> list[Error]:
    """Return the errors of residual, Jacobian and gamma."""
    to_exact = cast("Callable[[Any], Any]", np.frompyfunc(exact, 1, 1))
    motions = [each.motion(equations[0].body_axes) for each in (i, j)]
    rounded = _values(equations, (i, j), motions)
    exactly = _values(*(_mapped(to_exact, each) for each in (list(equations), [i, j], motions)))
    found: list[Error] = []
    for values, true in zip(rounded, exactly, strict=True):
        off = [abs(to_exact(a) - b) for a, b in zip(values, true, strict=True)]
        lanes = [np.broadcast_to(np.asarray(each, dtype=np.float64), i.u.x.shape) for each in off]
        worst: Array = np.max(lanes, axis=0)
        found.append(Error(float(np.sqrt(np.mean(worst**2))), float(worst.max())))
    return found


def _values(
    equations: Sequence[Any], bodies: Sequence[Moving], motions: Sequence[Twist]
) -> tuple[list[Any], ...]:
    """Return residuals, entries of the Jacobian and right-hand sides."""
    pair = [Pose.of(body.u, body.q) for body in bodies]
    return (
        [x for each in equations for x in each.phi(*pair)],
        [x for each in equations for row in each.rows(*pair) for block in row for x in block],
        [x for each in equations for x in each.gamma(*pair, *motions)],
    )


def _mapped(number: Callable[[Any], Any], value: Any) -> Any:
    """Return a copy with every number replaced."""
    if isinstance(value, list):
        return [_mapped(number, each) for each in cast("list[Any]", value)]
    if is_dataclass(value) and not isinstance(value, type):
        return replace(
            value,
            **{each.name: _mapped(number, getattr(value, each.name)) for each in fields(value)},
        )
    return value if isinstance(value, bool) else number(value)


def _states(rng: np.random.Generator, n: int, distance: float, *, turning: bool) -> States:
    """Return states in which one body turns about the other's h, or slides along it."""

    def vector() -> Vec3:
        return Vec3(*rng.normal(size=(3, n)))

    def unit(a: Vec3) -> Vec3:
        return (1.0 / np.sqrt(a @ a)) * a

    def rotation(axis: Vec3, angle: Array | float) -> Quat:
        return Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * axis)

    def gridded(a: Vec3) -> Vec3:
        return Vec3(*(np.round(x * GRID) / GRID for x in a))

    h = unit(vector())
    f = unit(cross(vector(), h))
    s_i, s_j = gridded(vector()), gridded(vector())
    u, q = (
        gridded(distance * unit(vector())),
        rotation(unit(vector()), rng.uniform(-np.pi, np.pi, n)),
    )
    i = Moving(u, q, vector(), vector())
    angle, slide, rate, tilt = (
        rng.uniform(-np.pi, np.pi, n),
        rng.normal(size=n),
        rng.normal(size=n),
        unit(vector()),
    )
    turn = Pose.of(i.u, i.q).turn
    e0, axis, w, tilted = s_i - s_j, turn(h), i.w + TILT * tilt, rotation(tilt, TILT) * i.q
    if turning:
        j = Moving(i.u, tilted * rotation(h, angle), i.v, w + rate * axis)
    else:
        e = turn(e0) + slide * axis
        j = Moving(gridded(i.u + e - e0), tilted, i.v + cross(i.w, e) + rate * axis, w)
    return States(conditions(f, cross(h, f), h, s_i, s_j), i, j, e0)


def verdict(errors: Iterable[RoundOff]) -> list[str]:
    """Return the conclusions from the errors; each figure in it is an error or a ratio of two."""
    by = {(each.condition, each.rows, each.way, each.distance): each for each in errors}
    near = (("d11", None), ("d21", DISTANCES[0]))

    def gain(name: str, at: float | None, quantity: str, dots: str, simplified: str) -> float:
        rough, simple = (
            by[name, *key, at] for key in ((DOTS, WAYS[dots]), (SIMPLIFIED, WAYS[simplified]))
        )
        return getattr(rough, quantity).rms / getattr(simple, quantity).rms

    def gains(dots: str, simplified: str) -> str:
        return ", ".join(
            f"{name} {gain(name, at, 'gamma', dots, simplified):.1f}" for name, at in near
        )

    others = [
        gain(name, at, quantity, "printed", "paper")
        for name, at in near
        for quantity in ("residual", "jacobian")
    ]
    last, first = (
        [by["d20", DOTS, WAYS[way], at].residual.rms for at in DISTANCES]
        for way in ("printed", "conventional")
    )
    return [
        (
            f"rms error of gamma, dot products over simplified rows: {gains('printed', 'paper')} as"
            f" printed over the paper's; by vector products {gains('paper', 'paper')} in paper's"
            f" axes, {gains('native', 'native')} in native axes. Of residual and Jacobian, as"
            f" printed over the paper's: {min(others):.1f} to {max(others):.1f}."
        ),
        (
            "(22) as printed, positions summed one by one, loses digits with the distance:"
            f" {_told(last)} m. With r_j - r_i first: {_told(first)} m, unsimplified. The order of"
            " the sum keeps the digits, not the simplification."
        ),
    ]


def _told(values: Sequence[float]) -> str:
    return ", ".join(
        f"{value:.0e} at {distance:.0e}" for value, distance in zip(values, DISTANCES, strict=True)
    )
