"""Tables of cells: texts of spreadsheets and other programs, and sheets of workbooks (.xlsx,
.xlsm), read by openpyxl. Of a formula, its value counts that the spreadsheet program has computed.

Fields of a text stand between commas, semicolons, tabs, the sign of a line `sep=`, or blanks. The
decimal sign is a point or a comma, by the country of the spreadsheet. The head of a column may have
a unit, `toe [deg]`, `toe (deg)`, `toe, deg`, `toe_deg`: a product of known units, `deg/mm`,
`mm/s^2`, `N mm`.
"""

from __future__ import annotations

import csv
import io
import re
import warnings
import zipfile
import zlib
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias
from unicodedata import combining, normalize

from ...errors import MOST_NAMED, KincheckError, brief, remedy, shortened
from ...extras import library
from ..units import ANGLES, LENGTHS, Unit
from .document import decimal, fault, read_bytes, shown
from .foreign import ARCHIVE, EXCEL, binary, recognise_format, too_large

DELIMITERS = ";\t,"
Cell: TypeAlias = str | float
"""A cell: a text, empty for an empty cell, or a number of a workbook."""
Row: TypeAlias = tuple[str, Sequence[Cell]]
"""Place of a row for messages, and its cells."""

LARGEST_FILE = 64_000_000
# A sheet is compressed about ten times; a far larger ratio is an attack on the memory.
MOST_BYTES = 128_000_000
# Some microseconds for each: a cell has four tags. Styles take ten times as long.
MOST_TAGS, MOST_TAGS_ELSEWHERE = 4_000_000, 400_000
CHUNK = 1_000_000
# A sheet can have 16384 columns and a million rows; a table of points or curves has far fewer.
MOST_COLUMNS, MOST_COLUMNS_OF_TEXT = 1000, 100_000
MOST_ROWS = 1_048_576
MOST_CELLS = 1_000_000
"""Of a sheet, those of blank rows and columns among them."""
LESS = "take out what is not the table, or save it as CSV"
_SEPARATOR = re.compile(r"\"?sep=([^\"])\"?", re.IGNORECASE)
_BEFORE_UNIT = re.compile(r"\s+(?=[\[(])")
_SIGNS = re.compile(r"[.,]")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_DAMAGED = (
    *(zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, OSError, EOFError),
    RuntimeError,  # a password
)


_Powers: TypeAlias = tuple[int, int, int, int]
"""Powers of length, angle, time and force."""
_LENGTH, _ANGLE = (1, 0, 0, 0), (0, 1, 0, 0)
_OTHER_NAMES: Mapping[str, Sequence[str]] = {
    "m": ("meter", "metre", "meters", "metres"),
    "mm": ("millimeter", "millimetre", "millimeters", "millimetres"),
    "cm": ("centimeter", "centimetre", "centimeters", "centimetres"),
    "inch": ("in", "inches", '"'),
    "foot": ("ft", "feet"),
    "rad": ("radian", "radians"),
    "deg": ("degree", "degrees", "°", "º"),
}
UNIT_NAMES: Mapping[str, str] = {
    other: name for name, others in _OTHER_NAMES.items() for other in (name, *others)
}
"""Names of units of length and angle by their other names, in small letters."""
_KINDS: Sequence[tuple[str, _Powers, Mapping[str, float]]] = (
    ("no unit, [-] or [%]", (0, 0, 0, 0), {"1": 1.0, "-": 1.0, "%": 0.01}),
    ("a length: m, mm, cm, inch or foot", _LENGTH, {"um": 1e-6, "µm": 1e-6}),
    (
        "an angle: deg, rad, mrad or arcmin",
        _ANGLE,
        {"mrad": 1e-3, "arcmin": ANGLES["deg"].size / 60.0},
    ),
    ("a time: s or ms", (0, 0, 1, 0), {"s": 1.0, "sec": 1.0, "ms": 1e-3}),
    ("a force: N or kN", (0, 0, 0, 1), {"n": 1.0, "newton": 1.0, "kn": 1e3}),
    ("a unit such as N m", (1, 0, 0, 1), {"nm": 1.0, "nmm": 1e-3}),
)
_FACTORS = {
    **{name: (unit.size, _LENGTH) for name, unit in LENGTHS.items()},
    **{name: (unit.size, _ANGLE) for name, unit in ANGLES.items()},
    **{name: (size, powers) for _, powers, units in _KINDS for name, size in units.items()},
}
_WORDS = {powers: words for words, powers, _ in _KINDS}
_IN_BRACKETS = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*", re.DOTALL)
_BETWEEN = re.compile(r"[\s_,/]+")
_LONGEST = 30
_FACTOR = re.compile(r"([^\d^]+|1)\s*(?:\^?\s*([+-]?[1-9]))?")


