"""Programs run over any kind of scalar: lanes of real or complex numbers, jets, numbers
of any precision.

A kind is a table of the operations of a program for its scalars.
"""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ...algebra import Quat, quat, vec
from ...errors import MechanismError
from ...joints import Joint
from ...kinematics import COLUMNS, Cartesian, Frames, Relation, Style, constraints
from ...mechanism.mechanism import Body, Mechanism
from ...program import Program, Tape, program
from ...trajectory import Array

# Kinds of scalars: a table of the operations of a program for each.

Operation: TypeAlias = Callable[..., Any]


def _ordered(key: Operation) -> dict[str, Operation]:
    """Return the operations that compare, by a key of the scalars."""
    where: Operation = np.where

    def absolute(a: Any) -> Any:
        return where(key(a) < 0.0, -a, a)

    def smaller(a: Any, b: Any) -> Any:
        return where(key(a) <= key(b), a, b)

    def greater(a: Any, b: Any) -> Any:
        return where(key(a) >= key(b), a, b)

    def larger(a: Any, b: Any) -> Any:
        return abs(key(a)) > abs(key(b))

    return {"abs": absolute, "min": smaller, "max": greater, "larger": larger, "where": where}


_SUMS: dict[str, Any] = {"+": operator.add, "-": operator.sub, "neg": operator.neg}
_PRODUCTS: dict[str, Any] = {
    "*": operator.mul,
    "/": np.true_divide,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
}

NUMBERS: Mapping[str, Operation] = {**_SUMS, **_PRODUCTS, **_ordered(np.real)}
"""Operations of arrays of numbers. Complex numbers are ordered by their real parts, so the
imaginary parts stay derivatives.
"""


def _product(a: Array, b: Array) -> Array:
    return np.stack(
        [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
    )


def _quotient(a: Array, b: Array) -> Array:
    x = a[0] / b[0]  # x b = a, differentiated once and twice
    v = (a[1] - x * b[1]) / b[0]
    return np.stack([x, v, (a[2] - 2.0 * v * b[1] - x * b[2]) / b[0]])


def _chain(f: Callable[[Array], tuple[Array, Array, Array]]) -> Operation:
    """Return a function of a jet, from its value and first two derivatives."""

    def of(a: Array) -> Array:
        y, slope, bend = f(a[0])
        return np.stack([y, slope * a[1], slope * a[2] + bend * a[1] * a[1]])

    return of


JETS: Mapping[str, Operation] = {
    **_SUMS,
    "*": _product,
    "/": _quotient,
    "sqrt": _chain(lambda x: (np.sqrt(x), 0.5 / np.sqrt(x), -0.25 / (x * np.sqrt(x)))),
    "sin": _chain(lambda x: (np.sin(x), np.cos(x), -np.sin(x))),
    "cos": _chain(lambda x: (np.cos(x), -np.sin(x), -np.cos(x))),
    **_ordered(operator.itemgetter(0)),
}
"""Operations of arrays (3, ...): value, first and second derivative by time."""


def precise(digits: int) -> tuple[Mapping[str, Operation], Operation]:
    """Return the operations of numbers with the given digits, in arrays of objects, and the
    function that converts floats to them.

    Raises:
        ModuleNotFoundError: mpmath is not installed.
    """
    mpmath: Any = importlib.import_module("mpmath")
    context = mpmath.MPContext()
    context.dps = digits
    array_of: Any = np.frompyfunc
    functions: dict[str, Operation] = {
        name: array_of(getattr(context, name), 1, 1) for name in ("sqrt", "sin", "cos")
    }
    return {**NUMBERS, **functions}, array_of(context.mpf, 1, 1)


def execute(
    program: Program,
    kind: Mapping[str, Operation],
    inputs: Any,
    lift: Callable[[float], Any] = float,
) -> list[Any]:
    """Run a program over a kind of scalar and return its outputs in order.

    Args:
        inputs: values by slot.
        lift: conversion of constants to the kind.
    """
    values: list[Any] = []
    for op, *rest in program.nodes:
        if op == "input":
            values.append(inputs[int(rest[0])])
        elif op == "const":
            values.append(lift(rest[0]))
        elif len(rest) == 2:  # most operations; a call with any number takes twice as long
            values.append(kind[op](values[int(rest[0])], values[int(rest[1])]))
        else:
            values.append(kind[op](*(values[int(k)] for k in rest)))
    return [values[program.outputs[slot]] for slot in sorted(program.outputs)]


# MERGED

BODIES = "i", "j"
# u and q of two bodies
POSES = 14
COMPLEX_STEP = 1e-30
# h f' = sum of weight * f(k h), sixth order: at h = 0.01 truncation (h^6) and round-off (1e-16 / h)
# are both near 1e-13.
DIFFERENCE = 1e-2
WEIGHTS = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))


