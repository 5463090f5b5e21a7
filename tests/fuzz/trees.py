"""Changes of documents that keep them documents: of tables and lists, of XML elements, of lines of
cells.
"""

import copy
import json
import random
import re
import tomllib
from typing import Any
from xml.etree import ElementTree

NUMBERS = (
    0,
    1,
    -1,
    2,
    3,
    0.5,
    -0.1,
    1e-9,
    1e-100,
    1e-101,
    1e100,
    1e101,
    1e308,
    5e-324,
    10**18,
    2**64,
    -(10**400),
    float("inf"),
    float("nan"),
)
OTHERS = (
    True,
    None,
    "",
    " ",
    "a",
    "\x1b[31m",
    "\u202e",
    "=1+1",
    "<b>",
    "|",
    "../x.csv",
    "/dev/zero",
    "\ud800",
    "x" * 300,
    [],
    {},
    [[]],
)
TEXTS = (
    "",
    "0",
    "-1",
    "1e400",
    "1e-320",
    "nan",
    "inf",
    "1_0",
    "0x1",
    "1 2",
    "1 0 0",
    "0 0 0",
    "1 0 0 0",
    "true",
    "\u202e",
    "'",
    '"',
    "a" * 250,
)


def keys_and_values(value: Any, words: tuple[str, ...], rng: random.Random) -> Any:
    """A tree with one of its places changed."""
    places = [(value, key) for key in _keys(value)]
    for inside, key in places:  # grows while it is walked: all depths
        places += [(inside[key], below) for below in _keys(inside[key])]
        if len(places) > 5000:
            break
    if not places:
        return rng.choice(OTHERS)
    inside, key = rng.choice(places)
    other, source = rng.choice(places)
    match rng.randrange(7):
        case 0:
            del inside[key]
        case 1:
            inside[key] = rng.choice((*NUMBERS, *OTHERS, *words))
        case 2:
            inside[key] = json.loads(json.dumps(other[source], default=str))
        case 3 if isinstance(inside, list):
            inside.insert(rng.randrange(len(inside) + 1), inside[key])
        case 3 | 4 if isinstance(inside, dict):
            inside[rng.choice((*words, f"{key}2"))] = (
                inside[key] if rng.random() < 0.5 else inside.pop(key)
            )
        case _ if isinstance(inside[key], int | float):
            inside[key] = rng.choice(
                (-inside[key], 10 * inside[key], inside[key] + 1, rng.choice(NUMBERS))
            )
        case _ if isinstance(inside[key], str):
            inside[key] = rng.choice((*words, inside[key] + "2", inside[key][:-1]))
    return value


def _keys(value: Any) -> list[Any]:
    return (
        [*value]
        if isinstance(value, dict)
        else [*range(len(value))]
        if isinstance(value, list)
        else []
    )


def changed_json(data: bytes, rng: random.Random, words: tuple[str, ...]) -> bytes:
    """JSON with one place changed. Raises ValueError where it is none."""
    return json.dumps(keys_and_values(json.loads(data), words, rng), default=str).encode()


def changed_toml(data: bytes, rng: random.Random, words: tuple[str, ...]) -> bytes:
    """TOML with one place changed. Raises ValueError where it is none."""
    tables = keys_and_values(tomllib.loads(data.decode()), words, rng)
    if not isinstance(tables, dict):
        return data
    lines = (f"{_name(key)} = {_inline(value)}\n" for key, value in tables.items())
    return "".join(lines).encode(errors="surrogatepass")


def _name(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_name(k)} = {_inline(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if value is None or isinstance(value, bool):
        return {None: '""', True: "true", False: "false"}[value]
    return repr(value) if isinstance(value, int | float) else json.dumps(str(value))


def changed_xml(data: bytes, rng: random.Random, words: tuple[str, ...]) -> bytes:
    """XML with one element or attribute changed. Raises ValueError where it is none."""
    try:
        # names with a prefix that is not declared, as SDF files have them, are no XML
        root = ElementTree.fromstring(re.sub(rb"<(/?\w+):", rb"<\1..", data))
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError from error
    parents = [each for each in root.iter() if len(each)]
    every = [*root.iter()]
    element, other = rng.choice(every), rng.choice(every)
    texts = (*TEXTS, *words, *(text for each in every for text in each.attrib.values()))
    if parents and (k := rng.randrange(6)) < 3:
        parent = rng.choice(parents)
        child = rng.choice([*parent])
        if k:
            target = (
                other
                if k == 1 and child not in (other, *other.iter()) and other not in child.iter()
                else parent
            )
            target.insert(rng.randrange(len(target) + 1), copy.deepcopy(child))
        if k < 2:
            parent.remove(child)
    elif element.attrib and rng.random() < 0.7:
        key = rng.choice([*element.attrib])
        text = element.attrib.pop(key)
        numbers = text.split()
        match rng.randrange(4):
            case 0:
                element.set(key, rng.choice(texts))
            case 1 if numbers:
                numbers[rng.randrange(len(numbers))] = str(rng.choice(NUMBERS))
                element.set(key, " ".join(numbers))
            case 2:
                element.set(rng.choice(words), text)
    else:
        element.set(rng.choice(words), rng.choice(texts))
    text = re.sub(rb"<(/?\w+)\.\.", rb"<\1:", ElementTree.tostring(root))
    return re.sub(rb"&#\d+;", b"?", text)


def changed_lines(data: bytes, rng: random.Random, words: tuple[str, ...]) -> bytes:
    """A table with one line or cell changed."""
    lines = data.decode("latin-1").split("\n")
    k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(6):
        case 0:
            del lines[k]
        case 1:
            lines.insert(k, lines[other])
        case 2:
            lines[k], lines[other] = lines[other], lines[k]
        case _:
            cells = re.split(r"([,;\t ]+)", lines[k])
            cells[rng.randrange(len(cells))] = rng.choice((*words, *TEXTS, *map(repr, NUMBERS)))
            lines[k] = "".join(cells)
    return "\n".join(lines).encode("latin-1", errors="replace")


def changed_text(data: bytes, rng: random.Random, words: tuple[str, ...]) -> bytes:
    """A text with a word, number or sign replaced, or lines moved."""
    if rng.random() < 0.3:
        return changed_lines(data, rng, words)
    parts = re.split(rb"(\W)", data)
    parts[rng.randrange(len(parts))] = rng.choice((*words, "0", "-1", "1E-9", "1E30", "")).encode()
    return b"".join(parts)
