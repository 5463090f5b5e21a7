"""One joint between two free bodies, its equations traced once and run over any scalar.

The examined operations are those of an engine. They run over lanes of floats, over complex numbers
(an exact Jacobian: phi(x + i h) = phi + i h phi', without cancellation), over jets (value, first
and second derivative by time) and over numbers of any precision.

A state is an array (size, lanes): displacement and Euler parameters of body i, of body j, then the
joint's named coordinates, if any. A rate is (unknowns, lanes): v and w of body i, of body j, then
rates of the coordinates. Lengths are in the unit of the frame, so a joint of any size has numbers
of size one.
"""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from ...algebra import Quat, quat, vec
from ...errors import MechanismError
from ...jet import Jet, sqrt
from ...joints import Joint
from ...kinematics import COLUMNS, NATIVE, Cartesian, Frames, Relation, formulate
from ...mechanism.mechanism import Body, Mechanism
from ...program import Program, Tape, program
from ...program.tape import OPERATIONS
from ...trajectory import Array

BODIES = "i", "j"
# u and q of two bodies
POSES = 14
COMPLEX_STEP = 1e-30
Operations: TypeAlias = Mapping[str, Callable[..., Any]]
"""The operations of a program over a kind of scalar."""


def _operations(
    key: Callable[[Any], Any], where: Callable[..., Any], **functions: Callable[..., Any]
) -> Operations:
    """Return the operations over scalars with Python's operators.

    Args:
        key: real numbers by which scalars are compared.
        where: choice by a mask between two scalars.
    """
    of_one: dict[str, Callable[[Any], Any]] = {"abs": lambda a: where(key(a) < 0.0, -a, a)}
    of_two: dict[str, Callable[[Any, Any], Any]] = {
        "min": lambda a, b: where(key(a) <= key(b), a, b),
        "max": lambda a, b: where(key(a) >= key(b), a, b),
        "larger": lambda a, b: abs(key(a)) > abs(key(b)),
    }
    return {**OPERATIONS, **of_one, **of_two, "where": where, **functions}


# Complex numbers are ordered by their real parts, so the imaginary parts stay derivatives.
NUMBERS = _operations(np.real, np.where, sqrt=np.sqrt, sin=np.sin, cos=np.cos)


def _sine(a: Jet) -> Jet:
    y, slope = np.sin(a.x), np.cos(a.x)
    return Jet(y, slope * a.v, slope * a.a - y * a.v * a.v)


def _cosine(a: Jet) -> Jet:
    y, slope = np.cos(a.x), -np.sin(a.x)
    return Jet(y, slope * a.v, slope * a.a - y * a.v * a.v)


def _choice(mask: Any, a: Jet, b: Jet) -> Jet:
    return Jet(*(np.where(mask, p, q) for p, q in ((a.x, b.x), (a.v, b.v), (a.a, b.a))))


JETS = _operations(operator.attrgetter("x"), _choice, sqrt=sqrt, sin=_sine, cos=_cosine)


def precise(digits: int) -> tuple[Operations, Callable[..., Any]]:
    """Return the operations of numbers with the given digits, in arrays of objects, and the
    function that converts floats to them.

    Raises:
        ModuleNotFoundError: mpmath is not installed.
    """
    mpmath: Any = importlib.import_module("mpmath")
    context = mpmath.MPContext()
    context.dps = digits
    array_of: Any = np.frompyfunc
    functions = {name: array_of(getattr(context, name), 1, 1) for name in ("sqrt", "sin", "cos")}
    return {**NUMBERS, **functions}, array_of(context.mpf, 1, 1)


def execute(
    program: Program, kind: Operations, inputs: Any, lift: Callable[[float], Any] = float
) -> list[Any]:
    """Run a program over a kind of scalar and return its outputs in order."""
    found = program.run(kind, inputs, lift)
    return [found[slot] for slot in sorted(found)]


def rotate_vectors(q: Array, a: Array) -> Array:
    """Return vectors turned by Euler parameters, shapes (n, 4), (n, 3) or (3,) -> (n, 3)."""
    twice = 2.0 * np.cross(q[:, 1:], a)
    return a + q[:, :1] * twice + np.cross(q[:, 1:], twice)


@dataclass(frozen=True, eq=False)
class CarriedPoint:
    """A point of a moving body, global axes, shape (n, 3).

    Attributes:
        arm: from the body's origin to the point.
        place, v, a: of the point.
        w, w_t: angular velocity and acceleration of the body.
    """

    arm: Array
    place: Array
    v: Array
    a: Array
    w: Array
    w_t: Array

    @staticmethod
    def of(arm: Array, origin: Array, v: Array, w: Array, a: Array, w_t: Array) -> CarriedPoint:
        """Return the point from place, velocity and acceleration of the body's origin."""
        v, a = v + np.cross(w, arm), a + np.cross(w_t, arm) + np.cross(w, np.cross(w, arm))
        return CarriedPoint(arm, origin + arm, v, a, w, w_t)


@dataclass(frozen=True)
class Place:
    """The origins of a joint's two bodies at design [m], and the unit of length [m]."""

    origins: tuple[tuple[float, ...], tuple[float, ...]]
    unit: float

    def scaled(self, factor: float) -> Place:
        """Return the place scaled by a factor, measured in metres."""
        first, second = (tuple(factor * x for x in origin) for origin in self.origins)
        return Place((first, second), 1.0)