@dataclass(frozen=True)
class Table:
    """A table of text, or a sheet of a workbook.

    Attributes:
        lines: of a text; those of comments and a line `sep=` are blank.
        comments: the lines of comments of a text.
        delimiter: sign between the fields of a text, a blank for any number of them; empty for a
            sheet.
        name: of a sheet, for messages and to choose it.
        sheet: the rows of a sheet with filled cells.
    """

    file: Path
    lines: Sequence[str] = ()
    comments: Sequence[str] = ()
    delimiter: str = ""
    name: str = ""
    sheet: Sequence[Row] = ()

    def rows(self) -> Iterator[Row]:
        """Yield the rows with filled cells, those of a text anew at each call: as texts, the cells
        of a large file take many times its size.

        Raises:
            CaseError: a line of a text is not valid.
        """
        yield from self.sheet
        blanks = self.delimiter == " "
        lines = (
            " ".join(_BEFORE_UNIT.sub("", line).split()) if blanks else line for line in self.lines
        )
        reader = csv.reader(
            lines, delimiter=self.delimiter or ",", skipinitialspace=True, strict=True
        )
        first = 1
        try:
            for found in reader:
                cells = [cell.strip() for cell in found]
                if any(cells):
                    yield f"line {first}", cells
                first = reader.line_num + 1
        except csv.Error as error:
            raise fault(
                self.file, f"line {first}", f"not valid CSV: {error}; correct the line"
            ) from None


def text_table(
    file: Path,
    lines: Sequence[str],
    comments: tuple[str, ...],
    find_delimiter: Callable[[Table], str],
) -> Table:
    """Return a table of text.

    Args:
        comments: starts of comments.
        find_delimiter: returns the sign between fields unless a line `sep=` states it.

    Raises:
        CaseError: a line has more columns than people write.
    """
    remarks = [line.strip('" \t\r').startswith(comments) for line in lines]
    said = [line for line, remark in zip(lines, remarks, strict=True) if remark]
    lines = ["" if remark else line for line, remark in zip(lines, remarks, strict=True)]
    first = next((k for k, line in enumerate(lines) if line.strip(f" \r{DELIMITERS}")), None)
    if first is not None and (found := _SEPARATOR.fullmatch(lines[first].strip(" \r"))):
        delimiter, lines[first] = found[1], ""
    else:
        delimiter = find_delimiter(Table(file, lines))
    for k, line in enumerate(lines, 1):
        if line.count(delimiter) >= MOST_COLUMNS_OF_TEXT:
            problem = f"found more than {MOST_COLUMNS_OF_TEXT} columns, expected a table"
            raise fault(file, f"line {k}", f"{problem}; take out what is not the table")
    return Table(file, lines, said, delimiter)


def numeral(cell: Cell, sign: str = ".") -> str:
    """Return the number of a cell as a text with a decimal point; a workbook has 5 as 5.0, and word
    processors write a minus sign of their own.

    Args:
        sign: decimal sign of texts.
    """
    if isinstance(cell, str):
        return cell.replace(sign, ".").replace("\u2212", "-")
    return repr(cell).removesuffix(".0")


def folded(text: str, case: Callable[[str], str] = str.casefold) -> str:
    """Return a text in small letters without accents, with _ between its words."""
    apart = normalize("NFKD", case(text))
    return re.sub(r"[\W_]+", "_", "".join(each for each in apart if not combining(each))).strip("_")


