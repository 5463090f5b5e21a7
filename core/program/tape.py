"""Traced scalars: run an equation on them, and a tape records the needed operations, each once.

Zeros, ones and signs fold during the trace, equal operations are shared (hash consing), and a
program keeps only the operations its outputs need. Terms that a mechanism does not use are
therefore absent from its programs.

`jacobian` traces derivatives by the chain rule over the operations of a tape. Constants stay
operands there: folding would round them to doubles, and balls have to prove bounds of the result.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, cast

import numpy as np

from ..algebra import Scalar, arc_tangent, is_array, power, root
from ..trajectory import Array

if TYPE_CHECKING:
    Node: TypeAlias = tuple[str, *tuple[float, ...]]
else:  # as msgspec reads it from the cache
    Node = tuple[str | int | float, ...]
"""An operation and its operands: node numbers; for "input" a slot, for "const" a value; see
`LEAVES`.

"+", "-", "*", "/", "neg", "sqrt", "sin", "cos", "atan2", "abs", "min", "max" act on numbers ("min"
and "max" propagate NaN); "larger" a b is true if |a| > |b|; "where" m p q is p if m is true, else
q; "before" x a is x of the previous lane, and a in the first lane.
"""
LEAVES = frozenset({"input", "const", "node"})
"""Operations without operands. "node" s k is the value of slot s in lane k of the `NODES`, the same
for all lanes.
"""
NODES = 6
"""Number of lanes for extrapolation, about evenly spaced: in one group, or in several consecutive
groups if a group has fewer lanes.
"""


class Tape:
    """The list of operations traced so far.

    Attributes:
        nodes: the operations.
        scalars: their results; each operation has one scalar, so equal scalars are identical.
    """

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.scalars: list[Traced] = []
        self._known: dict[Node, Traced] = {}

    def node(self, *node: str | float) -> Traced:
        """Return the scalar of an operation; an equal operation is recorded only once."""
        key: Node = node  # type: ignore[assignment]
        scalar = self._known.get(key)
        if scalar is None:
            opposite = self.scalars[int(key[1])] if key[0] == "neg" else None
            scalar = self._known[key] = Traced(self, len(self.nodes), opposite)
            self.nodes.append(key)
            self.scalars.append(scalar)
        return scalar

    def known(self, *node: str | float) -> Traced | None:
        """Return the scalar of an operation if it is recorded."""
        return self._known.get(node)  # type: ignore[call-overload]

    def input(self, slot: int) -> Traced:
        """Return the value of a slot at run time."""
        return self.node("input", slot)

    def at(self, k: int, slot: int) -> Traced:
        """Return the value of a slot in lane k of the `NODES`."""
        return self.node("node", slot, k)

    def number(self, a: Scalar) -> int:
        """Return the node number of a scalar, constants included."""
        return a.number if isinstance(a, Traced) else self.node("const", float(a)).number


class Traced:
    """A scalar with a value at run time only; a tape makes it.

    Attributes:
        number: of its operation on the tape.
        opposite: the x of a scalar -x; None for other scalars.
    """

    __slots__ = ("number", "opposite", "tape")
    __array_ufunc__: ClassVar[None] = None  # a number of numpy times a scalar is a scalar

    def __init__(self, tape: Tape, number: int, opposite: Traced | None) -> None:
        self.tape = tape
        self.number = number
        self.opposite = opposite

    def __add__(self, b: Scalar) -> Scalar:
        return _add(self, b) if isinstance(b, NUMBERS) else NotImplemented

    def __radd__(self, a: Scalar) -> Scalar:
        return _add(a, self)

    def __sub__(self, b: Scalar) -> Scalar:
        return _sub(self, b) if isinstance(b, NUMBERS) else NotImplemented

    def __rsub__(self, a: Scalar) -> Scalar:
        return _sub(a, self)

    def __mul__(self, b: Scalar) -> Scalar:
        # Vec3.__rmul__ computes the product with a vector
        return _scale("*", self, b) if isinstance(b, NUMBERS) else NotImplemented

    def __rmul__(self, a: Scalar) -> Scalar:
        return _scale("*", a, self)

    def __truediv__(self, b: Scalar) -> Scalar:
        return _scale("/", self, b) if isinstance(b, NUMBERS) else NotImplemented

    def __rtruediv__(self, a: Scalar) -> Scalar:
        return _scale("/", a, self)

    def __neg__(self) -> Scalar:
        opposite = self.opposite
        return self.tape.node("neg", self.number) if opposite is None else opposite

    __pow__ = power

    def sqrt(self) -> Scalar:
        """Return the square root."""
        return self.tape.node("sqrt", self.number)

    def __abs__(self) -> Scalar:
        return absolute(self)

    @staticmethod
    def arc_tangent(y: Scalar, x: Scalar) -> Scalar:
        """Return the angle of the direction (x, y) [rad], in -pi..pi."""
        return _operation("atan2", y, x)

    @staticmethod
    def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Scalar:
        """Return p if |a| > |b|, else q."""
        return where_larger(a, b, p, q)


NUMBERS = (Traced, float, int)
"""Kinds of scalars for operations with a traced scalar; others do them themselves."""


def _unknown(a: Scalar) -> bool:
    """Return whether it is NaN, known before any computation."""
    return not isinstance(a, Traced) and a != a


def _same(a: Scalar, b: Scalar) -> bool:
    return a is b and isinstance(a, Traced)


def _opposite(a: Scalar) -> Scalar | None:
    """Return -a if a has a minus sign, else None."""
    if isinstance(a, Traced):
        return a.opposite
    return -a if a < 0.0 else None


def _operation(op: str, a: Scalar, b: Scalar) -> Scalar:
    if _unknown(a) or _unknown(b):
        return math.nan
    tape: Tape = a.tape if isinstance(a, Traced) else b.tape
    i, j = tape.number(a), tape.number(b)
    if op in "+*" and i > j:
        i, j = j, i
    if op == "-" and (turned := tape.known(op, j, i)) is not None:
        return -turned
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


def _lanes(*scalars: Scalar) -> bool:
    """Return whether any scalar is an array of lanes."""
    return any(map(is_array, scalars))


def _unary(op: str, a: Scalar, value: Callable[[float], float]) -> Scalar:
    if hasattr(a, "of"):
        return a.of(op, a)
    return a.tape.node(op, a.number) if isinstance(a, Traced) else value(a)


def sin(a: Scalar) -> Scalar:
    """Return the sine of a float, of lanes, or of a traced scalar [rad]."""
    return _unary("sin", a, np.sin if isinstance(a, np.ndarray) else math.sin)


def cos(a: Scalar) -> Scalar:
    """Return the cosine of a float, of lanes, or of a traced scalar [rad]."""
    return _unary("cos", a, np.cos if isinstance(a, np.ndarray) else math.cos)


def absolute(a: Scalar) -> Scalar:
    """Return |a|."""
    return _unary("abs", a, abs)


def _extreme(
    op: str, a: Scalar, b: Scalar, value: Callable[[float, float], float], of_lanes: np.ufunc
) -> Scalar:
    if isinstance(a, Traced) or isinstance(b, Traced):
        return a if _same(a, b) else _operation(op, a, b)
    if (moving := next((x for x in (a, b) if hasattr(x, "of")), None)) is not None:
        return moving.of(op, a, b)
    if _lanes(a, b):
        return cast("Array", of_lanes(a, b))
    return value(a, b) if b == b else b  # Python's min and max keep a if b is NaN


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """Return the smaller of a and b; NaN if either is."""
    return _extreme("min", a, b, min, np.minimum)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """Return the larger of a and b; NaN if either is."""
    return _extreme("max", a, b, max, np.maximum)


def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Scalar:
    """Return p if |a| > |b|, else q; each lane decides by its own values."""
    if _lanes(a, b, p, q):
        return cast("Array", np.where(np.abs(a) > np.abs(b), p, q))
    if _same(p, q) or (_unknown(p) and _unknown(q)) or _unknown(a) or _unknown(b):
        return q
    if not isinstance(p, Traced) and not isinstance(q, Traced) and p == q:
        return p
    tape = next((x.tape for x in (a, b) if isinstance(x, Traced)), None)
    if tape is None:
        return p if abs(a) > abs(b) else q
    larger = tape.node("larger", tape.number(a), tape.number(b))
    return tape.node("where", larger.number, tape.number(p), tape.number(q))


def before(x: Scalar, first: Scalar) -> Scalar:
    """Return x of the previous lane; in the first lane, `first`. The last axis of an array counts
    lanes.
    """
    if _lanes(x):
        return np.concatenate([np.asarray(first)[..., None], x[..., :-1]], axis=-1)
    return x.tape.node("before", x.number, first.number)


def operands(node: Node) -> tuple[int, ...]:
    """Return the node numbers an operation reads."""
    return () if node[0] in LEAVES else cast("tuple[int, ...]", node[1:])


def groups_behind(lanes: int) -> int:
    """Return the number of groups, of so many lanes each, that contain the `NODES`."""
    return -(-NODES // lanes)


def place_of(k: int, lanes: int) -> tuple[int, int]:
    """Return group (the earliest first) and lane of number k of the `NODES`."""
    return divmod(k * (groups_behind(lanes) * lanes - 1) // (NODES - 1), lanes)


Gradient: TypeAlias = dict[int, Scalar]
"""Derivatives by position of the input; zero derivatives are left out."""


def weights(smooth: bool, op: str, y: Traced, a: Scalar, b: Scalar = 0.0) -> tuple[Scalar, ...]:
    """Return the derivatives of an operation by its operands a and b; y is its value."""
    match op:
        case "+":
            return 1.0, 1.0
        case "-":
            return 1.0, -1.0
        case "*":
            return b, a
        case "/":
            return 1.0 / b, -(y / b)
        case "neg":
            return (-1.0,)
        case "sqrt":
            return (0.5 / y,)
        case "sin":
            return (cos(a),)
        case "cos":
            return (-sin(a),)
        case "atan2":  # of y = a over x = b
            square = a * a + b * b
            return b / square, -(a / square)
        case "abs" if smooth:
            return (y / a,)
        case "min" | "max" if smooth:
            sign = 1.0 if op == "max" else -1.0
            first = where_larger(a - b + 1.0, a - b - 1.0, 0.5 + 0.5 * sign, 0.5 - 0.5 * sign)
            return first, 1.0 - first
        case _:
            raise no_derivative(op)


def no_derivative(op: str) -> TypeError:
    """Return the refusal of an operation."""
    return TypeError(
        f"operation {op!r} has a kink and no derivative; leave it out of equations to be"
        " differentiated"
    )


def jacobian(
    tape: Tape, values: Sequence[Scalar], inputs: Sequence[Traced], *, smooth: bool = False
) -> list[Gradient]:
    """Return the derivatives of each value by the inputs, without zeros.

    Args:
        smooth: "abs", "min", "max" and "where" are parts of smooth functions, such as the pieces of
            a curve; at the kink itself the derivative is the one of the second operand.

    Raises:
        TypeError: a value depends on an input through an operation with a kink ("abs", "min",
            "max", "larger", "where"), and is not smooth.
    """
    return changes(tape, values, {each: {k: 1.0} for k, each in enumerate(inputs)}, smooth=smooth)


def changes(
    tape: Tape,
    values: Sequence[Scalar],
    inputs: Mapping[Traced, Gradient],
    *,
    smooth: bool = False,
) -> list[Gradient]:
    """Return the derivatives of each value by parameters, on which inputs depend with these
    derivatives; see `jacobian`.

    Args:
        inputs: operations of any kind; their operands are not looked at.
    """
    gradients = {each.number: gradient for each, gradient in inputs.items()}
    for number in live(tape, values, gradients):
        op, *_ = node = tape.nodes[number]
        read = operands(node)
        if number in gradients or not any(gradients.get(k) for k in read):
            continue
        if smooth and op == "where":
            a, b = (tape.scalars[k] for k in operands(tape.nodes[read[0]]))
            p, q = (gradients.get(k, {}) for k in read[1:])
            gradients[number] = _chosen(a, b, p, q)
        elif not (smooth and op == "larger"):  # which "where" reads itself
            found = weights(smooth, op, tape.scalars[number], *(tape.scalars[k] for k in read))
            gradients[number] = _sum(zip(found, (gradients.get(k, {}) for k in read), strict=True))
    return [
        gradients.get(value.number, {}) if isinstance(value, Traced) else {} for value in values
    ]


def live(tape: Tape, values: Sequence[Scalar], given: Collection[int] = ()) -> list[int]:
    """Return the numbers of the operations needed for values, in order; none behind given ones."""
    waiting = [each.number for each in values if isinstance(each, Traced)]
    found = set[int]()
    while waiting:
        if (number := waiting.pop()) not in found:
            found.add(number)
            waiting += () if number in given else operands(tape.nodes[number])
    return sorted(found)


def _chosen(a: Scalar, b: Scalar, first: Gradient, second: Gradient) -> Gradient:
    """Return the first gradient if |a| > |b|, else the second."""
    return {
        k: where_larger(a, b, first.get(k, 0.0), second.get(k, 0.0))
        for k in (*first, *(k for k in second if k not in first))
    }


def _sum(terms: Iterable[tuple[Scalar, Gradient]]) -> Gradient:
    """Return the weighted sum of gradients, without terms that cancel."""
    total: Gradient = {}
    for weight, gradient in terms:
        for k, value in gradient.items():
            total[k] = total.get(k, 0.0) + weight * value
    return {k: value for k, value in total.items() if isinstance(value, Traced) or value != 0.0}


def _over(a: Scalar, b: Scalar) -> Scalar:
    return a / b


OPERATIONS: Mapping[str, Any] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _over,
    "neg": operator.neg,
    "sqrt": root,
    "sin": sin,
    "cos": cos,
    "atan2": arc_tangent,
    "abs": absolute,
    "min": minimum,
    "max": maximum,
}
"""Operations on any scalars but for choices, by name."""
