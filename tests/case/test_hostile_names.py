"""Names and messages made to harm, in every kind of report: they are shown, and nothing obeys
them.
"""

import csv
import io
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import pytest
from kincheck import Outcome, Results
from kincheck.core.case.io.document import fault
from kincheck.core.case.io.escape import cell, file_name, visible
from kincheck.core.case.io.table_file import Kind, write_csv
from kincheck.core.harness.record import to_json
from kincheck.core.report.junit import to_junit
from kincheck.core.report.page_model import Material
from kincheck.core.report.progress import complain, progress
from kincheck.core.report.report import render
from kincheck.core.report.table import print_matrix, print_table, to_markdown
from markdown_it import MarkdownIt

from ..report.page import Page
from ..support.fakes import crank
from ..support.strut_results import results

NAMES = {
    "terminal": "\x1b[31m\x1b]0;title\x07\x9b2J",
    "backwards": "\u202egnihton",
    "mark-up of rich": "[red]a[/red][/][link=https://example.org]b",
    "HTML": "<img src=https://example.org/x.png onerror=alert(1)><script>alert(1)</script>",
    "links": "[a](https://example.org) ![b](https://example.org/x.png) <https://example.org>",
    "columns": "a|b|c`|`d",
    "lines": "a\n\n# b\n\n| c |\n<b>",
    "emphasis": "*a* **b** `c` ~~d~~ \\",
    "nulls": "a\x00b\x08c",
    "undecodable": "a\udcffb",
    "formula": '=HYPERLINK("https://example.org"&A1)',
    "people": "@everyone",
}


@pytest.fixture(params=NAMES)
def name(request):
    return NAMES[request.param]


def run(name):
    """Everything that is a name or a message is called so."""

    def renamed(record, **changes):
        (output, *_), (error, *_) = record.outputs.values(), record.errors.values()
        texts = dict.fromkeys(("case", "engine", "version", "message", "loop"), name)
        quantities = {
            "outputs": {name: msgspec.structs.replace(output, unit=name, sense=name, reason=name)},
            "errors": {name: msgspec.structs.replace(error, reason=name)},
            "driver": {name: [*range(21)]},
            "settings": {name: name},
        }
        return msgspec.structs.replace(record, **quantities | texts | changes)

    made = results()
    records = [
        renamed(made.records[0]),
        renamed(made.records[1], mode="simulate"),
        renamed(
            made.records[1], engine="other", outcome=Outcome.ERROR, mode=name, outputs={}, errors={}
        ),
    ]
    about = {"source": name, "signs": name, "driver": {"name": name, "type": name, "point": name}}
    return Results(run={"cases": {name: about}, name: name, "command": name}, records=records)


@pytest.mark.parametrize("show", [print_table, print_matrix])
def test_hostile_name_in_terminal_table(name, show):
    show(run(name), text := io.StringIO())
    said = text.getvalue()
    assert all(line.isprintable() for line in said.replace("\t", " ").split("\n"))
    said.encode()
    if name.isprintable():
        assert name in said


def test_hostile_name_in_messages(name, capsys, tmp_path):
    file = tmp_path / f"{name.replace('/', '')}.toml"
    complain([str(fault(file, name, "found nothing, expected something; add it")), name])
    progress([])(run(name).records[0], 1, 2)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert all(line.isprintable() for line in lines)


def test_hostile_name_in_markdown(name):
    text = to_markdown(run(name))
    text.encode()
    tokens = MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(text)
    kinds = [token.type for token in tokens]
    assert kinds.count("table_open") == 1
    table = kinds[kinds.index("table_open") : kinds.index("table_close")]
    assert table.count("td_open") == 3  # one case in two engines
    inside = [child for token in tokens for child in token.children or ()]
    assert {child.type for child in inside} <= {"text", "code_inline", "softbreak"}
    assert not {
        "html_block",
        "heading_open",
        "fence",
        "code_block",
        "blockquote_open",
        "bullet_list_open",
    } & {*kinds}
    assert "@everyone" not in text.replace("`@everyone`", "")  # code notifies nobody
    if name.isprintable() and "`" not in name and "@" not in name:
        shown = "".join(child.content for child in inside)
        assert shown.count(name) >= 3


