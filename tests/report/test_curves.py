"""Curves of a run as CSV, as Parquet, and on the page."""

import base64
import csv
import io
import json
import re
import sys
import zlib

import pytest
from kincheck.core.cli.main import main
from kincheck.core.harness.record import from_json
from kincheck.core.report import curves
from kincheck.core.report.report import write_report


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curves")
    command = "run rssr planar_slider_crank --engine native".split()
    options = f"--csv {folder / 'curves.csv'} --json {folder / 'results.json'}".split()
    assert main([*command, *options]) == 0
    return folder, from_json((folder / "results.json").read_bytes())


def rows(text):
    return list(csv.DictReader(io.StringIO(text)))


def test_the_csv_has_every_number_of_every_engine_and_reference(made):
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


def test_parquet_has_the_same_table(made, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    folder, results = made
    count = curves.write_curves_parquet(results, tmp_path / "curves.parquet")
    table = parquet.read_table(tmp_path / "curves.parquet").to_pylist()
    found = rows((folder / "curves.csv").read_text())
    assert len(table) == count == len(found)
    shown = [
        {key: "" if value is None else str(value) for key, value in row.items()} for row in table
    ]
    assert shown == found


def test_without_pyarrow_nothing_is_solved(tmp_path, monkeypatch, capsys):
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


def test_the_page_offers_the_curves_of_each_case(made, tmp_path, monkeypatch):
    _, results = made
    write_report(results, file := tmp_path / "page.html")
    page = file.read_text()
    found = offered(page)
    assert 'data-curves="case-0" data-file="rssr.csv"' in " ".join(page.split())
    for anchor, record in zip(found, results.records, strict=True):
        assert {row["case"] for row in rows(found[anchor])} == {record.case}
        assert found[anchor] == curves.csv_of(results, record.case)
    # with room for one case only, the page says where the other curves are
    monkeypatch.setattr(curves, "MOST", len(found["case-0"]) + 1)
    write_report(results, file)
    assert [*offered(file.read_text())] == ["case-0"]
    assert file.read_text().count("too many for this page") == 1
