"""Tokens, files and functions of each room, against the budgets of house.toml: make house

A room of the kernel is a folder with a row in the table; files of a folder without a row belong to
the nearest row above. Each extension is a room; all of them have one budget, so that a folder that
goes leaves no row behind. A string counts a token for each of its lines.
"""

import ast
import io
import tokenize
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from .support.sources import ROOT, extension_of, files, tree

TABLE = Path(__file__).with_suffix(".toml")
EXTENSIONS = "extensions"
WHOLES: Mapping[str, Callable[[str], bool]] = {
    "kernel": lambda room: room.startswith(("core", "adapters")),
    EXTENSIONS: lambda room: room.startswith(f"{EXTENSIONS}/"),
}
"""Sums of rooms with budgets of their own."""
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
    """Return the room of a file: its extension, or the nearest folder that is one."""
    if extension := extension_of(path):
        return f"{EXTENSIONS}/{extension}"
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
        1 + token.end[0] - token.start[0] if token.type == tokenize.STRING else 1
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type in COUNTED and token.start[0] not in documented
    )
    return Size(tokens, 1, functions)


def sizes(rooms: Iterable[str]) -> dict[str, Size]:
    """Return the size of every room."""
    found = dict.fromkeys(rooms, Size())
    for path in files("core", "adapters", "tests"):
        room = room_of(path, rooms)
        size = size_of((ROOT / path).read_text("utf-8"), tree(path))
        found[room] = found.get(room, Size()) + size
    for whole, part in WHOLES.items():
        found[whole] = sum((size for room, size in found.items() if part(room)), Size())
    return found


def beyond(found: Mapping[str, Size], allowed: Mapping[str, int]) -> Iterator[str]:
    """Yield a message for each room that is larger than its budget or has no file."""
    for room, size in found.items():
        if size.tokens > allowed.get(room, size.tokens):
            yield (
                f"{room} has {size.tokens:,} tokens, {size.tokens - allowed[room]:,} more than its "
                f"budget. Simplify what the change makes superfluous, or raise the budget in "
                f"{TABLE.relative_to(ROOT)} and give the reason in the commit."
            )
        if not size.files and room not in WHOLES:
            yield f"{room} has no file: remove its row from {TABLE.relative_to(ROOT)}."


def main() -> int:
    """Print the table; return 1 if a room is larger than its budget."""
    allowed = budgets()
    found = sizes(allowed)
    print(f"{'room':32} {'tokens':>8} {'budget':>8} {'files':>6} {'functions':>10}")
    for room, size in found.items():
        budget = f"{allowed[room]:,}" if room in allowed else ""
        print(f"{room:32} {size.tokens:8,} {budget:>8} {size.files:6} {size.functions:10}")
    whole = found["kernel"] + found[EXTENSIONS]
    print(f"{'product':32} {whole.tokens:8,} {'':8} {whole.files:6} {whole.functions:10}")
    faults = [*beyond(found, allowed)]
    print(*faults, sep="\n", end="\n" if faults else "")
    return bool(faults)


if __name__ == "__main__":
    raise SystemExit(main())
