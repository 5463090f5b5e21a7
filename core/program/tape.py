"""Traced scalars: run an equation on them and the operations it needs are written down, each once.

Zeros, ones and signs fold as they are written, equal operations are shared (hash consing), and a
program keeps only what its outputs need. What a scene does not use is therefore not in its
programs, without anyone deciding so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias, cast

from ..algebra import Scalar

Node: TypeAlias = tuple[str, *tuple[float, ...]]
"""An operation and its operands: node numbers, or for "input" a slot, or for "const" a value; see
`LEAVES`.

"+", "-", "*", "/", "neg", "sqrt", "sin", "cos", "abs", "min", "max" act on numbers ("min" and "max"
propagate NaN); "larger" a b is true where |a| > |b|; "where" m p q is p where m is true, else q;
"before" x a is the x of the lane before, and a in the first lane.
"""
LEAVES = frozenset({"input", "const", "node"})
"""What has no operands. "node" s k is what stands in slot s of the lane that is number k of
`NODES`, for all lanes alike.
"""
NODES = 6
"""Lanes that later ones may be extrapolated from, about as far from each other: of a group, or of
several that follow one another where a group has fewer."""


class Tape:
    """The list of operations traced so far."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._known: dict[Node, int] = {}

    def node(self, *node: str | float) -> Traced:
        """The scalar of an operation, written down unless an equal one is there already."""
        key: Node = node  # type: ignore[assignment]
        number = self._known.get(key)
        if number is None:
            number = self._known[key] = len(self.nodes)
            self.nodes.append(key)
        return Traced(self, number)

    def input(self, slot: int) -> Traced:
        """The value that stands in a slot of the lanes when the program runs."""
        return self.node("input", slot)

    def at(self, k: int, slot: int) -> Traced:
        """The value that stands in a slot of a lane: the one that is number k of `NODES`."""
        return self.node("node", slot, k)

    def number(self, a: Scalar) -> int:
        """The node of a scalar, constants included."""
        return a.number if isinstance(a, Traced) else self.node("const", float(a)).number


class Traced:
    """A scalar known only when the program runs."""

    __slots__ = ("number", "tape")

    def __init__(self, tape: Tape, number: int) -> None:
        self.tape = tape
        self.number = number

    def __add__(self, b: Scalar) -> Scalar:
        return _add(self, b)

    def __radd__(self, a: Scalar) -> Scalar:
        return _add(a, self)

    def __sub__(self, b: Scalar) -> Scalar:
        return _sub(self, b)

    def __rsub__(self, a: Scalar) -> Scalar:
        return _sub(a, self)

    def __mul__(self, b: Scalar) -> Scalar:
        # a vector on the right does the product itself
        return _scale("*", self, b) if isinstance(b, Traced | float | int) else NotImplemented

    def __rmul__(self, a: Scalar) -> Scalar:
        return _scale("*", a, self)

    def __truediv__(self, b: Scalar) -> Scalar:
        return _scale("/", self, b)

    def __rtruediv__(self, a: Scalar) -> Scalar:
        return _scale("/", a, self)

    def __neg__(self) -> Scalar:
        negated = self._negated
        return self.tape.node("neg", self.number) if negated is None else negated

    def sqrt(self) -> Scalar:
        """The square root."""
        return self.tape.node("sqrt", self.number)

    @staticmethod
    def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Scalar:
        """p where |a| > |b|, else q."""
        return where_larger(a, b, p, q)

    @property
    def _negated(self) -> Traced | None:
        """The x of a scalar that is -x."""
        op, *operands = self.tape.nodes[self.number]
        return Traced(self.tape, int(operands[0])) if op == "neg" else None


def _same(a: Scalar, b: Scalar) -> bool:
    return isinstance(a, Traced) and isinstance(b, Traced) and a.number == b.number


def _opposite(a: Scalar) -> Scalar | None:
    """-a where a is written with a minus sign, else None."""
    if isinstance(a, Traced):
        return a._negated  # pyright: ignore[reportPrivateUsage]
    return -a if a < 0.0 else None


