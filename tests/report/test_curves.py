"""Curves of a run as CSV, as Parquet, and on the page."""

import base64
import csv
import io
import json
import math
import re
import sys
import zlib
from contextlib import redirect_stdout

import pytest
from kincheck import Results
from kincheck.core.cli.main import main
from kincheck.core.harness.record import from_json
from kincheck.core.report import curves
from kincheck.core.report.report import write_report

from ..support import strut_results
from ..support.strut_results import GRID


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curves")
    command = "run rssr planar_slider_crank --engine native".split()
    options = f"--csv {folder / 'curves.csv'} --json {folder / 'results.json'}".split()
    assert main([*command, *options]) == 0
    return folder, from_json((folder / "results.json").read_bytes())


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_csv_has_every_number(made):
    folder, results = made
    found = rows((folder / "curves.csv").read_text())
    assert [*found[0]] == [*curves.COLUMNS]
    for record in results.records:
        known = {"native": record.outputs, "reference": results.references[record.case]}
        for engine, outputs in known.items():
            for name, series in outputs.items():
                mine = [
                    row
                    for row in found
                    if (row["case"], row["engine"], row["output"]) == (record.case, engine, name)
                ]
                assert [int(row["sample"]) for row in mine] == [*range(record.samples)]
                assert {row["unit"] for row in mine} == {series.unit}
                (values,) = record.driver.values()
                assert [float(row["driver_value"]) for row in mine] == values
                assert {row["driver_unit"] for row in mine} == {"rad"}
                for motion in ("position", "velocity", "acceleration"):
                    numbers = getattr(series, motion) or [None] * len(values)
                    assert [row[motion] for row in mine] == [
                        "" if number is None else repr(number) for number in numbers
                    ]


def test_parquet_equals_csv(made, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder, results = made
    count = curves.write_curves(results, tmp_path / "curves.parquet", "parquet", long=False)
    table = parquet.read_table(tmp_path / "curves.parquet").to_pylist()
    found = rows((folder / "curves.csv").read_text())
    assert len(table) == count == len(found)
    shown = [
        {key: "" if value is None else str(value) for key, value in row.items()} for row in table
    ]
    assert shown == found


def test_missing_pyarrow_stops_before_solving(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    file = tmp_path / "curves.parquet"
    assert main(f"run rssr --engine native --parquet {file}".split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(
        f"--parquet {file}: Parquet needs pyarrow, which is not installed: pip install"
        " 'pyarrow>=17'; or give --csv FILE"
    )
    assert not file.exists()


def offered(page):
    packed = re.search(r'id="curves">([^<]*)<', page)[1]
    return json.loads(zlib.decompress(base64.b64decode(packed)))


def test_page_offers_curves_per_case(made, tmp_path):
    _, results = made
    write_report(results, file := tmp_path / "page.html")
    page = file.read_text()
    found = offered(page)
    assert 'data-curves="case-0" data-file="rssr.csv"' in " ".join(page.split())
    for anchor, record in zip(found, results.records, strict=True):
        assert {row["case"] for row in rows(found[anchor])} == {record.case}
        assert found[anchor] == curves.csv_of(results, record.case)


def test_page_leaves_large_curves_out(tmp_path):
    grids = {"small": GRID, "large": [0.01 * k for k in range(20_000)]}
    records = [
        strut_results.record(case, "closed_form", "one", 0.0, grid) for case, grid in grids.items()
    ]
    write_report(Results(run={}, records=records), file := tmp_path / "page.html")
    assert [*offered(file.read_text())] == ["case-0"]
    assert file.read_text().count("too many for this page") == 1


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Return a table of hardpoints in mm, without a reference."""
    file = tmp_path_factory.mktemp("table") / "car.csv"
    with file.open("w") as text, redirect_stdout(text):
        assert main(["templates", "mcpherson"]) == 0
    return file


@pytest.mark.needs("hardpoints")
def test_table_curves_have_file_units(table, tmp_path):
    wide, long, book = (tmp_path / name for name in ("wide.csv", "long.csv", "wide.xlsx"))
    command = ["run", str(table), "--engine", "native"]
    assert main([*command, "--csv", str(wide), "--xlsx", str(book)]) == 2  # nothing to compare
    assert main([*command, "--csv", str(long), "--long"]) == 2
    found, si = rows(wide.read_text()), rows(long.read_text())
    assert len(found) == len({row["sample"] for row in si})
    scales = {"m": ("mm", 1e3), "rad": ("deg", 180 / math.pi), "rad/m": ("deg/m", 180 / math.pi)}
    scales |= {"m/m": ("mm/m", 1e3)}
    for row in si:
        unit, scale = scales.get(row["unit"], (row["unit"], 1.0))
        head = row["output"] if unit == "1" else f"{row['output']} [{unit}]"
        mine = found[int(row["sample"])]
        assert float(mine[head]) == pytest.approx(scale * float(row["position"]), rel=1e-14)
        assert float(mine["stroke [mm]"]) == pytest.approx(1e3 * float(row["driver_value"]))
    openpyxl = pytest.importorskip("openpyxl")
    cells = [*openpyxl.load_workbook(book).active.values]
    assert [*cells[0]] == [*found[0]]
    numbers = [[float(each) for each in row.values()] for row in found]
    for row, expected in zip(cells[1:], numbers, strict=True):
        assert row == pytest.approx(expected, rel=1e-15)  # workbooks keep 16 digits


@pytest.mark.needs("hardpoints")
def test_wide_curves_name_engines_and_references(table, tmp_path):
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    main(["run", str(table), "--engine", "native", "--csv", str(first)])
    command = ["run", str(table), "--reference", str(first), "--at-reference", "--engine", "native"]
    assert main([*command, "--csv", str(second)]) == 0  # a wide table is a measured curve
    found = rows(second.read_text())
    assert {row["engine"] for row in found} == {"reference", "native"}
    toes = {row["engine"]: row["toe [deg]"] for row in found}
    assert float(toes["native"]) == pytest.approx(float(toes["reference"]), abs=1e-12)


@pytest.mark.needs("hardpoints")
def test_table_prints_rebound_design_and_jounce(table, capsys):
    main(["run", str(table), "--engine", "native"])
    printed = capsys.readouterr().out
    for text in ("rebound", "jounce", "\N{MINUS SIGN}50 mm", "toe [°]", "°/m"):
        assert text in printed
