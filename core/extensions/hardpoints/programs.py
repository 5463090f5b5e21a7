"""Hardpoints in files of other programs: Adams/Car, Project Chrono and Assetto Corsa, and MATLAB
scripts as assignments in one line each.

Scripts have structs, cells and matrices over lines, as `hp = struct('lca_front', [1 2 3], ...)` or
`hp = {'lca_front', 1, 2, 3; ...}`. Nothing is evaluated; what is no literal keeps its text, and the
reader of assignments leaves it out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from ...case.io.document import Section, fault, parse, shown
from ...case.io.readers import text_of
from ...errors import MOST_NAMED, brief, remedy, sentence, shortened
from .options import HardpointOptions, WheelOptions
from .table import Hardpoint, HardpointTable, number, require_name, twice, wanted_corner

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
    names = list[list[str]]()
    matrices = list[list[list[str]]]()
    for where, statement, tokens in _statements(text):
        head = statement.partition("=")[0]
        start = next((k for k, each in enumerate(tokens) if each[0] == "="), 0) + 1
        try:
            value, end = _value(tokens, start)
            lines = [*_assignments(head.strip(), value)]
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
    tokens = list[tuple[str, str]]()
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


def _assignments(name: str, value: Any) -> Iterator[str]:
    """Yield the assignments of a literal."""
    if isinstance(value, dict):
        for key, each in cast("dict[str, Any]", value).items():
            yield from _assignments(f"{name}.{key}", each)
        return
    rows = cast("list[list[Any]]", value) if isinstance(value, list) else []
    flat = [each for row in rows for each in row]
    if rows and all(len(row) in (2, 4) and _is_text(row[0]) for row in rows):
        for first, *rest in rows:
            yield from _assignments(f"{name}.{_bare(first)}", rest[0] if len(rest) == 1 else [rest])
    elif len(flat) == 1 and isinstance(flat[0], list | dict):  # a cell around a value
        yield from _assignments(name, flat[0])
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


BLOCK = "[HARDPOINT]"
COLUMNS = ("hardpoint_name", "symmetry", "x_value", "y_value", "z_value")
LEFT, RIGHT = ("left/right", "left", "single"), "right"

_SECTION = re.compile(r"\[\s*([A-Za-z_]+)\s*\]")
_SUBSECTION = re.compile(r"\(\s*([A-Za-z_]+)\s*\)")
_FIELD = re.compile(r"'([^']*)'|(\S+)")


def read_adams(file: Path, supplied: HardpointOptions) -> HardpointTable:
    """Return the points of the left side and of the middle, by name.

    Raises:
        CaseError: there is no such block, or one of its rows is incomplete.
    """
    points = dict[str, Hardpoint]()
    unit: str | None = None
    section, sections, right = "", dict[str, int](), 0
    inner, variants = "", dict[str, list[str]]()
    columns = COLUMNS
    text = text_of(file, of_spreadsheet=True)
    for k, line in enumerate(text.splitlines(), 1):
        row, where = line.strip(), f"line {k}"
        if not row or row.startswith(("$", "!")):
            continue
        if head := _SECTION.fullmatch(row):
            section, inner = head.group(1).upper(), ""
            sections.setdefault(section, 0)
            columns = COLUMNS
            continue
        if section == "HARDPOINT" and (found := _SUBSECTION.fullmatch(row)):
            inner = found.group(1).upper()
            continue
        sections[section] = sections.get(section, 0) + 1
        if section == "UNITS" and (found := re.fullmatch(r"LENGTH\s*=(.*)", row, re.IGNORECASE)):
            unit = found.group(1).strip().removeprefix("'").removesuffix("'").strip()
        elif section == "HARDPOINT" and row.startswith("{"):
            columns = tuple(row.strip("{}").split())
            if sorted(columns) != sorted(COLUMNS):
                raise fault(
                    file,
                    where,
                    f"found the columns {shown(row)}, expected {{{' '.join(COLUMNS)}}}. Correct"
                    " them",
                )
        elif section == "HARDPOINT":
            name, symmetry, point = _row(file, where, row, columns)
            if inner:
                variants.setdefault(inner, []).append(f"{name} in {where}")
            elif symmetry == RIGHT:
                right += 1
            elif name in points:
                raise twice(file, where, name, points[name].where)
            else:
                points[name] = point
    if not points:
        raise fault(
            file,
            "",
            f"found no row in a block {BLOCK}, expected hardpoints. Give a subsystem file of"
            " Adams/Car",
        )
    left_out = [
        f"[{name}] ({rows} rows)"
        for name, rows in sections.items()
        if name not in ("HARDPOINT", "UNITS", "") and rows
    ]
    left_out += [f"{sections.get('', 0)} rows above the first block"] * ("" in sections)
    left_out += [f"({name}): {shortened(rows, MOST_NAMED)}" for name, rows in variants.items()]
    left_out += [f"{right} points of the right side"] * bool(right)
    return HardpointTable(file, "Adams/Car", points, unit, "rearward,right,up", None, left_out)


def _row(file: Path, where: str, row: str, columns: tuple[str, ...]) -> tuple[str, str, Hardpoint]:
    fields = [(quoted or bare).strip() for quoted, bare in _FIELD.findall(row)]
    if len(fields) != len(columns):
        raise fault(
            file,
            where,
            f"found {len(fields)} fields, expected {len(columns)}: {' '.join(columns)}. Complete"
            " the row",
        )
    cells = dict(zip(columns, fields, strict=True))
    name, symmetry = cells["hardpoint_name"], cells["symmetry"].lower()
    require_name(file, where, name)
    if symmetry not in (*LEFT, RIGHT):
        raise fault(
            file,
            where,
            f"{name}: found symmetry {shown(symmetry)}, expected a side."
            f" {sentence(remedy(symmetry, (*LEFT, RIGHT)))}",
        )
    x, y, z = (number(file, f"{where}: {name}: {axis}", cells[axis]) for axis in COLUMNS[2:])
    return name, symmetry, Hardpoint((x, y, z), where)


WHEEL_CENTER = "Spindle/COM"
"""The centre of mass of the spindle: Chrono places the wheel there."""

TOE, CAMBER = "Toe Angle (deg)", "Camber Angle (deg)"
"""Angles of the wheel at design; positive: toe-in, top outboard. ChDoubleWishbone.cpp turns the
spindle by them about z, then about x."""

# An unclosed text or comment matches to the end of the line or file. Without a match, the search
# would start anew at every quote and every /*.
_STRING_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*+"?|//[^\n]*|/\*.*?(?:\*/|\Z)', re.DOTALL)


def without_comments(text: str) -> str:
    """Return JSON without Chrono's comments; lines and columns stay the same."""

    def blank(found: re.Match[str]) -> str:
        part = found.group()
        return part if part.startswith('"') else re.sub(r"[^\n]", " ", part)

    return _STRING_OR_COMMENT.sub(blank, text)


