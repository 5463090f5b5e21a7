"""Places in texts of TOML and JSON: the path of a key, and the line it stands in."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

from ...doors import offers

# Bytes: no line is sought in a longer file, so that a message takes a second at most.
LONGEST = 4_000_000
# Tables of a case are three levels deep, rows of numbers two more. Deeper nesting only obscures a
# message.
DEEPEST = 16
# Texts, and comments, of JSON and TOML.
TEXT = (
    r'"""(?:[^"\\]|\\.|"(?!""))*+"*+|\'\'\'(?:[^\']|\'(?!\'\'))*+\'*+'
    r'|"(?:[^"\\\n]|\\.)*+"?|\'[^\'\n]*+\'?|#[^\n]*+'
)
_TOKEN = re.compile(rf"{TEXT}|[\[\]{{}}=:,.\n]|[^\s\[\]{{}}=:,.\"'#]++", re.DOTALL)


def join(key: str, name: str) -> str:
    """Return the path of a key inside a table."""
    name = name if name.isprintable() and name else repr(name)
    return f"{key}.{name}" if key else name


def place(file: Path, key: str) -> str:
    """Return 'line N: KEY' for a key in a file of TOML, JSON or YAML, else the key.

    The line is that of the closest table around it, if the file has no such key.
    """
    kinds = {".toml": keys_of, ".json": partial(keys_of, value="")}
    kinds |= {suffix: each.load() for suffix, each in offers("lines").items()}
    read, line = kinds.get(file.suffix.lower()), 0
    if read and key:
        with suppress(OSError, ValueError):
            if file.stat().st_size <= LONGEST:
                line = line_of(key, read(file.read_text("utf-8-sig")))
    return f"line {line}: {key}" if line else key


def line_of(key: str, keys: Iterable[tuple[str, int]]) -> int:
    """Return the first line of a key, or else of what is in it, or else of the closest table around
    it; 0 if there is none.
    """
    inside, closest, around = 0, "", 0
    for path, line in keys:
        if path == key:
            return line
        if not inside and _within(path, key):
            inside = line
        elif len(path) > len(closest) and _within(key, path):
            closest, around = path, line
    return inside or around


def _within(path: str, key: str) -> bool:
    return path.startswith(key) and path[len(key) : len(key) + 1] in (".", "[", ":", " ")


def keys_of(text: str, value: str | None = None) -> Iterator[tuple[str, int]]:
    """Yield the path of each key and item of a text of TOML, with its line; of JSON, if the text
    is a value.

    Args:
        value: path of the value that stands here.
    """
    heading, counts = "", Counter[str]()
    # the path of each open bracket, and the number of its item; None for a table
    above: list[tuple[str, int | None]] = []
    names: list[str] = []
    line, opened = 1, 0  # brackets of the heading that stands here
    for token in _TOKEN.findall(text):
        here, line = line, line + token.count("\n")
        path, item = above[-1] if above else (heading, None)
        if item is not None:
            value = f"{path}[{item}]"
            if token not in {"\n", ",", "]"} and token[0] != "#":
                yield value, here
        if value is not None and token in {"{", "["}:
            above.append((value, None if token == "{" else 0))
            value = None
        elif token in {"}", "]"} and above:
            above.pop()
            value = None
        elif token == "," and item is not None:
            above[-1] = path, item + 1
        elif token == "," or (token == "\n" and not above and value != ""):
            value, names, opened = None, [], 0
        elif value is not None or token in {"\n", "."} or token[0] == "#":
            continue
        elif token == "[":
            opened += 1
        elif token == "]" and names:
            heading = ""
            for k, name in enumerate(names[:DEEPEST], 1):
                heading = join(heading, name)
                counts[heading] += opened == 2 and k == len(names)
                heading += f"[{counts[heading] - 1}]" if counts[heading] else ""
            yield heading, here
            names = []
        elif token in {"=", ":"}:
            for name in names[:DEEPEST]:
                path = join(path, name)
            value, names = path, []
            yield value, here
        else:
            names.append(_name(token))


def _name(token: str) -> str:
    """Return the name that a key of TOML or JSON writes."""
    with suppress(ValueError):
        return json.loads(token) if token[0] == '"' else token.strip("'")
    return token


def key_again(text: str) -> str:
    """Return the first key of JSON that stands again, with its line."""
    seen = set[str]()
    for path, line in keys_of(text[:LONGEST], ""):
        if path in seen and not re.search(r"\[\d+\]$", path):
            return f"line {line}: the key {path!r}"
        seen.add(path)
    return "a key"
