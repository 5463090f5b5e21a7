"""Tokens, files and functions of each room, against the budgets of house.toml: make house

A room is a folder with a row in the table; files of a folder without a row belong to the nearest
row above.
"""

import ast
import io
import tokenize
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from .support.sources import ROOT, files, tree

TABLE = Path(__file__).with_suffix(".toml")
COUNTED = {tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING}
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Size:
    tokens: int = 0
    files: int = 0
    functions: int = 0

    def __add__(self, other: "Size") -> "Size":
        return Size(
            self.tokens + other.tokens, self.files + other.files, self.functions + other.functions
        )


def budgets() -> dict[str, int]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))["tokens"]


def room_of(path: Path, rooms: Iterable[str]) -> str:
    """Return the room of a file: the nearest folder that is one."""
    return next(str(folder) for folder in path.parents if str(folder) in rooms)


def size_of(text: str, syntax: ast.AST) -> Size:
    """Count the tokens of a source text without comments, docstrings and layout."""
    documented = set()
    functions = 0
    for node in ast.walk(syntax):
        functions += isinstance(node, FUNCTIONS)
        if isinstance(node, ast.Module | ast.ClassDef | FUNCTIONS) and ast.get_docstring(node):
            documented.update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    tokens = sum(
        token.type in COUNTED and token.start[0] not in documented
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
    )
    return Size(tokens, 1, functions)


def sizes(rooms: Iterable[str]) -> dict[str, Size]:
    """Return the size of every room."""
    found = dict.fromkeys(rooms, Size())
    for path in files("core", "adapters", "tests"):
        found[room_of(path, found)] += size_of((ROOT / path).read_text("utf-8"), tree(path))
    return found


def beyond(found: Mapping[str, Size], allowed: Mapping[str, int]) -> Iterator[str]:
    """Yield a message for each room that is larger than its budget or has no file."""
    for room, size in found.items():
        if size.tokens > allowed[room]:
            yield (
                f"{room} has {size.tokens:,} tokens, {size.tokens - allowed[room]:,} more than its "
                f"budget. Simplify what the change makes superfluous, or raise the budget in "
                f"{TABLE.relative_to(ROOT)} and give the reason in the commit."
            )
        if not size.files:
            yield f"{room} has no file: remove its row from {TABLE.relative_to(ROOT)}."


def main() -> int:
    """Print the table; return 1 if a room is larger than its budget."""
    allowed = budgets()
    found = sizes(allowed)
    print(f"{'room':32} {'tokens':>8} {'budget':>8} {'files':>6} {'functions':>10}")
    for room, size in found.items():
        print(f"{room:32} {size.tokens:8,} {allowed[room]:8,} {size.files:6} {size.functions:10}")
    for name, chosen in (
        ("core and adapters", [room for room in found if not room.startswith("tests")]),
        ("tests", [room for room in found if room.startswith("tests")]),
    ):
        whole = sum((found[room] for room in chosen), Size())
        budget = sum(allowed[room] for room in chosen)
        print(f"{name:32} {whole.tokens:8,} {budget:8,} {whole.files:6} {whole.functions:10}")
    faults = [*beyond(found, allowed)]
    print(*faults, sep="\n", end="\n" if faults else "")
    return bool(faults)


if __name__ == "__main__":
    raise SystemExit(main())