def is_number(value: object) -> bool:
    """Return whether a value is a number, or a text of one with either decimal sign."""
    if not isinstance(value, str):
        return isinstance(value, int | float) and not isinstance(value, bool)
    try:
        decimal(numeral(value, ","))
    except ValueError:
        return False
    return True


def find_decimal_sign(file: Path, cells: Sequence[tuple[str, str]], possible: str = ".,") -> str:
    """Return the decimal sign of a table: "." or ",".

    A comma before three digits may also group thousands. So may a point if semicolons or tabs
    separate the fields. Other numbers of the table then decide; if none decides, the table is
    refused.

    Args:
        cells: place and text of each number.
        possible: signs able to group thousands in this table.

    Raises:
        CaseError: the numbers have both signs, group thousands, or leave the sign open.
    """
    first = dict[str, tuple[str, str]]()
    open_cell: tuple[str, str] | None = None
    decided, plain = False, False
    for where, text in cells:
        signs = _SIGNS.findall(text)
        if len(signs) > 1:
            raise fault(
                file,
                where,
                f"found {shown(text)}, expected one decimal sign; remove the separators of"
                " thousands",
            )
        if not signs:
            plain = True
            continue
        first.setdefault(signs[0], (where, text))
        if signs[0] in possible and _GROUPED.fullmatch(text):
            open_cell = open_cell or (where, text)
        else:
            decided = True
    if len(first) > 1:
        (_, other), (where, text) = first.values()
        raise fault(
            file,
            where,
            f"found {shown(text)}, and {shown(other)} above, expected one decimal sign in the"
            " table; write all numbers alike",
        )
    # If every number has three decimals, the size decides: read as thousands, the numbers are a
    # thousand times as large, too large for any suspension.
    if open_cell and plain and not decided:
        where, text = open_cell
        pointed, digits = _SIGNS.sub(".", text), _SIGNS.sub("", text)
        raise fault(
            file,
            where,
            f"found {shown(text)}, which is {pointed} or {digits}, expected one meaning; write"
            f" {pointed}0 or {digits}",
        )
    return next(iter(first), ".")


def read_sheets(file: Path, wanted: str | None, most_rows: int) -> list[Table]:
    """Return the sheets of a workbook with filled cells, or the wanted one alone.

    Args:
        wanted: name of a sheet.
        most_rows: largest number of rows of a sheet.

    Raises:
        CaseError: openpyxl is missing, the file is no workbook, has no such sheet, or is too large.
    """
    try:
        openpyxl = library("a spreadsheet", "openpyxl", "xlsx")
    except KincheckError as error:
        raise fault(file, "", f"{error}; or save the sheet as CSV") from None
    data = read_bytes(file, LARGEST_FILE, "take out what is not the table")
    _require_workbook(file, data)

    def workbook(**options: bool) -> Any:
        return openpyxl.load_workbook(io.BytesIO(data), read_only=True, keep_links=False, **options)

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and extensions; values need neither
            written, computed = workbook(), None
            names = [sheet.title for sheet in written.worksheets]
            if wanted is not None and wanted not in names:
                raise fault(
                    file,
                    "sheet",
                    f"found no sheet {shown(wanted)}, expected one of the file;"
                    f" {remedy(wanted, names)}",
                )
            sheets = list[Table]()
            for name in names if wanted is None else [wanted]:
                rows, formulas = _rows(file, written[name], most_rows)
                if formulas:
                    computed = computed or workbook(data_only=True)
                    values, _ = _rows(file, computed[name], most_rows)
                    rows = _with_computed_values(rows, dict(values))
                if rows:
                    sheets.append(Table(file, name=name, sheet=rows))
            return sheets
    except KincheckError:
        raise
    except Exception as error:  # zip, XML and openpyxl raise many errors for a damaged file
        what = brief(f"{type(error).__name__}: {error}".strip().replace("\n", " "))
        raise fault(
            file, "", f"is no readable workbook ({what}); save it anew as .xlsx, or as CSV"
        ) from None


