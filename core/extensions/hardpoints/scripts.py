"""Hardpoints in Python scripts: assignments of numbers, lists, dictionaries and arrays.

Nothing is executed: literals, their sums and products, and constants assigned once have a value
here; anything else is left out and listed. A script is refused if it changes its points after their
assignment.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, TypeAlias, cast

from ...case.io.document import fault
from ...case.io.readers import text_of
from ...case.units import LENGTHS
from ...errors import brief
from .options import WheelOptions
from .table import HardpointTable, length_name
from .tree import (
    MOST_LINES,
    Keys,
    Leaf,
    fact_leaves,
    facts_of_comments,
    leaves_of,
    read_tree,
    table_of,
    with_unit,
)

_UNIT = re.compile(r"[\[(]\s*([A-Za-z]+)\s*[\])]|\bin\s+([A-Za-z]+)\b")
# Classes and functions whose arguments are the entries of their result.
_MAKER = re.compile(
    r"(?:\w+\.)*(?:[A-Z]\w*|dict|list|tuple|float(?:32|64)?|(?:as|asany)?array|matrix|vec(?:tor)?3?|point)"
)
_CALCULATED: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
}


Targets: TypeAlias = Sequence[tuple[ast.expr, ast.expr | None]]
Statement: TypeAlias = tuple[ast.stmt, Keys, Targets]
"""A statement, the names of its classes, and its targets with their values."""


class _Array(list[Any]):
    """An array of numbers: Python calculates with each of them, other than with a list."""


def read_names(file: Path, supplied: WheelOptions) -> HardpointTable:
    """Return the points of a tree of names, or of a script of Python."""
    read = read_python if file.suffix.lower() == ".py" else read_tree
    return read(file, text_of(file), supplied)


def read_python(file: Path, text: str, supplied: WheelOptions) -> HardpointTable:
    """Return the points of the assignments of a Python script, dictionaries among them. Nothing is
    executed; other values than numbers, texts, lists and dictionaries are left out and listed.

    Raises:
        CaseError: not Python, no points, points of several suspensions, several units, or points
            changed by the script.
    """
    try:
        tree = ast.parse(text)
        script = _Script(tree)
        found = [
            (statement, [*islice(script.leaves(*statement), MOST_LINES)])
            for statement in _statements(tree.body)
        ]
        units = _units(text, found)
    except (SyntaxError, ValueError, RecursionError, MemoryError, tokenize.TokenError) as error:
        why = brief(f"{type(error).__name__}: {error}".replace("\n", " "))
        raise fault(file, "", f"is no Python script of points ({why}). Correct it") from None
    lines, others = text.split("\n"), (each.lineno for (each, _, to), _ in found if not to)
    left_out = [f"line {k} ({brief(lines[k - 1].strip())})" for k in others]
    leaves = [leaf for _, own in found for leaf in own if leaf.keys[0] not in script.named]
    if len(leaves) >= MOST_LINES:
        raise fault(file, "", f"found more than {MOST_LINES} values. Give the points only")
    _require_unchanged(file, found)
    facts = with_unit(file, facts_of_comments(file, text), units)
    return table_of(file, "Python", [*leaves, *fact_leaves(facts)], supplied, left_out)


def _units(text: str, found: Iterable[tuple[Statement, Sequence[Leaf]]]) -> dict[str, str]:
    """Return the lines of the units in comments beside points, and just above them."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = {each.start[0]: each for each in tokens if each.type == tokenize.COMMENT}
    units = dict[str, str]()
    for (each, *_), own in found:
        first = each.lineno
        while (above := comments.get(first - 1)) and above.line.lstrip().startswith("#"):
            first -= 1
        if any(leaf.triple or leaf.coordinate for leaf in own):
            for line in range(first, (each.end_lineno or first) + 1):
                for stated in _UNIT.finditer(comments[line].string if line in comments else ""):
                    if (unit := length_name(stated[1] or stated[2])) in LENGTHS:
                        units.setdefault(unit, f"line {line}")
    return units


def _statements(body: Iterable[ast.stmt], above: Keys = ()) -> Iterator[Statement]:
    """Yield the statements of a script, and those of its classes below their names, each with its
    targets and their values.
    """
    for each in body:
        match each:
            case ast.ClassDef():
                yield from _statements(each.body, (*above, each.name))
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)) if len(
                names
            ) == len(values):
                yield each, above, [*zip(names, values, strict=True)]
            case ast.Assign(targets=targets, value=value):
                yield each, above, [(target, value) for target in targets]
            case ast.AnnAssign(target=target, value=value):
                yield each, above, [(target, value)]
            case _:
                yield each, above, []


def _path(target: ast.expr) -> Keys:
    """Return the keys in an expression: HP.front["lca"] is HP, front and lca."""
    match target:
        case ast.Name(id=name):
            return (name,)
        case ast.Attribute(value=value, attr=name) if inside := _path(value):
            return (*inside, name)
        case ast.Subscript(value=value, slice=ast.Constant(value=key)) if inside := _path(value):
            return (*inside, str(key))
        case ast.Subscript(value=value) | ast.Starred(value=value):
            return _path(value)
        case _:
            return ()


