"""What takes too long to read is refused before it is read; by the work done, never by a clock."""

import io
import zipfile
from collections import Counter

import pytest
from kincheck import Supplied
from kincheck.core.case.io import table
from kincheck.core.case.io.foreign import MOST_MEMBERS
from kincheck.core.case.io.reference_samples import read_table, samples_of

from ..support.case_texts import complains, refused, write

openpyxl = pytest.importorskip("openpyxl")
HEAD = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
END = b"</sheetData></worksheet>"
SHEET, STYLES = "xl/worksheets/sheet1.xml", "xl/styles.xml"
ONE = b'<row r="1"><c r="A1"><v>1</v></c></row>'


def book(folder, part, content, more=0):
    """Return a workbook with another content of a part, and with more empty parts."""
    made = openpyxl.Workbook()
    made.active.append(["name", "x"])
    made.save(plain := io.BytesIO())
    file = folder / "table.xlsx"
    with zipfile.ZipFile(plain) as old, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as new:
        for each in old.infolist():
            new.writestr(each.filename, content if each.filename == part else old.read(each))
        for k in range(more):
            new.writestr(f"xl/{k}", b"")
    return file


def refused_table(file, said):
    refused(lambda: samples_of(read_table(file, None, "sheet")), said)


TOO_MUCH = {
    "a row of many cells": (
        SHEET,
        HEAD + b"<row>" + b"<c/>" * table.MOST_TAGS + b"</row>" + END,
        f"tags in {SHEET}, expected {table.MOST_TAGS} at most",
    ),
    "many styles": (
        STYLES,
        b"<styleSheet>" + b"<xf/>" * table.MOST_TAGS_ELSEWHERE + b"</styleSheet>",
        f"tags in {STYLES}, expected {table.MOST_TAGS_ELSEWHERE} at most",
    ),
    "a bomb": (STYLES, bytes(table.MOST_BYTES), f"expected {table.MOST_BYTES} at most"),
}


@pytest.mark.parametrize(("part", "content", "said"), TOO_MUCH.values(), ids=TOO_MUCH)
def test_oversized_workbook_is_not_opened(part, content, said, tmp_path, monkeypatch):
    file = book(tmp_path, part, content)
    assert file.stat().st_size < 1_000_000
    monkeypatch.setattr(openpyxl, "load_workbook", lambda *_: pytest.fail("it is opened"))
    refused_table(file, said)


def test_archive_of_many_parts_is_refused(tmp_path, monkeypatch):
    file = book(tmp_path, "", b"", MOST_MEMBERS)
    monkeypatch.setattr(zipfile, "ZipFile", lambda *_: pytest.fail("it is opened"))
    refused_table(file, f"parts, expected {MOST_MEMBERS} at most")


GAPS = {
    "a row far below": (b'<row r="99999999999"><c r="A9"><v>1</v></c></row>', "rows, blank ones"),
    "cells far on the right": (
        b"".join(b'<row r="%d"><c r="XFD%d"/></row>' % (k, k) for k in range(2, 500)),
        "cells, blank ones",
    ),
}


@pytest.fixture
def fewer_rows(monkeypatch):
    monkeypatch.setattr(table, "MOST_ROWS", 10_000)


@pytest.mark.parametrize(("rows", "said"), GAPS.values(), ids=GAPS)
def test_blank_rows_and_cells_are_counted(rows, said, tmp_path, monkeypatch, fewer_rows):
    """openpyxl makes them up: a row for each number, and a cell for each column."""
    read = Counter[str]()
    sheet = openpyxl.worksheet._read_only.ReadOnlyWorksheet
    own = sheet._cells_by_row

    def counting(self, *args, **options):
        for row in own(self, *args, **options):
            read.update(rows=1, cells=len(row))
            yield row

    monkeypatch.setattr(sheet, "_cells_by_row", counting)
    refused_table(book(tmp_path, SHEET, HEAD + ONE + rows + END), said)
    assert read["rows"] <= table.MOST_ROWS + 1
    assert read["cells"] <= table.MOST_CELLS + 16_384


def test_sheet_with_gap_is_read(tmp_path, fewer_rows):
    last = f'<row r="{table.MOST_ROWS}"><c r="A1"><v>2</v></c></row>'.encode()
    (sheet,) = table.read_sheets(book(tmp_path, SHEET, HEAD + ONE + last + END), None, 10)
    assert [row for _, row in sheet.sheet] == [[1.0], [2.0]]


@pytest.mark.needs("hardpoints")
def test_table_of_many_columns_is_refused(tmp_path):
    file = write(tmp_path, "a,b\n1" + "," * table.MOST_COLUMNS_OF_TEXT, "table.csv")
    said = f"line 2: found more than {table.MOST_COLUMNS_OF_TEXT} columns"
    refused_table(file, said)
    complains(file, said, Supplied(template="mcpherson"))
