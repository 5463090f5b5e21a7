"""Assignments of MATLAB scripts in one line each: structs, cells and matrices over lines, as
`hp = struct('lca_front', [1 2 3], ...)` or `hp = {'lca_front', 1, 2, 3; ...}`. Nothing is
evaluated; what is no literal keeps its text, and the reader of assignments leaves it out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any, cast

_TOKEN = re.compile(
    r"(?P<remark>^[ \t]*%\{[ \t]*$.*?(?:^[ \t]*%\}[ \t]*$|\Z)|\.\.\.[^\n]*(?:\n|\Z))"
    r"|(?P<comment>[%#][^\n]*)"
    r"|(?P<text>(?<![\w\])}.'])'(?:[^'\n]|'')*'|\"[^\"\n]*\")"
    r"|(?P<number>(?<![\w)\]])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\w))"
    r"|(?P<word>[A-Za-z]\w*(?:\.\w+)*)|(?P<sign>[\[\](){};,=\n]|\.?')|(?P<other>\S)",
    re.MULTILINE | re.DOTALL,
)
_OPENING, _CLOSING = "[({", "])}"
Lines = list[tuple[str, str]]


def plain_lines(text: str) -> Lines:
    """Return places and texts of the assignments of a script, one for each point or number."""
    found: Lines = []
    names: list[list[str]] = []
    matrices: list[list[list[str]]] = []
    for where, statement, tokens in _statements(text):
        head = statement.partition("=")[0]
        start = next((k for k, each in enumerate(tokens) if each[0] == "="), 0) + 1
        try:
            value, end = _value(tokens, start)
            lines = [*_assigned(head.strip(), value)]
        except (ValueError, IndexError):
            lines, end, value = [statement], len(tokens), None
        rows = cast("list[list[Any]]", value) if isinstance(value, list) else []
        flat = [each for row in rows for each in row]
        if len(flat) > 1 and all(map(_is_text, flat)):
            names.append([_bare(each) for each in flat])
        elif len(rows) > 1 and all(len(row) == 3 for row in rows):
            matrices.append(rows)
        comment = " ".join(each for kind, each in tokens[end:] if kind == "comment")
        found += [(where, f"{line} {comment}".strip()) for line in lines]
    pairs = [(each, rows) for each in names for rows in matrices if len(each) == len(rows)]
    if len(pairs) == 1:
        rows = zip(*pairs[0], strict=True)
        found += [("its row", f"{name} = [{' '.join(row)}]") for name, row in rows]
    return found


def _statements(text: str) -> Iterator[tuple[str, str, list[tuple[str, str]]]]:
    """Yield place, text and tokens of each statement; a sign is its own kind."""
    tokens: list[tuple[str, str]] = []
    depth, start, line = 0, 0, 1
    for each in [*_TOKEN.finditer(text + "\n")]:
        kind, token = str(each.lastgroup), each[0]
        kind = token if kind == "sign" else kind
        if not tokens:
            start, line = each.start(), text.count("\n", 0, each.start()) + 1
        depth += (token in _OPENING) - (token in _CLOSING) if kind == token else 0
        if depth <= 0 and kind == "\n":
            if tokens:
                yield f"line {line}", text[start : each.start()].strip(), tokens
            tokens, depth = [], 0
        elif depth <= 0 and kind == ";" and tokens:
            rest = text[each.end() :].split("\n", 1)[0].lstrip()
            if rest and not rest.startswith(("%", "#")):  # another statement in the line
                yield f"line {line}", text[start : each.start()].strip(), tokens
                tokens = []
        elif kind != "remark":
            tokens.append((kind, token))


def _value(tokens: Sequence[tuple[str, str]], k: int) -> tuple[Any, int]:
    """Return a literal and the place after it: a text, a number, rows of them, or a struct.

    Raises:
        ValueError, IndexError: something else.
    """
    kind, token = tokens[k]
    if kind in ("text", "number"):
        return token, k + 1
    if token == "struct" and tokens[k + 1][0] == "(":
        items, k = _rows(tokens, k + 2)
        flat = [each for row in items for each in row]
        return dict(zip(map(_bare, flat[::2]), flat[1::2], strict=True)), k
    if kind in ("[", "{"):
        return _rows(tokens, k + 1)
    raise ValueError(token)


def _rows(tokens: Sequence[tuple[str, str]], k: int) -> tuple[list[list[Any]], int]:
    """Return the rows of a bracket and the place after it. A row of three numbers with a comment
    that is a name begins with the name.
    """
    rows: list[list[Any]] = [[]]
    while tokens[k][0] not in _CLOSING:
        kind, token = tokens[k]
        if kind in (";", "\n"):
            rows.append([])
            k += 1
        elif kind == "comment":
            filled = [row for row in rows if row]
            last = filled[-1] if filled else []
            if name := re.fullmatch(r"[%#]+\s*(\w+)\s*", token):
                last[:] = [f"'{name[1]}'", *last] if len(last) == 3 else last
            k += 1
        elif kind == ",":
            k += 1
        else:
            value, k = _value(tokens, k)
            rows[-1].append(value)
    k += 1
    while k < len(tokens) and tokens[k][0] in ("'", ".'"):
        k += 1
    return [row for row in rows if row], k


def _assigned(name: str, value: Any) -> Iterator[str]:
    """Yield the assignments of a literal."""
    if isinstance(value, dict):
        for key, each in cast("dict[str, Any]", value).items():
            yield from _assigned(f"{name}.{key}", each)
        return
    rows = cast("list[list[Any]]", value) if isinstance(value, list) else []
    flat = [each for row in rows for each in row]
    if rows and all(len(row) in (2, 4) and _is_text(row[0]) for row in rows):
        for first, *rest in rows:
            yield from _assigned(f"{name}.{_bare(first)}", rest[0] if len(rest) == 1 else [rest])
    elif len(flat) == 1 and isinstance(flat[0], list | dict):  # a cell around a value
        yield from _assigned(name, flat[0])
    elif rows:
        yield f"{name} = [{' '.join(map(str, flat))}]"
    else:
        yield f"{name} = {value}"


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value[0] in "'\""


def _bare(value: Any) -> str:
    if not _is_text(value):
        raise ValueError(value)
    return str(value)[1:-1]
