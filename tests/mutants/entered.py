"""Outcomes of tests, and the blocks that each test enters: `sitecustomize` of the interpreter that
runs mutants, and a plugin of pytest there.

A block is statements of a function that run one after another: its body, a branch, a loop. Each
sets a byte of a file when it begins. The file is mapped into the memory of all processes that a
test starts, however they end.
PYTEST_DONT_REWRITE: the interpreter loads this before pytest.
"""

import ast
import builtins
import hashlib
import json
import mmap
import os
from importlib.machinery import SourceFileLoader
from pathlib import Path

FOLDER = Path(os.environ.get("KINCHECK_TESTS_ENTER", ""))
"""Of the files that are written."""
FUNCTIONS = os.environ.get("KINCHECK_FUNCTIONS", "")
"""File that numbers the blocks by their names; without it none is marked."""
PACKAGE = f"{os.sep}site{os.sep}kincheck{os.sep}"
MARK = "__entered__"


def outermost(syntax):
    """Yield each function that is in no other, with its qualified name."""
    waiting = [(syntax, "")]
    while waiting:
        node, scope = waiting.pop()
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{scope}{child.name}", child
            elif isinstance(child, ast.ClassDef):
                waiting.append((child, f"{scope}{child.name}."))
            elif isinstance(child, ast.stmt):
                waiting.append((child, scope))


def blocks(function):
    """Return the blocks of a function, its own first."""
    fields = (
        (node, name) for node in ast.walk(function) for name in ("body", "orelse", "finalbody")
    )
    found = (getattr(node, name, None) for node, name in fields)
    return [each for each in found if isinstance(each, list) and each]


def names(path, name, function):
    """Return the names of the blocks of a function; other text has others."""
    text = hashlib.sha256(ast.dump(function).encode()).hexdigest()[:8]
    return [f"{path} {name} {text}#{k}" for k in range(len(blocks(function)))]


def _mark(path, name, function):
    for block, each in zip(blocks(function), names(path, name, function), strict=True):
        (mark,) = ast.parse(f"{MARK}[{numbers[each]}] = 1").body
        for part in ast.walk(mark):
            ast.copy_location(part, block[0])
        said = isinstance(block[0], ast.Expr) and isinstance(block[0].value, ast.Constant)
        block.insert(said, mark)  # behind a docstring


class _Marking(SourceFileLoader):
    def source_to_code(self, data, path, **options):
        _, found, inside = os.fspath(path).partition(PACKAGE)
        if found:
            data = ast.parse(data, path)
            for name, function in [*outermost(data)]:
                if names(inside, name, function)[0] in numbers:
                    _mark(inside, name, function)
        return _compile(self, data, path, **options)


def pytest_runtest_logstart(nodeid):
    if FUNCTIONS:
        entered[:] = bytes(len(entered))


def pytest_runtest_logfinish(nodeid):
    if FUNCTIONS:
        numbers = [k for k, mark in enumerate(entered[:]) if mark]
        _write("entered", [nodeid, numbers])


def pytest_runtest_logreport(report):
    _write("reports", [report.nodeid, report.duration, report.outcome])


def _write(kind, entry):
    with open(FOLDER / kind, "a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")


if FUNCTIONS:
    numbers = json.loads(Path(FUNCTIONS).read_text(encoding="utf-8"))
    with open(FOLDER / "marks", "r+b") as marks:
        entered = mmap.mmap(marks.fileno(), 0)
    setattr(builtins, MARK, entered)
    _compile = SourceFileLoader.source_to_code
    SourceFileLoader.source_to_code = _Marking.source_to_code