class _Script:
    """Values of the expressions of a script.

    Attributes:
        constants: values of names assigned once.
        named: names of constants in a dictionary or a list; they are no points.
    """

    def __init__(self, tree: ast.Module) -> None:
        stores = [
            node.id
            for node in ast.walk(tree)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        ]
        self._once = {name for name in stores if stores.count(name) == 1}
        self.constants = dict[str, Any]()
        self.named = set[str]()

    def leaves(self, each: ast.stmt, above: Keys, targets: Targets) -> Iterator[Leaf]:
        """Yield the values assigned by a statement."""
        for target, source in targets:
            value = self.value(source) if source else ""
            keys = _path(target) or (ast.unparse(target),)
            if keys[0] in self._once and isinstance(target, ast.Name):
                self.constants[keys[0]] = value
            where = f"line {each.lineno} "
            for leaf in leaves_of(value, (*above, *keys), ".".join((*above, *keys))):
                yield replace(leaf, where=where + leaf.where)

    def value(self, node: ast.expr) -> Any:
        """Return the value of an expression, or the text of one without a value here. A call with
        one list, or with three numbers, is a point: `np.array([1, 2, 3])`, `Vector(1, 2, 3)`.
        """
        match node:
            case ast.Constant(value=bool()):
                return ast.unparse(node)
            case ast.Constant(value=int() | float() | str() as value):
                return value
            case ast.Name(id=name) if name in self.constants:
                return self.constants[name]
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
                factor = ast.Constant(-1 if isinstance(sign, ast.USub) else 1)
                return self._calculated(ast.BinOp(factor, ast.Mult(), operand), node)
            case ast.BinOp():
                return self._calculated(node, node)
            case (
                ast.List(elts=[ast.Constant(value=str() as name), place])
                | ast.Tuple(elts=[ast.Constant(value=str() as name), place])
            ):
                return [name, self._entry(place)]
            case ast.List(elts=items) | ast.Tuple(elts=items):
                return [self._item(item) for item in items]
            case ast.Dict():
                keys = ["**" if key is None else str(self.value(key)) for key in node.keys]
                values = [self._entry(each) for each in node.values]
                return _named_values(zip(keys, values, strict=True))
            case ast.Call(func=function) if not _MAKER.fullmatch(ast.unparse(function)):
                return ast.unparse(node)
            case ast.Call(args=[], keywords=[_, *_] as words):
                return _named_values((str(each.arg), self._entry(each.value)) for each in words)
            case ast.Call(args=[only], keywords=[] | [ast.keyword(arg="dtype")]):
                value = self.value(only)
                return _Array(cast("list[Any]", value)) if isinstance(value, list) else value
            case ast.Call(args=[_, _, *_] as items, keywords=[]) if len(items) <= 4:
                return _Array(map(self._item, items))
            case _:
                return ast.unparse(node)

    def _item(self, node: ast.expr) -> Any:
        """Return the value of an item of a list; points have no name there."""
        value = self.value(node)
        named = isinstance(node, ast.Name) and isinstance(value, list | dict)
        return cast("Any", ast.unparse(node) if named else value)

    def _entry(self, node: ast.expr) -> Any:
        """Return the value of an entry with a name."""
        value = self.value(node)
        if isinstance(node, ast.Name) and isinstance(value, list | dict):
            self.named.add(node.id)
        return cast("Any", value)

    def _calculated(self, sum_: ast.BinOp, whole: ast.expr) -> Any:
        """Return a sum or product of numbers and arrays, or the text of another expression."""
        sides = [self.value(sum_.left), self.value(sum_.right)]
        calculate = _CALCULATED.get(type(sum_.op))
        size = next((len(each) for each in sides if isinstance(each, _Array)), 0)
        rows = [[*each] if isinstance(each, _Array) else [each] * max(size, 1) for each in sides]
        numbers = all(type(each) in (int, float) for row in rows for each in row)
        if calculate is None or not numbers or len(rows[0]) != len(rows[1]):
            return ast.unparse(whole)
        try:
            found = [calculate(float(a), float(b)) for a, b in zip(*rows, strict=True)]
        except (ZeroDivisionError, OverflowError):
            return ast.unparse(whole)
        return _Array(found) if size else found[0]


def _named_values(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found = dict[str, Any]()
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key!r} stands twice")
        found[key] = value
    return found


def _require_unchanged(file: Path, found: Iterable[tuple[Statement, Sequence[Leaf]]]) -> None:
    """Refuse a change of points after their assignment."""
    before = set[Keys]()
    for (each, above, targets), own in found:
        paths = [(*above, *_path(target)) for target, _ in targets]
        match each:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                continue
            case ast.Expr(value=ast.Call(func=ast.Attribute() as method)):
                paths = [_path(method)[:1]]
            case _ if not targets:
                stored = (ast.Store, ast.Del)
                nodes = (x for x in ast.walk(each) if isinstance(getattr(x, "ctx", None), stored))
                paths = [_path(node)[:1] for node in nodes if isinstance(node, ast.expr)]
            case _:
                pass
        for path in filter(None, paths):
            if any(keys[: len(path)] == path[: len(keys)] for keys in before):
                raise fault(
                    file,
                    f"line {each.lineno}",
                    f"changes {'.'.join(path)}, expected points that are assigned once, since"
                    " nothing is executed. Write the changed numbers, or a table of them",
                )
        before |= {leaf.keys for leaf in own if leaf.triple or leaf.coordinate}
