"""The command that measures curves."""

import json

import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table


def test_bench_of_curves_tells_ratio(tmp_path, capsys, monkeypatch):
    for name, number in (("DESIGNS", 8), ("PROCESSES", 1)):
        monkeypatch.setattr(f"kincheck.core.extensions.laboratory.bench.curves.{name}", number)
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["semi_trailing_arm"]))
    assert main(f"bench curves {file} --rounds 1 --json {file}.json".split()) == 0
    assert capsys.readouterr().out.count("goal: at most") == 6
    found = json.loads((tmp_path / "car.csv.json").read_text())
    assert (found["designs"], found["samples"], found["places"]) == (8, 41, 18)
    own, alone = (found[f"us_per_sample_of_{each}"]["least"] for each in ("outputs", "points"))
    assert found["ratio"] == pytest.approx(own / alone)
    assert found["ms_of_live"]["least"] > 0.0


def test_bench_without_table_is_refused(capsys):
    assert main("bench curves rssr --rounds 1".split()) == 2
    assert "Give a table of hardpoints" in capsys.readouterr().err
