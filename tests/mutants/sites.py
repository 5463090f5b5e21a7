"""One-token changes of a source text."""

import ast
import hashlib
import io
import tokenize
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

OPERATORS = """
Add, +, -
Sub, -, +
Mult, *, /
Div, /, *
FloorDiv, //, %
Mod, %, //
Pow, **, *
MatMult, @, -
BitAnd, &, |
BitOr, |, &
BitXor, ^, |
LShift, <<, >>
RShift, >>, <<
And, and, or
Or, or, and
Lt, <, <=, >=
LtE, <=, <, >
Gt, >, >=, <=
GtE, >=, >, <
Eq, ==, !=
NotEq, !=, ==
Is, is, is not
IsNot, is not, is
In, in, not in
NotIn, not in, in
"""
"""Name of an operator's node, its text, and what stands there instead."""
CHANGED = {
    getattr(ast, name): (old, *new)
    for name, old, *new in (line.split(", ") for line in OPERATORS.split("\n") if line)
}
UNARY = {ast.Not: "not ", ast.USub: "-", ast.UAdd: "+", ast.Invert: "~"}
CALLED = dict(
    pair
    for one, other in (
        ("min", "max"),
        ("any", "all"),
        ("minimum", "maximum"),
        ("argmin", "argmax"),
        ("nanmin", "nanmax"),
        ("floor", "ceil"),
        ("sin", "cos"),
        ("sum", "max"),
    )
    for pair in ((one, other), (other, one))
) | {"max": "min", "abs": "", "sorted": "list", "reversed": "list"}
"""Name of a function that is called -> what is called instead; "" leaves the argument."""