def is_chrono(tables: Mapping[str, Any]) -> bool:
    """Return whether the tables of a JSON file are of a vehicle model of Chrono."""
    sections = [cast("dict[str, Any]", each) for each in tables.values() if isinstance(each, dict)]
    return (
        "Template" in tables
        or isinstance(tables.get("Type"), str)
        or any(key.startswith("Location") for section in sections for key in section)
    )


_BESIDE_BUSHINGS = (
    *("Bushing Data", "Mass", "COM", "Moments of Inertia"),
    *("Spring Coefficient", "Curve Data", "Free Length", "Damping Coefficient"),
)
"""Keys that a file with bushings has for statics."""


_BUSHING_KEYS = tuple(
    f"{law} {kind}" for law in ("Stiffness", "Damping") for kind in ("Linear", "Rotational")
)


def read_chrono(file: Path, supplied: HardpointOptions) -> HardpointTable:
    """Return the points of a suspension, named "Section/Key" as in the file.

    Raises:
        CaseError: not JSON, no suspension, or an invalid point.
    """
    tables = parse(file, without_comments(text_of(file)))
    kind = tables.get("Type", "Suspension")
    if kind != "Suspension":
        raise fault(
            file,
            "Type",
            f'found {shown(kind)}, expected "Suspension". Give the JSON file of a suspension',
        )
    template = tables.get("Template")
    if template is not None and not isinstance(template, str):
        raise fault(
            file,
            "Template",
            f"found {shown(template)}, expected the name of a suspension template. Correct the"
            " value",
        )
    points = dict[str, Hardpoint]()
    left_out = list[str]()
    beside = dict[str, dict[str, Any]]()
    soft = any(isinstance(x, dict) and "Bushing Data" in x for x in tables.values())
    toe, camber = (math.radians(number(file, key, tables.pop(key, 0.0))) for key in (TOE, CAMBER))
    for section, content in tables.items():
        if section in ("Name", "Type", "Template"):
            continue
        if not isinstance(content, dict):
            left_out.append(section)
            continue
        others = list[str]()
        beside[section] = cast("dict[str, Any]", content)
        for key, value in cast("dict[str, Any]", content).items():
            name = f"{section}/{key}"
            if key.startswith("Location") or name == WHEEL_CENTER:
                points[name] = Hardpoint(_point(file, name, value), name)
            elif not (soft and key in _BESIDE_BUSHINGS):
                others.append(key)
            elif key == "Bushing Data":
                _require_bushing_keys(Section(file, name, value))
        if others:
            left_out.append(f"{section} ({', '.join(others)})")
    if not points:
        raise fault(
            file,
            "",
            'found no key "Location ...", expected the points of a suspension. Give a suspension'
            " file of Chrono",
        )
    return HardpointTable(
        *(file, "Project Chrono", points, "m", "forward,left,up", template, left_out, toe, camber),
        beside=beside,
    )


