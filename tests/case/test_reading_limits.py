"""What takes too long to read is refused before it is read; by the work done, never by a clock."""

import io
import zipfile
from collections import Counter

import pytest
from kincheck.core.algebra import Vec3
from kincheck.core.case.io import table
from kincheck.core.case.io.foreign import MOST_MEMBERS
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.io.reference_samples import read_table, samples_of
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.rows import MOST_LINES
from kincheck.core.extensions.trees import tree
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.extensions.xml import element
from kincheck.core.extensions.xml.element import DEEPEST, parse_xml

from ..support.case_texts import complains, refused, write
from ..support.model_files import driven

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
    with (
        zipfile.ZipFile(plain) as old,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as new,
    ):
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
    "a bomb": (
        STYLES,
        bytes(table.MOST_BYTES),
        f"expected {table.MOST_BYTES} at most",
    ),
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


def test_table_of_many_columns_is_refused(tmp_path):
    file = write(tmp_path, "a,b\n1" + "," * table.MOST_COLUMNS_OF_TEXT, "table.csv")
    said = f"line 2: found more than {table.MOST_COLUMNS_OF_TEXT} columns"
    refused_table(file, said)
    complains(file, said, Supplied(template="mcpherson"))


def test_table_of_many_lines_is_refused(tmp_path):
    file = write(tmp_path, "a 1 2 3\n" * (MOST_LINES + 1), "table.dat")
    complains(file, f"found {MOST_LINES + 1} lines", Supplied())


def test_xml_elements_up_to_limit(tmp_path, monkeypatch):
    """The first one beyond it is named; there is one on each line."""
    monkeypatch.setattr(element, "MOST_ELEMENTS", most := 100)
    text = "<a>\n" + "<b/>\n" * most + "</a>"
    file = tmp_path / "model.xml"
    refused(lambda: parse_xml(file, text), f"line {most + 1}: <b>: found more than")
    fewer = text.replace("<b/>\n", "", 1)
    assert len(parse_xml(file, fewer).children) == most - 1


BODIES = """<mujoco><worldbody><body name="a"><joint name="j"/></body><body name="b"><joint/></body>
</worldbody>"""
LINKS = """<robot name="r"><link name="a"/><link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>"""
TIES = {
    "equalities.xml": (
        BODIES + "<equality>\n{}</equality></mujoco>",
        '<connect body1="a" body2="b" anchor="0 0 0"/>\n',
    ),
    "constraints.urdf": (
        LINKS + "\n{}</robot>",
        '<constraint type="ball"><parent link="a"/><child link="b"/></constraint>\n',
    ),
}


@pytest.mark.parametrize("name", TIES)
def test_closures_up_to_limit(name, tmp_path, monkeypatch):
    monkeypatch.setattr(tree, "MOST_TIES", most := 60)
    text, tie = TIES[name]
    file = write(tmp_path, text.format(tie * (most + 1)), name)
    complains(file, f"line {most + 3}:  ... found more than", driven("j:0:1"))


def test_long_chain_of_fixed_links(tmp_path):
    base = LINKS.replace('"b"', '"l-1"')
    chain = "".join(
        f'<link name="l{k}"/><joint name="f{k}" type="fixed"><parent link="l{k - 1}"/>'
        f'<child link="l{k}"/></joint>'
        for k in range(2 * DEEPEST)
    )
    file = write(tmp_path, f"{base}{chain}</robot>", "chain.urdf")
    case = load(file, driven("j:0:1"))
    assert case.mechanism.point(f"l{2 * DEEPEST - 1}").body == "l-1"


def test_deeply_nested_mjcf_bodies(tmp_path):
    """Deeper than Python recurses."""
    deep = '<body pos="1 0 0"><frame><joint axis="0 0 1"/>'
    file = tmp_path / "deep.xml"
    file.write_text(
        f"<mujoco><include file='more.xml'/><worldbody>{deep * 1200}<site name='tip'/>"
        f"{'</frame></body>' * 1200}</worldbody></mujoco>"
    )
    (tmp_path / "more.xml").write_text("<mujocoinclude><option/></mujocoinclude>")
    found = read_tree(file, ["option"])
    assert len(found.moves) == 1200
    assert found.sites["tip"][1].at == Vec3(1200.0, 0.0, 0.0)


def test_many_linkages_of_few_digits(tmp_path):
    """Rows that are redundant but for digits are those of each linkage alone."""
    bars = "".join(
        f'<body name="c{k}" pos="{k} 0 0"><joint name="j{k}" axis="0 1 0"/><body name="r{k}"'
        f' pos="0 0 0.3"><joint axis="0.000001 1 0"/></body></body><body name="f{k}"'
        f' pos="{k + 0.4} 0 0"><joint axis="0 1 0.000001"/></body>'
        for k in range(52)
    )
    ties = "".join(
        f'<connect body1="r{k}" body2="f{k}" anchor="0.312345 0 0.212345"/>' for k in range(52)
    )
    file = tmp_path / "scene.xml"
    file.write_text(f"<mujoco><worldbody>{bars}</worldbody><equality>{ties}</equality></mujoco>")
    hold = tuple(f"j{k}" for k in range(1, 52))
    case = load(file, driven("j0:0:0.1:2", hold=hold))
    assert len(case.mechanism.drivers) == 52
    assert len(case.mechanism.reduced) == 52


def test_spring_tendon_without_length_left_out(tmp_path):
    """A tendon between sites in one place has no direction."""
    text = BODIES.replace("<joint/>", '<joint/><site name="t"/>').replace(
        '<joint name="j"/>', '<joint name="j"/><site name="s"/>'
    )
    spring = '<tendon><spatial stiffness="1"><site site="s"/><site site="t"/></spatial></tendon>'
    file = tmp_path / "model.xml"
    file.write_text(f"{text}{spring}</mujoco>")
    case = load(file, driven("j:0:1", hold_rest=True))
    assert "tendon: spatial (1)" in case.source