def test_hostile_name_in_junit(name):
    root = ElementTree.fromstring(to_junit(run(name)))
    assert {element.tag for element in root.iter()} <= {
        "testsuites",
        "testsuite",
        "testcase",
        "failure",
        "error",
        "skipped",
        "system-out",
    }
    if name.isprintable():
        assert root[0].get("name") == name


@cache
def plain_page():
    return Page(render(Material(run("name"), {}, {})))


def test_hostile_name_in_page(name):
    text = render(Material(run(name), {}, {}))
    page, plain = Page(text), plain_page()
    assert sorted(tag for tag, _ in page.tags) == sorted(tag for tag, _ in plain.tags)
    assert page.names == plain.names
    assert {key for _, attrs in page.tags for key in attrs} == {
        key for _, attrs in plain.tags for key in attrs
    }
    # the titles of figures have the name: the scripts write text nodes
    assert re.findall(r"(inner|outer)HTML *=|insertAdjacentHTML|document\.write", text) == []


def test_hostile_name_in_json(name):
    # UTF-8 cannot hold it; circumstances and messages are cleaned where they are made
    if name != NAMES["undecodable"]:
        assert msgspec.json.decode(to_json(run(name)), type=Results) == run(name)


def test_hostile_name_in_csv(name, tmp_path):
    write_csv(file := tmp_path / "a.csv", {"head": Kind.TEXT}, [[[name]]])
    _, row = csv.reader(file.read_text().splitlines())
    assert len(row) == 1
    assert row[0][:1] not in ("=", "+", "-", "@", "\t", "\r")
    assert row[0].isprintable()


def test_csv_cell_of_number_and_formula():
    plain = [-1.5, None, 3, "a-b", ""]
    assert [*map(cell, plain)] == plain
    assert [*map(cell, ("=1+1", "-1", "+a", "@b"))] == ["'=1+1", "'-1", "'+a", "'@b"]
    assert cell("\t=1") == "'\\t=1"


def test_visible_keeps_printable_text():
    assert visible("é α 漢 ² |<>") == "é α 漢 ² |<>"
    assert visible("a\nb\tc\x1b", also="\n") == "a\nb\\tc\\x1b"
    assert visible("\u202e\udcff\U000e0001") == "\\u202e\\udcff\\U000e0001"


@pytest.mark.parametrize(
    "name", [*NAMES.values(), "../escaped", "/tmp/escaped", "..", "a\\b", "C:a"]
)
def test_file_name_stays_in_folder(name, tmp_path):
    file = tmp_path / f"{file_name(name)}.reference.json"
    assert file.resolve().parent == tmp_path.resolve()
    assert not re.search(r"[/\\:]", file_name(name))


@pytest.mark.needs("proofs")
def test_written_reference_stays_in_folder(kincheck_main, tmp_path):
    pytest.importorskip("flint")
    (tmp_path / "proofs").mkdir()
    case = replace(crank(reference=False), name="../escaped")
    options = "--digits", 20, "--out", tmp_path / "proofs"
    assert kincheck_main("reference", "crank", *options, cases={"crank": case}) == 0
    assert [each.relative_to(tmp_path) for each in tmp_path.rglob("*.json")] == [
        Path("proofs/.._escaped.reference.json")
    ]


@pytest.mark.needs("proofs")
def test_two_references_of_one_file(kincheck_main, tmp_path, capsys):
    cases = {name: replace(crank(reference=False), name=name) for name in ("a/b", "a:b")}
    assert kincheck_main("reference", *cases, "--out", tmp_path, cases=cases) == 2
    told = "a_b.reference.json: found the file of a/b, expected one of its own"
    assert told in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