class TracedJoint:
    """The equations of a joint as programs.

    Attributes:
        names: names of the rows, as "Dot11 row 2".
        parts: first and end row of each primitive.
        coordinates: named coordinates of the joint, as "joint.rotation".
        programs: phi, rows, nu, gamma and branch, over the slots of a state and a rate.

    Raises:
        MechanismError: there are no equations, or they disagree in number.
    """

    def __init__(self, joint: Joint, place: Place, style: str = NATIVE) -> None:
        mechanism = Mechanism("joint", [Body(name) for name in BODIES], [joint])
        origins = {
            name: (1.0 / place.unit) * vec(origin)
            for name, origin in zip(BODIES, place.origins, strict=True)
        }
        equations = formulate(mechanism, Frames(place.unit, origins, BODIES), style)
        self.coordinates = tuple(equations.coordinates)
        self.columns = equations.unknowns
        self.size = POSES + len(self.coordinates)
        self.origins = np.array([[*origins[name]] for name in BODIES])
        self._trace(equations)
        self.names: list[str] = []
        self.parts: list[tuple[int, int]] = []
        for each in equations.constraints:
            kind, count = (
                (Relation, 1)
                if isinstance(each, Relation)
                else (type(each.primitive), each.primitive.n)
            )
            self.parts.append((len(self.names), len(self.names) + count))
            self.names += [f"{kind.__name__} row {k + 1}" for k in range(count)]
        if not self.names:
            raise MechanismError(
                f"{joint}: has 0 rows, expected one or more. Return its primitives."
            )
        lengths = {name: len(self.programs[name].outputs) for name in ("phi", "nu", "gamma")}
        lengths["rows"] = len(self.programs["rows"].outputs) // self.columns
        if set(lengths.values()) != {len(self.names)}:
            found_them = ", ".join(f"{count} of {name}" for name, count in lengths.items())
            raise MechanismError(
                f"{joint}: {found_them}, expected {len(self.names)} of each, the sum of n of its"
                " primitives"
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

    def _run(self, name: str, *inputs: Array) -> Array:
        shape = inputs[0].shape[1:]
        with np.errstate(all="ignore"):
            found = execute(self.programs[name], NUMBERS, np.concatenate(inputs))
        return np.array([np.broadcast_to(each, shape) for each in found]).reshape(
            len(found), *shape
        )

    def design(self, lanes: int) -> Array:
        """Return the design position in all lanes."""
        state = np.zeros((self.size, lanes))
        state[[3, 10]] = 1.0
        return state

    def phi(self, state: Array) -> Array:
        """Return the residuals, shape (rows, ...)."""
        return self._run("phi", state)

    def rows(self, state: Array) -> Array:
        """Return the Jacobian declared by the joint, shape (lanes, rows, columns)."""
        found = self._run("rows", state)
        return np.moveaxis(found.reshape(len(self.names), self.columns, -1), 2, 0)

    def nu(self, state: Array) -> Array:
        """Return the right-hand sides of the velocity equations, shape (rows, lanes)."""
        return self._run("nu", state)

    def gamma(self, state: Array, rate: Array) -> Array:
        """Return the right-hand sides of the acceleration equations, shape (rows, lanes)."""
        return self._run("gamma", state, rate)

    def branch(self, state: Array) -> Array:
        """Return the smallest of the branch tests, shape (lanes,); 1 if there is none."""
        return self._run("branch", state).min(axis=0, initial=1.0)

    def exact(self, state: Array) -> Array:
        """Return the exact Jacobian of phi by complex steps, shape (lanes, rows, columns)."""
        # one lane for each column: their lengths change by the square of the step, below round-off
        steps = 1j * COMPLEX_STEP * np.repeat(np.eye(self.columns)[:, :, None], state.shape[1], 2)
        found = self.phi(self.retract(state[:, None, :], steps))
        return np.moveaxis(found.imag / COMPLEX_STEP, 2, 0)

    @cached_property
    def exact_at_design(self) -> Array:
        """The same at the design position, one lane."""
        return self.exact(self.design(1))

    def retract(self, state: Array, step: Any) -> Any:
        """Return the state after a step (columns, lanes)."""
        parts: list[Any] = []
        for k in range(2):
            u, q = state[7 * k : 7 * k + 3], quat(state[7 * k + 3 : 7 * k + 7])
            shift, turn = np.split(step[COLUMNS * k : COLUMNS * (k + 1)], 2)
            ended = np.stack([*(Quat(1.0, vec([*(0.5 * turn)])) * q)])
            parts += [u + shift, ended / np.sqrt((ended * ended).sum(axis=0))]
        return np.concatenate([*parts, state[POSES:] + step[2 * COLUMNS :]])

    def jets(self, state: Array, rate: Array, acceleration: Array) -> Array:
        """Return phi along a motion: value, first and second derivative by time, shape
        (3, rows, lanes).
        """
        inputs: list[Jet] = []
        for k in range(2):
            u, q = state[7 * k : 7 * k + 3], quat(state[7 * k + 3 : 7 * k + 7])
            v, w = np.split(rate[COLUMNS * k : COLUMNS * (k + 1)], 2)
            a, w_t = np.split(acceleration[COLUMNS * k : COLUMNS * (k + 1)], 2)
            # q' = w q / 2, q'' = w' q / 2 - |w|^2 q / 4
            q_t, turning = (Quat(0.0, 0.5 * vec([*each])) * q for each in (w, w_t))
            q_tt = (x - 0.25 * (w * w).sum(axis=0) * y for x, y in zip(turning, q, strict=True))
            inputs += [*map(Jet, u, v, a), *map(Jet, q, q_t, q_tt)]
        own = slice(2 * COLUMNS, None)
        inputs += map(Jet, state[POSES:], rate[own], acceleration[own])
        still = np.zeros(state.shape[1])
        found = execute(
            self.programs["phi"], JETS, inputs, lambda value: Jet(still + value, still, still)
        )
        return np.array([[each.x, each.v, each.a] for each in found]).transpose(1, 0, 2)
