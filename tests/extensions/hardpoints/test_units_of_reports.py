"""Reports on hardpoint tables give errors and tolerances in the units of the table."""

import csv
import json
import re

import pytest
from kincheck.core.cli.main import main
from kincheck.core.harness.record import from_json
from kincheck.core.report.junit import to_junit

from ...support.printed import junit_messages

RUN = "run dw.csv --engine native --jobs 0 --travel 50mm:5"
TURNED, RAISED = 0.05, 1.5
"""What the measured curve is off by [deg, mm]."""


@pytest.fixture
def folder(tmp_path, monkeypatch, capsys):
    """A table, and a curve whose toe and roll centre are off."""
    monkeypatch.chdir(tmp_path)
    assert main(["templates", "double_wishbone"]) == 0
    (tmp_path / "dw.csv").write_text(capsys.readouterr().out)
    main([*RUN.split(), "--csv", "curves.csv"])
    with open("curves.csv") as file:
        rows = [*csv.DictReader(file)]
    off = {"stroke [mm]": 0.0, "toe [deg]": TURNED, "roll_center_height [mm]": RAISED}
    with open("measured.csv", "w") as file:
        written = csv.DictWriter(file, off)
        written.writeheader()
        written.writerows({n: float(row[n]) + x for n, x in off.items()} for row in rows)
    capsys.readouterr()
    return tmp_path


@pytest.mark.needs("measured", "suspects")
def test_run_tells_units_of_table(folder, capsys):
    words = "--reference measured.csv --out . --verbose"
    assert main([*RUN.split(), *words.split()]) == 1
    shown = capsys.readouterr().out
    results = from_json((folder / "results.json").read_bytes())
    (record,) = results.records
    assert "roll_center_height: position is off by 1.5 mm at sample" in record.message
    assert re.search(r"\(stroke = -?\d+ mm\), tolerance \S+ mm, against", record.message)
    assert "the reference minus 0.05° fits" in results.suspects["dw"].message
    assert re.search(r"toe +5\.0e-02 of \S+ .*°", shown)
    assert re.search(r"roll_center_height +1\.5e\+00 of \S+ .*mm", shown)
    assert any(
        "toe: position is off by 0.05° at" in x
        for x in junit_messages(to_junit(results), "failure")
    )
    page = (folder / "report.html").read_text("utf-8")
    assert "Worst 0.05°: native" in page
    assert "Worst 1.5 mm: native" in page
    assert not re.search(r"\d rad\b", shown + page)
    # numbers in the JSON are in SI
    assert record.errors["roll_center_height"].position.max_abs == pytest.approx(1e-3 * RAISED)


def test_report_tells_units_of_table(folder, capsys):
    kept = [*RUN.split(), "--history", "h.sqlite"]
    main(kept)
    text = (folder / "dw.csv").read_text()
    moved = re.sub(r"^(tierod_inner,.*?,.*?,)[^,]*", r"\g<1>225", text, flags=re.M)
    (folder / "dw.csv").write_text(moved)
    main(kept)
    capsys.readouterr()
    assert main(["report", "--history", "h.sqlite", "--json", "r.json"]) == 1
    shown = capsys.readouterr().out
    found = json.loads((folder / "r.json").read_text())["findings"]
    assert any(re.search(r"toe position differs by up to \S+° from", x["message"]) for x in found)
    assert not re.search(r"\d rad\b", shown)


@pytest.mark.needs("measured")
def test_citation_is_asked_by_option(folder, capsys):
    main([*RUN.split(), "--reference", "measured.csv"])
    assert "measured.csv does not say where it comes from" in (out := capsys.readouterr().out)
    assert "add --citation" in out
    assert "[reference]" not in out