@dataclass(frozen=True)
class Place:
    """The origins of a joint's two bodies at design [m], and the unit of length [m]."""

    origins: tuple[tuple[float, ...], tuple[float, ...]]
    unit: float

    def scaled(self, factor: float) -> Place:
        """Return the place scaled by a factor, measured in metres."""
        return Place((_times(factor, self.origins[0]), _times(factor, self.origins[1])), 1.0)


class TracedJoint:
    """The equations of a joint as programs.

    Attributes:
        names: names of the rows, as "Dot11 row 2".
        parts: first and end row of each primitive.
        coordinates: named coordinates of the joint, as "joint.rotation".
        programs: phi, rows, nu, gamma and branch, over the slots of a state and a rate.

    Raises:
        MechanismError: there are no equations, they disagree in number, or are in body axes.
    """

    def __init__(self, joint: Joint, place: Place, style: Style = Style.NATIVE) -> None:
        mechanism = Mechanism("joint", [Body(name) for name in BODIES], [joint])
        origins = {
            name: (1.0 / place.unit) * vec(origin)
            for name, origin in zip(BODIES, place.origins, strict=True)
        }
        found = constraints(mechanism, Frames(place.unit, origins, BODIES), {}, style)
        equations = Cartesian(found, BODIES)
        self.coordinates = tuple(equations.coordinates)
        self.columns = equations.unknowns
        self.size = POSES + len(self.coordinates)
        self.origins = np.array([[*origins[name]] for name in BODIES])
        self._trace(equations)
        kinds = [
            (
                (Relation, 1)
                if isinstance(each, Relation)
                else (type(each.primitive), each.primitive.n)
            )
            for each in found
        ]
        self.names = [f"{kind.__name__} row {k + 1}" for kind, count in kinds for k in range(count)]
        if not self.names:
            raise MechanismError(
                f"{joint}: has 0 rows, expected one or more; return its primitives"
            )
        ends: list[int] = np.cumsum([count for _, count in kinds]).tolist()
        self.parts = [(end - count, end) for end, (_, count) in zip(ends, kinds, strict=True)]
        lengths = {name: len(self.programs[name].outputs) for name in ("phi", "nu", "gamma")}
        lengths["rows"] = len(self.programs["rows"].outputs) // self.columns
        if set(lengths.values()) != {len(self.names)}:
            found_them = ", ".join(f"{count} of {name}" for name, count in lengths.items())
            raise MechanismError(
                f"{joint}: {found_them}, expected {len(self.names)} of each, the sum of n of its"
                " primitives"
            )
        if style is Style.NATIVE and any(
            not isinstance(each, Relation) and each.primitive.body_axes for each in found
        ):
            raise MechanismError(
                f"{joint}: its primitives have rows in body axes; write them in global axes"
            )

    def _trace(self, equations: Cartesian) -> None:
        tape = Tape()
        inputs = [tape.input(slot) for slot in range(self.size + self.columns)]
        state: dict[str, Sequence[Any]] = {
            "u i": inputs[:3],
            "q i": inputs[3:7],
            "u j": inputs[7:10],
            "q j": inputs[10:14],
        }
        state |= {f"x {name}": [inputs[POSES + k]] for k, name in enumerate(self.coordinates)}
        at = equations.configuration(state)
        entries = [
            row.get(column, 0.0) for row in equations.rows(at) for column in range(self.columns)
        ]
        outputs: dict[str, Sequence[Any]] = {
            "phi": equations.phi(at),
            "rows": entries,
            "nu": equations.nu(at),
            "gamma": equations.gamma(at, inputs[self.size :]),
            "branch": equations.branch(at),
        }
        self.programs = {
            name: program(name, tape, dict(enumerate(values))) for name, values in outputs.items()
        }

    @property
    def rows_left(self) -> int:
        """Number of rows less named coordinates: freedoms removed by the joint if its
        rows are independent.
        """
        return len(self.names) - len(self.coordinates)

    def _run(self, name: str, inputs: Any, shape: tuple[int, ...]) -> Array:
        with np.errstate(all="ignore"):
            found = execute(self.programs[name], NUMBERS, inputs)
        return np.array([np.broadcast_to(each, shape) for each in found]).reshape(
            len(found), *shape
        )

    def phi(self, state: Array) -> Array:
        """Return the residuals, shape (rows, ...)."""
        return self._run("phi", state, state.shape[1:])

    def rows(self, state: Array) -> Array:
        """Return the Jacobian declared by the joint, shape (lanes, rows, columns)."""
        found = self._run("rows", state, state.shape[1:])
        return np.moveaxis(found.reshape(len(self.names), self.columns, -1), 2, 0)

    def nu(self, state: Array) -> Array:
        """Return the right-hand sides of the velocity equations, shape (rows, lanes)."""
        return self._run("nu", state, state.shape[1:])

    def gamma(self, state: Array, rate: Array) -> Array:
        """Return the right-hand sides of the acceleration equations, shape (rows, lanes)."""
        return self._run("gamma", np.concatenate([state, rate]), state.shape[1:])

    def branch(self, state: Array) -> Array:
        """Return the smallest of the branch tests, shape (lanes,); 1 if there is none."""
        return self._run("branch", state, state.shape[1:]).min(axis=0, initial=1.0)

    def exact(self, state: Array) -> Array:
        """Return the exact Jacobian of phi by complex steps, shape (lanes, rows, columns)."""
        steps = np.repeat(np.eye(self.columns)[:, :, None], state.shape[1], axis=2) * (
            1j * COMPLEX_STEP
        )
        # the length changes by the square of the step, below round-off
        moved = self._moved(state[:, None, :], steps, lambda a: a)
        return np.moveaxis(self.phi(moved).imag / COMPLEX_STEP, (0, 1, 2), (1, 2, 0))

    def differences(self, state: Array) -> Array:
        """Return the Jacobian of phi by central differences of sixth order, shape
        (lanes, rows, columns).
        """
        directions = np.repeat(np.eye(self.columns)[:, :, None], state.shape[1], axis=2)
        total: Any = 0.0
        for k, weight in WEIGHTS:
            total = total + weight * self.phi(
                self._moved(state[:, None, :], k * DIFFERENCE * directions, _normalised)
            )
        return np.moveaxis(total / DIFFERENCE, (0, 1, 2), (1, 2, 0))

    def retract(self, state: Array, step: Array) -> Array:
        """Return the state after a step (columns, lanes)."""
        return self._moved(state, step, _normalised)

    def _moved(self, state: Array, step: Any, ended: Callable[[Any], Any]) -> Any:
        parts: list[Any] = []
        for k in range(2):
            u, q = state[7 * k : 7 * k + 3], state[7 * k + 3 : 7 * k + 7]
            dr, half = (
                step[COLUMNS * k : COLUMNS * k + 3],
                0.5 * step[COLUMNS * k + 3 : COLUMNS * (k + 1)],
            )
            turned = Quat(1.0, vec(tuple(half))) * quat(q)
            parts += [u + dr, ended(np.stack([*turned]))]
        return np.concatenate([*parts, state[POSES:] + step[2 * COLUMNS :]])

    def jets(self, state: Array, rate: Array, acceleration: Array) -> Array:
        """Return phi along a motion: value, first and second derivative by time, shape
        (3, rows, lanes).
        """
        jets: list[Array] = []
        for k in range(2):
            u, q = state[7 * k : 7 * k + 3], quat(state[7 * k + 3 : 7 * k + 7])
            v, w = (
                rate[COLUMNS * k : COLUMNS * k + 3],
                vec(tuple(rate[COLUMNS * k + 3 : COLUMNS * (k + 1)])),
            )
            a, w_t = (
                acceleration[COLUMNS * k : COLUMNS * k + 3],
                vec(tuple(acceleration[COLUMNS * k + 3 : COLUMNS * (k + 1)])),
            )
            # q' = w q / 2, q'' = w' q / 2 - |w|^2 q / 4
            q_t, turning = Quat(0.0, 0.5 * w) * q, Quat(0.0, 0.5 * w_t) * q
            q_tt = [x - 0.25 * (w @ w) * y for x, y in zip(turning, q, strict=True)]
            jets += [np.stack([u, v, a]), np.array([[*q], [*q_t], q_tt])]
        jets.append(np.stack([state[POSES:], rate[2 * COLUMNS :], acceleration[2 * COLUMNS :]]))
        inputs = np.moveaxis(np.concatenate(jets, axis=1), 1, 0)

        def constant(value: float) -> Array:
            return np.array([value, 0.0, 0.0])[:, None]

        found = execute(self.programs["phi"], JETS, inputs, constant)
        return np.stack([np.broadcast_to(each, (3, state.shape[1])) for each in found], axis=1)


def _normalised(q: Any) -> Any:
    return q / np.sqrt((q * q).sum(axis=0))


def _times(factor: float, values: Sequence[float]) -> tuple[float, ...]:
    return tuple(factor * value for value in values)