def _require_bushing_keys(data: Section) -> None:
    """Refuse keys of a bushing unknown to Chrono (ChVehicleJoint.cpp)."""
    data.require_keys((*_BUSHING_KEYS, "DOF"))
    if data.at("DOF").value is not None:
        data.at("DOF").require_keys(_BUSHING_KEYS)


def _point(file: Path, key: str, value: object) -> tuple[float, float, float]:
    numbers = cast("list[object]", value) if isinstance(value, list) else []
    if len(numbers) != 3:
        raise fault(
            file,
            key,
            f"found {shown(cast('object', value))}, expected three numbers [x, y, z]. Correct the"
            " point",
        )
    x, y, z = (number(file, key, each) for each in numbers)
    return x, y, z


_OF_ASSETTO = re.compile(r"(?:WBCAR|WBTYRE|STRUT)_\w+")


def is_assetto(text: str) -> bool:
    """Return whether a text has points of a suspension of Assetto Corsa."""
    return re.search(rf"^\s*{_OF_ASSETTO.pattern}\s*=", text, re.MULTILINE) is not None


def read_assetto(file: Path, supplied: WheelOptions) -> HardpointTable:
    """Return the points of an axle of Assetto Corsa (suspensions.ini), of its left wheel unless the
    corner is a right one.

    Points are in metres from the wheel's centre: x inboard, y up, z forward. The centre is half a
    TRACK from the middle.

    Raises:
        CaseError: there are several axles with points, none, no TRACK, or an invalid point.
    """
    sections = dict[str, dict[str, tuple[str, str]]]()
    section, stray = "", list[str]()
    for k, line in enumerate(text_of(file).splitlines(), 1):
        row = re.split(r";|//", line)[0].strip()
        key, equals, value = (part.strip() for part in row.partition("="))
        if head := _SECTION.fullmatch(row):
            section = head[1].upper()
        elif equals:
            keys = sections.setdefault(section, {})
            if key in keys:
                raise twice(file, f"line {k}", key, keys[key][0])
            keys[key] = (f"line {k}", value)
        elif row:
            stray.append(f"line {k} ({brief(row)})")
    axles = [name for name, keys in sections.items() if any(map(_OF_ASSETTO.fullmatch, keys))]
    corner = None if supplied.corner is None else wanted_corner(file, supplied.corner)
    wanted = supplied.sheet or (corner[0] if corner else "")
    chosen = [name for name in axles if wanted.upper() in ("", name)]
    if len(chosen) != 1:
        found = f"found points of {', '.join(axles)}"
        raise fault(file, "", f"{found}, expected those of one axle. Choose it by --sheet FRONT")
    keys = sections[chosen[0]]
    if "TRACK" not in keys:
        raise fault(file, chosen[0], "found no TRACK, expected it beside the points. Add it")
    half = 0.5 * number(file, keys["TRACK"][0], keys["TRACK"][1])
    outward = -1.0 if corner and corner[1] == "right" else 1.0
    points = {"wheel_center": Hardpoint((0.0, outward * half, 0.0), keys["TRACK"][0])}
    left_out = [f"[{name}]" for name in sections if name and name != chosen[0]]
    left_out += [*sections.get("", ()), *stray]
    for key, (where, value) in keys.items():
        if not _OF_ASSETTO.fullmatch(key):
            left_out += [f"{key}={value}"] * (key not in ("TRACK", "TYPE"))
            continue
        x, y, z = _point(file, f"{where}: {key}", value.split(","))
        points[key] = Hardpoint((z, outward * (half - x), y), where)
    return HardpointTable(
        *(file, "Assetto Corsa", points, "m", "forward,left,up"),
        *(keys.get("TYPE", ("", None))[1], left_out),
        side=corner[1] if corner and corner[1] else None,
        corner=corner,
    )
