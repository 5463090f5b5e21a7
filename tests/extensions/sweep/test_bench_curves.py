"""The command that measures curves."""

import json

import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.laboratory.bench.curves import lines
from kincheck.core.extensions.laboratory.bench.rounds import spread


def test_bench_of_curves_tells_ratio(tmp_path, capsys, monkeypatch):
    for name, number in (("DESIGNS", 8), ("PROCESSES", 1)):
        monkeypatch.setattr(f"kincheck.core.extensions.laboratory.bench.curves.{name}", number)
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["semi_trailing_arm"]))
    assert main(f"bench curves {file} --rounds 1 --json -".split()) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["designs"], found["samples"], found["places"]) == (8, 41, 18)
    own, alone = (found[f"us_per_sample_of_{each}"]["least"] for each in ("outputs", "points"))
    assert found["ratio"] == pytest.approx(own / alone)
    for each in ("motion", "outputs", "new_numbers"):
        assert found[f"s_of_first_{each}"]["least"] > 0.0
    assert found["ms_of_live"]["least"] > 0.0


def test_bench_of_curves_names_every_goal():
    each = spread([1.0])
    keys = ["us_per_sample_of_points", "us_per_sample_of_outputs", "us_per_sample_of_sweep"]
    found = dict.fromkeys([*keys, "ms_of_slopes", "ms_of_live"], each)
    found |= dict.fromkeys(("case", "designs", "samples", "outputs", "places"), 1)
    found |= {f"s_of_first_{name}": each for name in ("motion", "outputs", "new_numbers")}
    for axle, most in ((False, "2.0"), (True, "2.5")):
        text = "\n".join(lines(found | {"axle": axle, "ratio": 1.0}))
        assert text.count("goal: at most") == 6
        assert f"times the points (goal: at most {most})" in text


def test_bench_without_table_is_refused(capsys):
    assert main("bench curves rssr --rounds 1".split()) == 2
    assert "Give a table of hardpoints" in capsys.readouterr().err
