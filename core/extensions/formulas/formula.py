"""Formulas in the notation of Adams functions: parsed, and never evaluated as code.

Numbers, + - * / **, parentheses and calls of functions; 30D is an angle in degrees. What a name
means depends on the use: a motion knows TIME and curves over it, a spring what it measures.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias, cast

import numpy as np

from ...errors import MechanismError, remedy
from ...jet import Jet

Function: TypeAlias = Callable[..., Any]
Functions: TypeAlias = Mapping[str, Function]

LONGEST, DEEPEST = 10_000, 40
_TOKEN = re.compile(
    r"\s*(?:((?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?[Dd]?)(?![\w.])|([A-Za-z_]\w*)|(\*\*|[-+*/(),:]))"
)
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]([-+]?\d{1,3}))?([Dd]?)")
CONSTANTS = {"PI": math.pi, "RTOD": 180.0 / math.pi, "DTOR": math.pi / 180.0}
MOST_POWERS = 31


def number(text: str) -> float:
    """Return a number: 1.5E3, 1D3 as Fortran writes it, or 90D, which is degrees [rad].

    Raises:
        ValueError: it is none.
    """
    found = _NUMBER.fullmatch(text.strip())
    if found is None or not text.isascii():
        raise ValueError(text)
    value = float(f"{found[1]}E{found[2] or 0}")
    if not math.isfinite(value):
        raise ValueError(text)
    return math.radians(value) if found[3] else value


def evaluate(formula: str, functions: Functions) -> Any:
    """Return the value of a formula: a number, or what the functions make.

    Args:
        functions: by name in capitals; TIME and others without arguments are called without any.

    Raises:
        MechanismError: it is no formula, or has another function.
    """
    if len(formula) > LONGEST:
        raise MechanismError(f"found {len(formula)} characters, expected {LONGEST} at most")
    with np.errstate(all="ignore"):
        return _Parser(formula, functions).whole()


class _Parser:
    """Recursive descent over the tokens of a formula."""

    def __init__(self, formula: str, functions: Functions) -> None:
        self.tokens: list[str] = []
        place, end = 0, len(formula.rstrip())
        while place < end:
            found = _TOKEN.match(formula, place)
            if found is None:
                rest = formula[place:].strip()[:20]
                raise MechanismError(f"found {rest!r}, expected a number, a name or an operator")
            self.tokens.append(found[0].strip())
            place = found.end()
        self.functions = {**{name: _constant(x) for name, x in CONSTANTS.items()}, **functions}
        self.depth = 0

    def whole(self) -> Any:
        value = self.sum()
        if self.tokens:
            raise MechanismError(f"found {self.tokens[0]!r} after the formula's end")
        return value

    def take(self, *wanted: str) -> str:
        """Return the next token and leave it behind; one of those wanted, if any are."""
        if not self.tokens or (wanted and self.tokens[0] not in wanted):
            found = repr(self.tokens[0]) if self.tokens else "its end"
            raise MechanismError(f"found {found}, expected {' or '.join(wanted) or 'a number'}")
        return self.tokens.pop(0)

    def follows(self, *wanted: str) -> bool:
        return bool(self.tokens) and self.tokens[0] in wanted

    def sum(self) -> Any:
        value = self.product()
        while self.follows("+", "-"):
            minus, other = self.take() == "-", self.product()
            value = value + (-other if minus else other)
        return value

    def nest(self, part: Callable[[], Any]) -> Any:
        self.depth += 1
        if self.depth > DEEPEST:
            raise MechanismError(f"found more than {DEEPEST} nested parentheses, expected fewer")
        value = part()
        self.depth -= 1
        return value

    def product(self) -> Any:
        value = self.factor()
        while self.follows("*", "/"):
            over, other = self.take() == "/", self.factor()
            value = _quotient(value, other) if over else value * other
        return value

    def factor(self) -> Any:
        signs = 1.0
        while self.follows("+", "-"):
            signs = -signs if self.take() == "-" else signs
        value = self.power()
        return value if signs > 0.0 else -value

    def power(self) -> Any:
        base = self.atom()
        if not self.follows("**"):
            return base
        self.take()
        minus = self.follows("-")
        if self.follows("+", "-"):
            self.take()
        exponent = self.nest(self.power)
        return _power(base, -exponent if minus else exponent)

    def atom(self) -> Any:
        token = self.take()
        if token == "(":
            value = self.nest(self.sum)
            self.take(")")
            return value
        if token[0].isdigit() or token[0] == ".":
            try:
                return number(token)
            except ValueError:
                raise MechanismError(f"found {token!r}, expected a number below 1.8E308") from None
        name = token.upper()
        if not token[0].isalpha():
            raise MechanismError(f"found {token!r}, expected a number or a name")
        if name not in self.functions:
            raise MechanismError(f"found {name}, which is not read; {remedy(name, self.functions)}")
        arguments: list[Any] = []
        if self.follows("("):
            self.take()
            arguments.append(self.nest(self.sum))
            while self.take(",", ")") == ",":
                arguments.append(self.nest(self.sum))
        return self.call(name, arguments)

    def call(self, name: str, arguments: Sequence[Any]) -> Any:
        try:
            return self.functions[name](*arguments)
        except MechanismError:
            raise
        except TypeError:
            raise MechanismError(
                f"found {name} with {len(arguments)} arguments that do not fit; give those of Adams"
            ) from None
        except (ArithmeticError, ValueError):
            raise MechanismError(f"found {name} of numbers that it is not defined for") from None


def _constant(value: float) -> Function:
    return lambda: value


def _quotient(value: Any, other: Any) -> Any:
    if isinstance(other, float) and other == 0.0:
        raise MechanismError("found a division by zero")
    if isinstance(other, Jet):
        return value * _power(other, -1.0)
    try:
        return value / other
    except OverflowError:
        raise MechanismError("found a number beyond all limits") from None


def _power(base: Any, exponent: Any) -> Any:
    """Return a power with a constant exponent."""
    if not isinstance(exponent, float):
        raise MechanismError("found an exponent that varies, expected a number")
    if isinstance(base, Jet):
        n = exponent
        return _compose(
            base,
            base.x**n,
            n * base.x ** (n - 1.0) if n else np.zeros_like(base.x),
            n * (n - 1.0) * base.x ** (n - 2.0) if n not in (0.0, 1.0) else np.zeros_like(base.x),
        )
    try:
        value = base**exponent
    except ArithmeticError:
        raise MechanismError("found a power beyond all limits") from None
    if isinstance(value, complex):
        raise MechanismError("found a root of a negative number")
    return value


def _compose(x: Jet, value: Any, slope: Any, bend: Any) -> Jet:
    """Return a function of a jet by its value and first two derivatives there."""
    return Jet(value, slope * x.v, slope * x.a + bend * x.v**2)


def _curve(value: Function, derivatives: Callable[[Any, Any], tuple[Any, Any]]) -> Function:
    """Return a function of a number or a jet.

    Args:
        derivatives: of x and the value there: the first two.
    """

    def curve(x: Any) -> Any:
        if not isinstance(x, Jet):
            found = float(value(x))
            if not math.isfinite(found):
                raise ValueError
            return found
        at = value(x.x)
        return _compose(x, at, *derivatives(x.x, at))

    return curve


def step(x: Any, x0: Any, h0: Any, x1: Any, h1: Any) -> Any:
    """Return the cubic from h0 at x0 to h1 at x1, and these beyond."""
    if not (isinstance(x, Jet) and isinstance(x0, float) and isinstance(x1, float)):
        raise TypeError
    if not x1 > x0:
        raise MechanismError(
            f"found a step from {x0:g} to {x1:g}, expected its end beyond its start"
        )
    width = x1 - x0
    s = np.clip((x.x - x0) / width, 0.0, 1.0)
    inside = (x.x >= x0) & (x.x <= x1)
    slope, bend = 6.0 * s * (1.0 - s), (6.0 - 12.0 * s) * inside
    part = _compose(x, s * s * (3.0 - 2.0 * s), slope / width, bend / width**2)
    return h0 + (h1 - h0) * part


def polynomial(x: Any, x0: float, *coefficients: float) -> Any:
    """Return a0 + a1 (x - x0) + a2 (x - x0)^2 + ..."""
    if not 0 < len(coefficients) <= MOST_POWERS:
        raise TypeError
    off, value = x - x0, coefficients[-1]
    for each in coefficients[-2::-1]:
        value = off * value + each
    return value


def harmonic(x: Any, x0: float, a: float, w: float, phase: float = 0.0, mean: float = 0.0) -> Any:
    """Return a sin(w (x - x0) - phase) + mean."""
    return a * CURVES["SIN"](w * (x - x0) - phase) + mean


CURVES: Functions = {
    "SIN": _curve(np.sin, lambda x, y: (np.cos(x), -y)),
    "COS": _curve(np.cos, lambda x, y: (-np.sin(x), -y)),
    "SQRT": _curve(np.sqrt, lambda x, y: (0.5 / y, -0.25 / (x * y))),
}
"""Functions of numbers and jets."""
OVER_TIME: Functions = {
    **CURVES,
    "STEP": step,
    "POLY": polynomial,
    "SHF": harmonic,
}


def jet_of(formula: str, times: Any) -> Jet:
    """Return a formula over TIME at times, with its first two derivatives.

    Raises:
        MechanismError: it is no formula, or has another function.
    """
    t = np.asarray(times, dtype=np.float64)
    time = Jet(t, np.ones_like(t), np.zeros_like(t))
    found = evaluate(formula, {**OVER_TIME, "TIME": lambda: time})
    if isinstance(found, Jet):
        return found
    still = np.zeros_like(t)
    return Jet(still + cast("float", found), still, still)
