"""Hardpoints in tables of text and sheets of workbooks: a head `name,x,y,z`, then a row for each
point; or columns instead of rows. Without a head: a coordinate in each row, or rows of a name and
three numbers. A text of assignments is read by `tree`.

The reader leaves out and lists titles above the head, further columns, and rows without a point.
Comments and rows above the head give facts: `# units: mm`, `axes: rearward,right,up`, `template:
mcpherson`; the unit may also stand in the head or in a row below.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from typing import TypeAlias
from unicodedata import combining, normalize

from ...case.io.document import fault, shown
from ...case.io.readers import text_of
from ...case.io.table import (
    DELIMITERS,
    Cell,
    Row,
    Table,
    find_decimal_sign,
    is_number,
    one_sheet,
    read_sheets,
    split_head,
    text_table,
    trim,
)
from ...case.units import LENGTHS
from ...errors import MOST_NAMED, OpenError, brief, shortened
from .options import WheelOptions
from .programs import plain_lines
from .reader import TABLE
from .table import (
    Hardpoint,
    HardpointTable,
    angles_and_radius,
    incomplete,
    length_name,
    number,
    one_unit,
    require_name,
    twice,
    wanted_corner,
)
from .templates import ROLES, agree, compact, corner_of, head_of_corner, kind_of_head
from .tree import FEWEST, add_fact, axis_of, is_assignments, read_assignments
from .words import fact_of, require_no_slip

COMMENTS = ("#", "%", "//")
HEAD = ("name", "x", "y", "z")
# Largest number of points on a sheet, and as many other rows.
MOST_ROWS = 20_000
# Further ones hold no points.
MOST_LINES = 2 * MOST_ROWS
_COLUMN = re.compile(
    r"(?:(?:loc|coord|coordinate|pos|position|coordonnee|coordinata|coordenada|koordinate|quota)"
    r"\.?[_ ]?)?([xyz])"
    r"(?:[-_ ]?(?:value|wert|coord|coordinate|pos|position|koordinate|坐标|轴|向|方向))?"
    r"(?:\s*[\[(_/,]\s*([a-z]+)\s*[\])]?|\s+(?:in\s+)?([a-z]+))?"
)
_REMARKS = ("meaning", "remark", "remarks", "comment", "comments", "note", "notes", "description")
_SIGNS = re.compile(rf"[{DELIMITERS}]+")


@dataclass(frozen=True)
class Head:
    """The head of a table.

    Attributes:
        where: its place.
        columns: indices of name, x, y and z among the fields.
        names: names of all fields, as in the file.
        unit: unit of the coordinates, if the head gives it.
    """

    where: str
    columns: Sequence[int]
    names: Sequence[str]
    unit: str | None

    @property
    def of_corners(self) -> list[int]:
        """Indices of the columns whose names are those of corners, axles or sides."""
        return [k for k, name in enumerate(self.names) if head_of_corner(name)]

    @property
    def others(self) -> list[str]:
        """The names of the further columns."""
        return [name for k, name in enumerate(self.names) if name and k not in self.columns]


_Parts: TypeAlias = tuple[Head, Sequence[Row], Sequence[Row]]
"""The head of a table, and the rows above and below it."""


def read_plain(file: Path, supplied: WheelOptions) -> HardpointTable:
    """Return the points of a text by name.

    Args:
        supplied: section or corner of the names, if the text has several suspensions.

    Raises:
        CaseError: no head, or a row at odds with the head.
    """
    text = text_of(file, of_spreadsheet=True)
    if "[BAR]" in text:
        raise fault(file, "", f"found a text with [BAR], which {TABLE.unread['.pm']}")
    table = text_table(file, text.splitlines(), COMMENTS, _delimiter)
    facts, remarks, comments = dict[str, str](), list[str](), {*table.comments}
    for k, comment in enumerate(text.splitlines(), 1):
        if comment not in comments:
            continue
        where = f"line {k}"
        bare = comment.strip('" \t\r').lstrip("".join(COMMENTS)).rstrip(f'"{DELIMITERS}')
        if fact := fact_of(_SIGNS.sub(",", bare)):
            add_fact(file, where, facts, fact)
        require_no_slip(file, where, bare)
        if fact is None and bare.strip():
            remarks.append(_note(where, [bare.strip()]))
    lines = [
        (f"line {k}", line)
        for k, line in enumerate(table.lines, 1)
        if line.strip(f" \r{DELIMITERS}")
    ]
    if file.suffix.lower() == ".m":
        lines = plain_lines(text)
    if not lines:
        raise fault(
            file, "", f"is empty, expected a table of hardpoints. Begin it with {','.join(HEAD)}"
        )
    if is_assignments(lines):
        return read_assignments(file, lines, facts, supplied)
    if len(lines) > MOST_LINES:
        raise fault(
            file,
            "",
            f"found {len(lines)} lines, expected a suspension's, {MOST_LINES} at most. Take out the"
            " others",
        )
    if supplied.sheet is not None:
        raise fault(
            file,
            "--sheet",
            f"found {shown(supplied.sheet)} for a table of text, expected none. Leave it out",
        )
    found = read_rows(table, "Text" if table.delimiter == " " else "CSV", facts, supplied)
    return replace(found, left_out=[*found.left_out, *remarks])


def read_spreadsheet(file: Path, supplied: WheelOptions) -> HardpointTable:
    """Return the points of a workbook by name.

    Args:
        supplied: name of the sheet, or corner; without, the only sheet with a table.

    Raises:
        CaseError: the file is no readable workbook, no sheet or several sheets have a head, or a
            row is at odds with the head.
    """
    sheets = read_sheets(file, supplied.sheet, MOST_ROWS)
    tables = [sheet for sheet in sheets if _parts(file, sheet.sheet) is not None]
    if sheets and not tables:
        names = ", ".join(shown(sheet.name) for sheet in sheets)
        raise fault(
            file,
            "",
            f"found no head on the sheets {names}, expected {','.join(HEAD)}. Write it above the"
            " points",
        )
    corners = {sheet.name: corner_of(sheet.name) for sheet in tables}
    if supplied.corner is not None and all(corners.values()):
        wanted = wanted_corner(file, supplied.corner)
        tables = [each for each in tables if agree(corners[each.name] or ("", ""), wanted)]
        if not tables:
            names = ", ".join(map(shown, corners))
            problem = f"found the sheets {names}, expected one of {supplied.corner}"
            raise fault(file, "--corner", f"{problem}. Correct it, or choose by --sheet NAME")
    if len(tables) > 1:
        names = shortened([brief(shown(each.name)) for each in tables], MOST_NAMED)
        corner = corners[tables[0].name] if all(corners.values()) else None
        which = ("corner", _word_of(corner)) if corner else ("sheet", tables[0].name)
        option = shlex.join([f"--{which[0]}", which[1]])
        why = f"{option}: the sheets {names} have tables. This is the first."
        raise OpenError(file, [why], dict([which]), {})
    sheet = one_sheet(file, tables, "--sheet NAME")
    found = read_rows(sheet, f"Sheet {shown(sheet.name)}:", {}, supplied)
    if found.corner is None and (corner := corners[sheet.name]):
        found = replace(found, corner=corner, side=found.side or corner[1] or None)
    others = [f"sheet {shown(each.name)}" for each in sheets if each.name != sheet.name]
    return replace(found, left_out=[*found.left_out, *others])


def _delimiter(table: Table) -> str:
    """Return the separator of a head, or else the most frequent separator of the first line; a
    blank if no line has one.
    """
    if not any(map(_SIGNS.search, table.lines)):
        return " "
    first = next(line for line in table.lines if line.strip(f" \r{DELIMITERS}"))
    for k, line in enumerate(table.lines, 1):
        for sign in sorted(DELIMITERS, key=line.count, reverse=True):
            cells = [cell.strip(' \r"') for cell in line.split(sign)]
            if _as_head(table.file, f"line {k}", cells):
                return sign
            if sum(map(is_number, cells)) >= 3:  # a point
                return max(DELIMITERS, key=first.count)
    return max(DELIMITERS, key=first.count)


def _join_words(words: Sequence[Cell]) -> Sequence[Cell]:
    """Return the cells of a line with blanks between them: words beside numbers are one name, which
    stands before all of these or behind them.
    """
    numbers = [*map(is_number, words)]
    first = next((k for k in range(len(words)) if all(numbers[k:])), len(words))
    last = next((k for k, each in enumerate(numbers) if not each), len(words))
    if 0 < first < len(words):
        return [" ".join(map(str, words[:first])), *words[first:]]
    if 0 < last < len(words):
        return [*words[:last], " ".join(map(str, words[last:]))]
    return words


def _with_names(rows: Sequence[Row]) -> Iterator[Row]:
    """Yield rows between blanks; a head x, y, z may stand above rows with names first."""
    for k, (where, cells) in enumerate(rows):
        after = rows[k + 1][1] if k + 1 < len(rows) else ()
        three = [_column(str(cell))[0] for cell in cells] == ["x", "y", "z"]
        named = three and len(after) == 4 and not is_number(after[0])
        yield where, ["name", *cells] if named else cells


def read_rows(
    table: Table, tool: str, facts: dict[str, str], supplied: WheelOptions
) -> HardpointTable:
    """Return the points of a table by name.

    Args:
        tool: program of the format.
        facts: unit, axes, side and template, from comments.
        supplied: corner, if the rows are of several.

    Raises:
        CaseError: no head and no other known form, a row at odds with it, or rows of several
            corners.
    """
    file, delimiter, rows = table.file, table.delimiter.strip(" "), [*table.rows()]
    if table.delimiter == " ":
        rows = [(where, _join_words([*filter(None, cells)])) for where, cells in rows]
        rows = [*_with_names(rows)]
    if (parts := _parts(file, rows)) is None:
        where, cells = rows[0]
        raise fault(
            file,
            where,
            f"found {shown(_row_text(cells))}, expected the head {','.join(HEAD)}. Write it above"
            " the points, or a name and x, y, z alone in each row",
        )
    head, above, body = parts
    left_out = list[str]()
    for where, cells in above:
        if fact := fact_of(_row_text([cell for cell in cells if cell != ""])):
            add_fact(file, where, facts, fact)
        else:
            left_out.append(_note(where, cells))
    unit = head.unit
    if unit is None and body:
        below = enumerate(body[0][1])
        texts = [str(cell) for k, cell in below if cell != "" and k != head.columns[0]]
        units = {length_name(text.strip("[]() ")) for text in texts}
        if len(texts) >= 3 and len(units) == 1 and units <= LENGTHS.keys():  # a row of units
            unit, body = units.pop(), body[1:]
    if unit and length_name(facts.get("unit", unit)) != length_name(unit):
        raise fault(
            file,
            head.where,
            f"found coordinates in {unit}, and {facts['unit']} in a comment, expected one unit."
            " Correct either",
        )
    for where, cells in body:
        if _as_head(file, where, cells):
            raise fault(
                file,
                where,
                "found a second head, expected one table (of the front, or of the rear). Keep one",
            )
    chosen, body, others = _of_one_corner(file, head, body, supplied.corner)
    left_out += others
    found = list[tuple[str, str, Sequence[Cell]]]()
    rows_of = [[cells[k] if k < len(cells) else "" for k in head.columns] for _, cells in body]
    unnamed = bool(rows_of) and all(own[0] == "" for own in rows_of)
    for n, ((where, cells), own) in enumerate(zip(body, rows_of, strict=True), 1):
        if unnamed and "" not in own[1:]:
            found.append((where, f"P{n}", own[1:]))
            continue
        role = isinstance(own[0], str) and compact(own[0]) in ROLES
        if "" in own[1:] and not role:
            if stated := fact_of(_row_text([cell for cell in cells if cell != ""])):
                facts.setdefault(*stated)
            else:
                left_out.append(_note(where, cells))
        else:
            _require_complete(file, where, cells, head, delimiter)
            found.append((where, _row_text(own[:1]), own[1:]))
    points = _points(file, found, "," if delimiter == "," else ".,")
    if not points:
        raise fault(
            file, "", "found a head and no row, expected hardpoints. The file was cut: save it anew"
        )
    of_corners = head.of_corners if chosen else []
    columns = [name for k, name in enumerate(head.names) if k not in of_corners]
    left_out += [f"column {brief(name)}" for name in head.others if name in columns]
    headless = {
        k
        for _, cells in body
        for k in range(len(head.names), len(cells))
        if cells[k] != "" and k not in head.columns
    }
    left_out += [f"column {k + 1}, which has no head" for k in sorted(headless)]
    return HardpointTable(
        *(file, tool, points, unit or facts.get("unit")),
        *(facts.get("axes"), facts.get("template"), left_out),
        side=facts.get("side") or (chosen or ("", ""))[1] or None,
        corner=chosen,
        texts=[*table.comments, *left_out, *head.names, table.name],
        **angles_and_radius(facts),
    )


def _of_one_corner(
    file: Path, head: Head, body: Sequence[Row], said: str | None
) -> tuple[tuple[str, str] | None, Sequence[Row], list[str]]:
    """Return the corner of the points by its columns, its rows, and what was left out; None without
    such columns. A blank cell has the corner above, as merged cells do.
    """
    places = head.of_corners
    if not places or not body:
        return None, body, []
    corners = list[tuple[str, str]]()
    above = dict.fromkeys(places, "")
    for _, cells in body:
        above |= {k: str(cells[k]) for k in places if k < len(cells) and cells[k] != ""}
        found = [corner_of(text, head.names[k]) for k, text in above.items()]
        if None in found:
            return None, body, []
        axles, sides = zip(*filter(None, found), strict=True)
        corners.append(("".join(dict.fromkeys(axles)), "".join(dict.fromkeys(sides))))
    names = dict.fromkeys(corners)
    wanted = None if said is None else wanted_corner(file, said)
    chosen = [each for each in names if wanted is None or agree(each, wanted)]
    if len(chosen) != 1:
        listed = shortened([" ".join(filter(None, each)) for each in names], MOST_NAMED)
        if said is None:
            word = _word_of(next(iter(names)))
            why = f"--corner {word}: the table has points of {listed}. This is the first."
            raise OpenError(file, [why], {"corner": word}, {})
        problem = f"found points of {listed}, expected {said}. Choose one of them"
        raise fault(file, "--corner", problem)
    kept = [row for row, corner in zip(body, corners, strict=True) if corner == chosen[0]]
    others = [
        f"{corners.count(each)} rows of {' '.join(each)}" for each in names if each != chosen[0]
    ]
    return chosen[0], kept, others


def _word_of(corner: tuple[str, str]) -> str:
    """Return the option of a corner: FL, RR, front or left."""
    axle, side = corner
    return f"{axle[0]}{side[0]}".upper() if axle and side else axle or side


def _points(
    file: Path, rows: Sequence[tuple[str, str, Sequence[Cell]]], grouping: str
) -> dict[str, Hardpoint]:
    """Return the points of rows: place, name, and coordinates each."""
    lines = dict[str, str]()
    cells = list[tuple[str, Cell]]()
    for where, name, coordinates in rows:
        require_name(file, where, name)
        if name in lines:
            raise twice(file, where, name, lines[name])
        lines[name] = where
        cells += zip((f"{where}: {name}: {axis}" for axis in "xyz"), coordinates, strict=True)
    texts = [(where, cell) for where, cell in cells if isinstance(cell, str)]
    sign = find_decimal_sign(file, texts, grouping)
    values = iter([number(file, where, cell, sign) for where, cell in cells])
    return {
        name: Hardpoint((next(values), next(values), next(values)), where)
        for name, where in lines.items()
    }


def _row_text(cells: Sequence[Cell]) -> str:
    """Return cells as a text, separated by commas."""
    return ",".join(cell if isinstance(cell, str) else f"{cell:.15g}" for cell in cells)


def _note(where: str, cells: Sequence[Cell]) -> str:
    return f"{where} ({brief(_row_text(cells).strip(','))})"


def _require_complete(
    file: Path, where: str, cells: Sequence[Cell], head: Head, delimiter: str
) -> None:
    """Refuse a row with other fields than the head.

    If commas separate the fields, a decimal comma splits a number into two fields. The second is
    indistinguishable from a value of a further column if rows may be shorter or longer than the
    head. A row may lack its remark.
    """
    filled = len(trim(cells))
    headed = {k for k, name in enumerate(head.names) if name} | set(head.columns)
    surplus = delimiter and any(cell != "" and k not in headed for k, cell in enumerate(cells))
    exact = delimiter != "," or not head.others or len(cells) == len(head.names)
    lacking = [name.lower() for name in head.names[len(cells) :]]
    exact = exact or (bool(lacking) and {*lacking} <= {*_REMARKS})
    if surplus or not exact or max(head.columns) >= filled:
        expected = [name or HEAD[0] for k, name in enumerate(head.names) if k in headed]
        comma = ". A decimal comma needs semicolons between the fields" if delimiter == "," else ""
        raise fault(
            file,
            where,
            f"found {filled} fields, expected {len(expected)}: {', '.join(map(brief, expected))}."
            f" Complete the row{comma}",
        )


def _parts(file: Path, rows: Sequence[Row]) -> _Parts | None:
    """Return the head of rows, or of columns, and what is above and below it; None for rows of no
    known form.
    """
    columns = zip_longest(*(cells for _, cells in rows), fillvalue="")
    turned = [(f"column {k}", cells) for k, cells in enumerate(columns, 1) if any(map(str, cells))]
    for each in (rows, turned):
        for k, row in enumerate(each):
            if head := _as_head(file, *row):
                return head, each[:k], each[k + 1 :]
            if sum(map(is_number, row[1])) >= 3:  # a point
                break
    if any(_as_head(file, *row) for row in rows):  # below a point
        return None
    for each in (rows, turned):
        if found := _by_coordinate(file, each) or _by_point(file, each):
            return found
    return None


def _as_head(file: Path, where: str, cells: Sequence[Cell]) -> Head | None:
    """Return the head of these fields; None if they are not a head."""
    columns = dict[str, int]()
    units = set[str | None]()
    texts = [cell if isinstance(cell, str) else "" for cell in cells]
    if sum(text.lower() == "x" for text in texts) > 2:  # a column of the coordinates' names
        return None
    for k, text in enumerate(texts):
        column, unit = _column(text)
        if column not in HEAD:
            continue
        if column == "name" and column in columns:  # a name and what it means
            continue
        if column in columns:
            raise fault(
                file,
                where,
                f"found the column {shown(column)} twice, expected it once. Take out the one that"
                " is no coordinate",
            )
        columns[column] = k
        units |= {unit} if column != "name" else set()
    if not {"x", "y", "z"} <= columns.keys():
        return None
    if "name" not in columns:  # the only column before the coordinates, under any name, or beside
        before = [k for k in range(min(columns.values())) if not head_of_corner(texts[k])]
        if len(before) > 1:
            before = [k for k in before if kind_of_head(texts[k]) != "number"]
        if len(before) != 1:
            before = [k for k in range(4) if k not in columns.values()]
            if before[0] != 3 or any(texts[3:]):  # below no name, at the end
                return None
        columns["name"] = before[0]
    if len(units) > 1:
        raise fault(
            file,
            where,
            f"found {shown(','.join(texts))}, expected one unit for x, y and z. Write it with each"
            " or with none",
        )
    return Head(where, [columns[each] for each in HEAD], texts, units.pop())


def _column(text: str) -> tuple[str, str | None]:
    """Return the column and the unit of a name in the head; empty for a further column."""
    if kind_of_head(text) == "name":
        return "name", None
    plain = "".join(each for each in normalize("NFKD", text.lower()) if not combining(each))
    if (found := _COLUMN.fullmatch(plain)) is None:
        return "", None
    axis, unit, bare = found.groups()
    if bare is not None and length_name(bare) not in LENGTHS:
        return "", None
    return axis, unit or bare


def _by_coordinate(file: Path, rows: Sequence[Row]) -> _Parts | None:
    """Return the points of rows with one coordinate each."""
    points = dict[str, dict[str, tuple[str, Cell]]]()
    units = dict[str, str]()
    others, remarks = list[Row](), list[Row]()
    for where, cells in rows:
        if (coordinate := _coordinate(cells)) is None:
            others.append((where, cells))
            continue
        name, axis, values, unit, more = coordinate
        if more:
            remarks.append((where, more))
        if len(values) > 1:
            raise fault(
                file,
                where,
                f"found {len(values)} numbers for {name} {axis}, expected one. Keep the numbers of"
                " one design (a decimal comma needs semicolons between the fields)",
            )
        place = points.setdefault(name, {})
        if axis in place:
            raise twice(file, where, f"{name} {axis}", place[axis][0])
        place[axis] = (where, values[0])
        if unit:
            units.setdefault(length_name(unit), where)
    whole = [name for name, place in points.items() if len(place) == 3]
    if len(rows) - len(others) < FEWEST or not whole:
        return None
    # a head such as `parameter, value [mm]`
    texts = (cell for _, cells in others for cell in cells if isinstance(cell, str))
    stated = (unit for text in texts if length_name(unit := split_head(text)[1]) in LENGTHS)
    unit = one_unit(file, units) or next(stated, None)
    body = list[Row]()
    for name, place in points.items():
        if name in whole:
            body.append((place["x"][0], [name, *(place[axis][1] for axis in "xyz")]))
        elif compact(name) in ROLES:
            raise incomplete(file, next(iter(place.values()))[0], name, place)
        else:
            others += [(where, [f"{name} {axis}"]) for axis, (where, _) in place.items()]
    return Head("the head", range(4), HEAD, unit), [*others, *remarks], body


def _coordinate(cells: Sequence[Cell]) -> tuple[str, str, list[Cell], str, list[Cell]] | None:
    """Return name, axis, numbers, unit and further cells of a row of a coordinate; None for another
    row.
    """
    filled = [cell for cell in cells if cell != ""]
    if len(filled) < 2 or not isinstance(filled[0], str) or is_number(filled[0]):
        return None
    name, *rest = filled
    bare, unit = split_head(str(name))
    if isinstance(rest[0], str) and rest[0].lower() in ("x", "y", "z"):
        split, rest = (str(name), rest[0].lower()), rest[1:]
    else:
        split = axis_of(bare)
    values = [cell for cell in rest if is_number(cell)]
    if split is None or not values or not is_number(rest[0]):
        return None
    more = rest[len(values) :]
    if more and isinstance(more[0], str) and length_name(more[0].strip("[]() ")) in LENGTHS:
        unit, more = more[0].strip("[]() "), more[1:]
    return (*split, values, unit if length_name(unit) in LENGTHS else "", more)


def _by_point(file: Path, rows: Sequence[Row]) -> _Parts | None:
    """Return rows of a name and three numbers, or of three numbers and a name."""
    body = list[Row]()
    others = list[Row]()
    for where, cells in rows:
        filled = [cell for cell in cells if cell != ""]
        numbers = [k for k, cell in enumerate(filled) if is_number(cell)]
        if not numbers:
            others.append((where, cells))
        elif len(filled) == 4 and numbers == [1, 2, 3]:
            body.append((where, filled))
        elif len(filled) == 4 and numbers == [0, 1, 2]:
            body.append((where, [filled[3], *filled[:3]]))
        elif len(filled) == len(numbers) == 3:
            body.append((where, [f"P{len(body) + 1}", *filled]))
        elif len(filled) == len(numbers) == 4 and str(filled[0]).split(".")[0] == str(
            len(body) + 1
        ):
            body.append((where, [f"P{len(body) + 1}", *filled[1:]]))
        else:
            return None
    if len(body) < FEWEST:
        return None
    return Head("the head", range(4), HEAD, None), others, body