def one_sheet(file: Path, sheets: Sequence[Table], option: str) -> Table:
    """Return the only sheet.

    Args:
        option: the option to choose a sheet, for the message.

    Raises:
        CaseError: there are several sheets, or none.
    """
    if not sheets:
        raise fault(file, "", "found no sheet with cells, expected a table; save the workbook anew")
    if len(sheets) > 1:
        names = shortened([brief(shown(sheet.name)) for sheet in sheets], MOST_NAMED)
        raise fault(
            file, "", f"found tables on the sheets {names}, expected one; choose it by {option}"
        )
    return sheets[0]


def _require_workbook(file: Path, data: bytes) -> None:
    """Refuse a file unless it is a zip archive of reasonable unpacked size."""
    what, advice = recognise_format(data)
    if not data:
        raise fault(file, "", "is empty, expected a workbook (.xlsx); save the workbook anew")
    if what not in (EXCEL, ARCHIVE):
        what = what or ("another binary file" if binary(data) else "a text")
        advice = advice or "save it as .xlsx, or name a table of text .csv"
        raise fault(file, "", f"found {what}, expected a workbook (.xlsx); {advice}")
    try:
        problem = _too_much(data)
    except _DAMAGED as error:
        raise fault(
            file, "", f"is a damaged workbook ({error}); save it anew as .xlsx, or as CSV"
        ) from None
    if problem:
        raise fault(file, "", f"{problem}; {LESS}")


def _too_much(data: bytes) -> str:
    """Return why an archive would take too long to read; empty if not."""
    if problem := too_large(data, MOST_BYTES):
        return problem
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        tags = 0
        for each in archive.infolist():
            elsewhere = 0
            with archive.open(each) as part:
                for chunk in iter(lambda: part.read(CHUNK), b""):
                    elsewhere += chunk.count(b"<")
            if each.filename.startswith(("xl/worksheets/", "xl/sharedStrings")):
                tags, elsewhere = tags + elsewhere, 0
            for found, most in ((tags, MOST_TAGS), (elsewhere, MOST_TAGS_ELSEWHERE)):
                if found > most:
                    return f"has {found} tags in {each.filename}, expected {most} at most"
    return ""


def _rows(file: Path, sheet: Any, most: int) -> tuple[list[Row], bool]:
    """Return the rows with filled cells, and whether any cell is a formula."""
    rows = list[Row]()
    formulas = False
    read = 0
    sheet.reset_dimensions()  # the dimensions in a workbook are often wrong
    for k, cells in enumerate(sheet.iter_rows(), 1):
        read += len(cells)
        filled = any(cell.value is not None for cell in cells)
        wide = any(cell.value is not None for cell in cells[MOST_COLUMNS:])
        for found, limit, what in (
            (wide * (MOST_COLUMNS + 1), MOST_COLUMNS, "columns"),
            (len(rows) + filled, most, "rows"),
            (k, MOST_ROWS, "rows, blank ones among them"),
            (read, MOST_CELLS, "cells, blank ones among them"),
        ):
            if found > limit:
                problem = f"found more than {limit} {what}, expected a table; {LESS}"
                raise fault(file, f"sheet {shown(sheet.title)}", problem)
        if filled:
            formulas = formulas or any(cell.data_type == "f" for cell in cells)
            rows.append((f"row {k}", trim([_cell(cell.value) for cell in cells])))
    return rows, formulas


def _with_computed_values(rows: Sequence[Row], values: Mapping[str, Sequence[Cell]]) -> list[Row]:
    """Return rows with the values of formulas; a formula without a value stays a formula."""

    def value(cell: Cell, found: Cell) -> Cell:
        return found if str(cell).startswith("=") and found != "" else cell

    return [
        (where, [*map(value, cells, [*values.get(where, ()), *[""] * len(cells)])])
        for where, cells in rows
    ]