Place = tuple[int, int]
"""Line from one, column in characters from zero."""


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Attributes:
        path: of the file, from the top of the repository.
        function: qualified name of the function, or "" at the level of the module and its classes.
        start, end: of the text that is replaced.
        line: the first line of the change as it is, and `mutant` as it becomes, without indent.
        nth: of the same changes of the same line in a function, from zero.
    """

    path: str
    function: str
    start: Place
    end: Place
    new: str
    line: str
    mutant: str
    nth: int

    @property
    def id(self) -> str:
        """Eight letters that stay when lines before it come or go."""
        parts = (self.path, self.function, self.line, self.mutant, str(self.nth))
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:8]

    def applied(self, text: str) -> str:
        """Return the text of the file with the change."""
        lines = text.splitlines(keepends=True)
        (row, column), (last, until) = self.start, self.end
        changed = lines[row - 1][:column] + self.new + lines[last - 1][until:]
        return "".join([*lines[: row - 1], changed, *lines[last:]])


def mutants(path: Path | str, text: str) -> list[list[Mutant]]:
    """Return the possible changes of each place of a file, in the order of the text."""
    finder = _Finder(str(path), text)
    finder.visit(ast.parse(text))
    return [finder.found[start] for start in sorted(finder.found)]


class _Finder(ast.NodeVisitor):
    """Changes are made of what is run and judged: annotations, decorators, formatted strings and
    code for type checkers are left alone.
    """

    def __init__(self, path: str, text: str) -> None:
        self.path, self.lines = path, text.splitlines()
        self.tokens = [
            token
            for token in tokenize.generate_tokens(io.StringIO(text).readline)
            if token.type in (tokenize.OP, tokenize.NAME, tokenize.NUMBER)
        ]
        self.scope: list[str] = []
        self.inside = False
        self.seen: Counter[tuple[str, str, str]] = Counter()
        self.found: dict[Place, list[Mutant]] = {}

    def _place(self, line: int, column: int) -> Place:
        """Return a place in characters; syntax trees count bytes."""
        return line, len(self.lines[line - 1].encode()[:column].decode())

    def _start(self, node: ast.expr | ast.stmt) -> Place:
        return self._place(node.lineno, node.col_offset)

    def _end(self, node: ast.expr | ast.stmt) -> Place:
        return self._place(node.end_lineno or 0, node.end_col_offset or 0)

    def _add(self, start: Place, end: Place, *replacements: str) -> None:
        function = ".".join(self.scope) if self.inside else ""
        for new in replacements:
            (row, column), (last, until) = start, end
            line = self.lines[row - 1]
            changed = (line[:column] + new + self.lines[last - 1][until:]).strip()
            place = function, line.strip(), changed
            self.found.setdefault(start, []).append(
                Mutant(self.path, function, start, end, new, *place[1:], self.seen[place])
            )
            self.seen[place] += 1

    def _add_token(self, after: Place, until: Place, old: str, *new: str) -> None:
        """Replace the token, or the two tokens, between two places."""
        first, *second = old.split()
        for k, token in enumerate(self.tokens):
            found = [each.string for each in self.tokens[k : k + 1 + len(second)]]
            if after <= token.start < until and found == [first, *second]:
                self._add(token.start, self.tokens[k + len(second)].end, *new)
                return

    def _visit_function(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        inside, self.inside = self.inside, True
        outermost = not inside
        if outermost:
            self.scope.append(node.name)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        for statement in node.body:
            self.visit(statement)
        if outermost:
            self.scope.pop()
        self.inside = inside

    visit_FunctionDef = _visit_function
    visit_AsyncFunctionDef = _visit_function

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        if not self.inside:
            self.scope.append(node.name)
        for statement in node.body:
            self.visit(statement)
        if not self.inside:
            self.scope.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Before Python 3.12 the places of its parts are wrong."""

    def visit(self, node: ast.AST) -> None:
        """Negate conditions that have no operator to change."""
        tests: list[ast.expr] = []
        if isinstance(node, ast.comprehension):
            tests = node.ifs
        elif isinstance(node, ast.If | ast.While | ast.IfExp):
            if "TYPE_CHECKING" in ast.unparse(node.test):
                return
            tests = [node.test]
        for test in tests:
            if isinstance(test, ast.Name | ast.Attribute | ast.Call | ast.Subscript):
                start = self._start(test)
                self._add(start, start, "not ")
        super().visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        old, new = CHANGED[type(node.op)]
        of_types = not self.inside and old == "|"
        if not of_types:
            self._add_token(self._end(node.left), self._start(node.right), old, new)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        old, new = CHANGED[type(node.op)]
        self._add_token(self._end(node.target), self._start(node.value), f"{old}=", f"{new}=", "=")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        sides = [node.left, *node.comparators]
        for operator, (left, right) in zip(node.ops, pairwise(sides), strict=True):
            self._add_token(self._end(left), self._start(right), *CHANGED[type(operator)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        for left, right in pairwise(node.values):
            self._add_token(self._end(left), self._start(right), *CHANGED[type(node.op)])
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        row, column = self._start(node)
        self._add((row, column), (row, column + len(UNARY[type(node.op)])), "")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = ast.unparse(node.func).rpartition(".")[2]
        if name in CALLED and (CALLED[name] or isinstance(node.func, ast.Name)):
            row, column = self._end(node.func)
            self._add((row, column - len(name)), (row, column), CALLED[name])
        if name in ("isinstance", "issubclass", "cast"):
            self.visit(node.args[0])
        else:
            self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self._add(self._start(node), self._end(node), str(not node.value))
        elif isinstance(node.value, int):
            others = {0: ("1",), 1: ("0", "2")}.get(node.value, (str(node.value + 1),))
            self._add(self._start(node), self._end(node), *others)
        elif isinstance(node.value, float):
            new = repr(node.value * 2 if node.value else 1.0)
            self._add(self._start(node), self._end(node), new)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not isinstance(node.value, ast.Constant):
            self._add(self._start(node.value), self._end(node.value), "None")
        if node.value is not None:
            self.visit(node.value)

    def visit_Break(self, node: ast.Break) -> None:
        self._add(self._start(node), self._end(node), "continue")

    def visit_Continue(self, node: ast.Continue) -> None:
        self._add(self._start(node), self._end(node), "break")