def _operation(op: str, a: Scalar, b: Scalar) -> Traced:
    tape: Tape = a.tape if isinstance(a, Traced) else b.tape
    i, j = tape.number(a), tape.number(b)
    if op in "+*" and i > j:
        i, j = j, i
    return tape.node(op, i, j)


def _add(a: Scalar, b: Scalar) -> Scalar:
    if not isinstance(a, Traced) and a == 0.0:
        return b
    if not isinstance(b, Traced) and b == 0.0:
        return a
    minus_b, minus_a = _opposite(b), _opposite(a)
    if minus_b is not None:
        return _sub(a, minus_b)
    if minus_a is not None:
        return _sub(b, minus_a)
    return _operation("+", a, b)


def _sub(a: Scalar, b: Scalar) -> Scalar:
    if not isinstance(b, Traced) and b == 0.0:
        return a
    if not isinstance(a, Traced) and a == 0.0:
        return -b
    if _same(a, b):
        return 0.0
    minus_b = _opposite(b)
    if minus_b is not None:
        return _add(a, minus_b)
    minus_a = _opposite(a)
    if minus_a is not None:
        return -_add(minus_a, b)
    return _operation("-", a, b)


def _scale(op: str, a: Scalar, b: Scalar) -> Scalar:
    if not isinstance(a, Traced) and (a == 0.0 or (op == "*" and a in (1.0, -1.0))):
        return 0.0 if a == 0.0 else b if a == 1.0 else -b
    if not isinstance(b, Traced) and ((op == "*" and b == 0.0) or b in (1.0, -1.0)):
        return 0.0 if b == 0.0 else a if b == 1.0 else -a
    minus_a, minus_b = _opposite(a), _opposite(b)
    if minus_a is not None and minus_b is not None:
        return _scale(op, minus_a, minus_b)
    if minus_a is not None:
        return -_scale(op, minus_a, b)
    if minus_b is not None:
        return -_scale(op, a, minus_b)
    return _operation(op, a, b)


def _unary(op: str, a: Scalar, value: Callable[[float], float]) -> Scalar:
    return a.tape.node(op, a.number) if isinstance(a, Traced) else value(a)


def sin(a: Scalar) -> Scalar:
    """Sine of a float or traced scalar [rad]."""
    return _unary("sin", a, math.sin)


def cos(a: Scalar) -> Scalar:
    """Cosine of a float or traced scalar [rad]."""
    return _unary("cos", a, math.cos)


def absolute(a: Scalar) -> Scalar:
    """|a|."""
    return _unary("abs", a, abs)


def _extreme(op: str, a: Scalar, b: Scalar, value: Callable[[float, float], float]) -> Scalar:
    if isinstance(a, Traced) or isinstance(b, Traced):
        return a if _same(a, b) else _operation(op, a, b)
    return value(a, b) if b == b else b  # Python's own keep a where b is NaN


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of a and b; NaN if either is."""
    return _extreme("min", a, b, min)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """The larger of a and b; NaN if either is."""
    return _extreme("max", a, b, max)


def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Scalar:
    """p where |a| > |b|, else q; every lane decides for itself."""
    if _same(p, q) or (not isinstance(p, Traced) and not isinstance(q, Traced) and p == q):
        return p
    tape = next((x.tape for x in (a, b) if isinstance(x, Traced)), None)
    if tape is None:
        return p if abs(a) > abs(b) else q
    larger = tape.node("larger", tape.number(a), tape.number(b))
    return tape.node("where", larger.number, tape.number(p), tape.number(q))


def before(x: Traced, first: Traced) -> Scalar:
    """The x of the lane before; in the first lane, `first`."""
    return x.tape.node("before", x.number, first.number)


def operands(node: Node) -> tuple[int, ...]:
    """The nodes an operation reads."""
    return () if node[0] in LEAVES else cast("tuple[int, ...]", node[1:])


def groups_behind(lanes: int) -> int:
    """How many groups of so many lanes `NODES` are among."""
    return -(-NODES // lanes)


def place_of(k: int, lanes: int) -> tuple[int, int]:
    """Number k of `NODES`: in which of those groups, the earliest first, and which of its lanes."""
    return divmod(k * (groups_behind(lanes) * lanes - 1) // (NODES - 1), lanes)