def trim(cells: Sequence[Cell]) -> Sequence[Cell]:
    """Return cells without empty cells at the end."""
    filled = len(cells)
    while filled and cells[filled - 1] == "":
        filled -= 1
    return cells[:filled]


def _cell(value: Any) -> Cell:
    """Return a number or a text. Dates and truth values become texts: they are no numbers."""
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return str(getattr(value, "text", value)).strip()


@lru_cache(1024)  # a recording asks again for each output
def read_unit(text: str) -> tuple[Unit, _Powers] | None:
    """Return the unit of a text, and its powers of length, angle, time and force; None for an
    unknown unit.
    """
    if len(text) > _LONGEST:
        return None
    plain = text.strip().lower().replace("²", "^2").replace("³", "^3").replace(" per ", "/")
    plain = plain.replace("_per_", "/")
    name = UNIT_NAMES.get(plain, plain)
    for known, powers in ((LENGTHS, _LENGTH), (ANGLES, _ANGLE)):
        if name in known:
            return known[name], powers
    size, total = Fraction(1), [0, 0, 0, 0]
    for k, part in enumerate(plain.split("/")):
        for factor in filter(None, re.split(r"[ *·.]+", part)):
            found = _FACTOR.fullmatch(factor)
            name = found[1].strip() if found else ""
            name = UNIT_NAMES.get(name, name)
            if found is None or name not in _FACTORS:
                return None
            power = int(found[2] or 1) * (-1 if k else 1)
            number, powers = _FACTORS[name]
            size *= Fraction(repr(number)) ** power
            total = [old + power * new for old, new in zip(total, powers, strict=True)]
        if not part.strip():
            return None
    a, b, c, d = total
    whole = float(size)
    return Unit(text.strip(), whole, lambda x: x * whole), (a, b, c, d)


def split_head(text: str, names: Container[str] = ()) -> tuple[str, str]:
    """Return name and unit of the head of a column, the unit empty if it has none.

    Args:
        names: known names; a head that is one of them has no unit.
    """
    text = text.strip()
    if text in names:
        return text, ""
    if (found := _IN_BRACKETS.fullmatch(text)) and found[1]:
        return found[1], (found[2] if found[2] is not None else found[3]).strip() or "-"
    for between in _BETWEEN.finditer(text):  # from the left: `deg/mm` is longer than `mm`
        name, unit = text[: between.start()], text[between.end() :]
        toe_in = unit.lower() == "in" and name.lower().endswith("toe")
        starts = unit[:1].isalpha() or unit[:1] == "°"
        if name and starts and not toe_in and read_unit(unit) is not None:
            return name, unit
    return text, ""


def unit_of_head(file: Path, where: str, text: str, names: Container[str] = ()) -> tuple[str, str]:
    """Return name and unit of the head of a column that may give its unit twice.

    Raises:
        CaseError: the head gives two units.
    """
    name, unit = split_head(text, names)
    while unit:
        inner, other = split_head(name, names)
        first, second = read_unit(other), read_unit(unit)
        if not other or (first is None and inner not in names):
            break
        if first is None or second is None or first[0].name != second[0].name:
            raise fault(
                file,
                where,
                f"found the column {shown(text)} in {shown(other)} and {shown(unit)}, expected one"
                " unit; correct either",
            )
        name = inner
    return name, unit


def require_unit(file: Path, where: str, column: str, unit: str, si: str) -> Unit:
    """Return the unit of a column, which must measure what an SI unit does.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    expected, found = read_unit(si), read_unit(unit)
    assert expected is not None
    if found is None or found[1] != expected[1]:
        what = _WORDS.get(expected[1], f"a unit such as {si}")
        raise fault(
            file,
            where,
            f"found the unit {shown(unit)} of column {shown(column)}, expected {what}; correct it",
        )
    return found[0]


def is_unit_row(cells: Sequence[object]) -> bool:
    """Return whether most cells are units, as in a row below the heads."""
    texts = [str(cell).strip("[]() ") for cell in cells if cell != ""]
    units = [text for text in texts if text != "1" and read_unit(text) is not None]
    return bool(texts) and 2 * len(units) > len(texts)
