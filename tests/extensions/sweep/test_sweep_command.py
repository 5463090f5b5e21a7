"""kincheck sweep on the command line: its files, and a study that goes on."""

import csv
import importlib
import json
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from kincheck.cases import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.sweep.page import page
from kincheck.core.extensions.sweep.study import Ready
from kincheck.core.extensions.sweep.sweep import sweep_designs

from ...support.fakes import crank
from ...support.variations import vary, vary_file
from .test_sweep_study import TIP

POINTS = {
    "ball": {"at": "ball", "sigma": 1.0},
    "rod": {"at": "joints.tie_rod.points.0", "half_width": [1.0, 0, 2.0]},
}


@pytest.fixture
def file(tmp_path):
    return vary_file(tmp_path, POINTS)


def read(path: Path):
    with path.open() as lines:
        return list(csv.DictReader(lines))


def test_sweep_writes_all_its_files(file, tmp_path, capsys):
    out, stored = tmp_path / "out", tmp_path / "all.parquet"
    arguments = f"sweep mcpherson_strut --vary {file} --samples 600 --seed 3 --jobs 2".split()
    assert (
        main([*arguments, "--out", str(out), "--store", str(stored), "--check", "native:0.01"]) == 0
    )
    told = capsys.readouterr().out
    assert (
        "600 variants of mcpherson_strut, all solved; 6 checked with native, none deviates" in told
    )
    found = json.loads((out / "sweep.json").read_text())
    assert (found["schema"], found["samples"], found["seed"], found["unsolved"]) == (
        "kincheck-sweep/1",
        600,
        3,
        0,
    )
    assert [each["name"] for each in found["coordinates"]] == [
        "ball.x",
        "ball.y",
        "ball.z",
        "rod.x",
        "rod.z",
    ]
    assert len(found["checked"]) == 6
    assert found["run"]["command"].startswith("kincheck sweep mcpherson_strut --vary")

    envelope = found["outputs"]["half_track_change"]
    rows = [each for each in read(out / "envelope.csv") if each["output"] == "half_track_change"]
    # the table is in the units of the file, the results are in SI
    assert {(each["unit"], each["driver_unit"]) for each in rows} == {("mm", "mm")}
    for column, expected in (
        ("stroke", found["driver"]["stroke"]),
        *((name, envelope[name]) for name in ("min", "max", "mean", "standard_deviation")),
        ("nominal", envelope["nominal"]),
        ("quantile_0.95", envelope["quantiles"]["0.95"]),
    ):
        values = [float(each[column]) for each in rows]
        np.testing.assert_allclose(values, 1e3 * np.array(expected), rtol=1e-15)
    slopes = read(out / "gradients.csv")
    assert [each["coordinate"] for each in slopes[:5]] == [
        each["name"] for each in found["coordinates"]
    ]
    assert [float(each["largest"]) for each in slopes] == [
        each["largest"] for each in found["gradients"]
    ]

    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(stored)
    values = np.array(table["half_track_change"].to_pylist())
    np.testing.assert_array_equal(table["variant"].to_numpy(), np.arange(600))
    np.testing.assert_allclose(values.min(axis=0), envelope["min"], rtol=0)
    np.testing.assert_allclose(values.mean(axis=0), envelope["mean"], rtol=0, atol=1e-16)
    np.testing.assert_allclose(
        np.quantile(values, 0.05, axis=0), envelope["quantiles"]["0.05"], rtol=0, atol=1e-16
    )
    assert np.abs(table["rod.x"].to_numpy()).max() <= 1e-3
    about = json.loads(table.schema.metadata[b"kincheck"])
    assert (about["seed"], about["units"]["rod.x"], about["units"]["half_track_change"]) == (
        3,
        "m",
        "m",
    )


def test_sweep_page_is_complete_and_escaped(file, tmp_path):
    case = load("mcpherson_strut")
    found = sweep_designs(
        case, vary(tmp_path, case, **POINTS), samples=20, command="<script>alert(1)</script>"
    )
    text = page(found)
    assert "<h1>20 variants of mcpherson_strut, all solved</h1>" in text
    assert "<script>alert" not in text
    assert text.count('class="plot"') == 8  # envelope, spread, histogram, effects
    assert all(
        name in text for name in ("half-track change", "wheel-base change", "ball.z", "rod.x")
    )
    # nothing is loaded: scripts name the namespace of SVG alone
    addresses = set(re.findall(r"https?://[^\s\"'<>]*", text))
    assert addresses <= {"http://www.w3.org/2000/svg"}


def test_sweep_json_to_standard_output(file, capsys):
    options = f"--vary {file} --samples 5 --output wheelbase_change --json -"
    assert main(["sweep", "mcpherson_strut", *options.split()]) == 0
    output = capsys.readouterr()
    assert list(json.loads(output.out)["outputs"]) == ["wheelbase_change"]
    assert "5 variants of mcpherson_strut" in output.err


def test_unsolved_variants_give_status_1(tmp_path, capsys):
    path = vary_file(tmp_path, {"rod": {"at": "joints.rod.length", "half_width": 3500.0}})
    assert main(f"sweep rssr --vary {path} --samples 30 --out {tmp_path / 'out'}".split()) == 1
    told = capsys.readouterr().out
    assert re.search(r"30 variants of rssr, \d+ without a solution somewhere", told)
    assert re.search(
        r"unsolved: variant \d+, \d+ samples: cannot be followed beyond crank = ", told
    )
    assert "Variants without a solution" in (tmp_path / "out" / "sweep.html").read_text()


def test_store_without_pyarrow_is_refused(file, tmp_path, capsys, monkeypatch):
    real = importlib.import_module

    def without(name, *rest):
        if name.startswith("pyarrow"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", without)
    stored = tmp_path / "x.parquet"
    assert main(f"sweep mcpherson_strut --vary {file} --samples 5 --store {stored}".split()) == 2
    assert "pip install 'pyarrow>=" in capsys.readouterr().err
    assert not os.path.exists(stored)


def test_sweep_files_survive_closed_output(file, tmp_path, monkeypatch):
    def gone(*_):
        raise BrokenPipeError

    monkeypatch.setattr("kincheck.core.extensions.sweep.tables.print_sweep", gone)
    out, wanted = tmp_path / "out", tmp_path / "found.json"
    arguments = (
        f"sweep mcpherson_strut --vary {file} --samples 20 --out {out} --json {wanted}".split()
    )
    kept = os.dup(1)
    try:
        main(arguments)
    finally:
        os.dup2(kept, 1)
        os.close(kept)
    assert wanted.read_bytes() == (out / "sweep.json").read_bytes()


def test_stored_hardpoint_named_like_output(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    stored = tmp_path / "all.parquet"
    for name in ("rocker_tip_y", "variant"):
        file = vary_file(tmp_path, {name: {"at": "joints.rod.length", "half_width": 1.0}})
        assert main(f"sweep rssr --vary {file} --samples 20 --store {stored}".split()) == 0
        table = parquet.read_table(stored)
        assert table.column_names[:2] == ["variant", f"{name}.offset"]
        assert table.column_names.count("rocker_tip_y") == 1
        offsets, values = (
            table[f"{name}.offset"].to_numpy(),
            np.array(table["rocker_tip_y"].to_pylist()),
        )
        assert 0.0 < np.abs(offsets).max() <= 1e-3
        assert values.shape == (20, 181)
        units = json.loads(table.schema.metadata[b"kincheck"])["units"]
        assert (units[f"{name}.offset"], units["rocker_tip_y"]) == ("m", "m")


# A sweep that is stopped writes its finished part and says so; taken up, it has the same bits as


POINTS_RESUME = {"ball": {"at": "ball", "sigma": 1.0}}
VARIANTS, CHUNK = 256, 64
CHECK = ("--check", "native:0.01")


@pytest.fixture(scope="module")
def arguments(tmp_path_factory):
    file = vary_file(tmp_path_factory.mktemp("study"), POINTS_RESUME)
    return f"sweep mcpherson_strut --vary {file} --samples {VARIANTS} --seed 3 --jobs 1".split()


@pytest.fixture(scope="module")
def whole(arguments, tmp_path_factory):
    """The results of a sweep that was never stopped, and of one with a check."""
    folders = []
    for check in ((), CHECK):
        folders.append(tmp_path_factory.mktemp("whole"))
        assert main([*arguments, "--out", str(folders[-1]), *check]) == 0
        assert not (folders[-1] / "sweep.part").exists()
    return folders


@pytest.fixture(scope="module")
def stopped(arguments, tmp_path_factory):
    """The folder of a sweep that was stopped after two chunks, to be copied."""
    solve, out = Ready.chunk, tmp_path_factory.mktemp("stopped") / "out"

    def chunk(self, k):
        if k == 2:
            raise KeyboardInterrupt
        return solve(self, k)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Ready, "chunk", chunk)
        assert main([*arguments, "--out", str(out)]) == 130
    return out


@pytest.fixture
def stop(monkeypatch):
    """Has a sweep stopped, by Ctrl-C or something else, when a chunk is to be solved; None: no
    more.
    """
    solve = Ready.chunk

    def at(index, reason=KeyboardInterrupt):
        def chunk(self, k):
            if k == index:
                raise reason
            return solve(self, k)

        monkeypatch.setattr(Ready, "chunk", chunk)

    return at


def numbers(folder):
    """All results but circumstances and times."""
    found = json.loads((folder / "sweep.json").read_text())
    return {key: value for key, value in found.items() if key not in ("run", "measured")}


@pytest.mark.by_day(2)
@pytest.mark.parametrize("chunks", [1, 3])
def test_resumed_sweep_is_bit_equal(arguments, whole, tmp_path, capsys, stop, chunks):
    (_, whole), out = whole, tmp_path / "out"
    stop(chunks)
    assert main([*arguments, "--out", str(out), *CHECK]) == 130
    told, said = capsys.readouterr()
    part = f"{chunks * CHUNK} of {VARIANTS}"
    assert f"{part} variants of mcpherson_strut, partial: the sweep was stopped" in told
    assert (
        said.splitlines()[-1]
        == f"kincheck: interrupted: {part} variants are solved; --resume continues from there"
    )
    assert (numbers(out)["samples"], numbers(out)["asked"]) == (chunks * CHUNK, VARIANTS)
    with (out / "envelope.csv").open() as lines:
        assert {row["partial"] for row in csv.DictReader(lines)} == {f"{part} variants"}
    assert part in (out / "sweep.html").read_text()
    solved = []
    stop(None)
    original = Ready.chunk
    Ready.chunk = lambda self, k: solved.append(k) or original(self, k)
    assert main([*arguments, "--out", str(out), *CHECK, "--resume"]) == 0
    assert solved == [*range(chunks, VARIANTS // CHUNK)]
    assert numbers(out) == numbers(whole)
    assert (out / "envelope.csv").read_bytes() == (whole / "envelope.csv").read_bytes()
    assert not (out / "sweep.part").exists()


def test_stopped_sweep_reduces_first_variants(tmp_path, stop):
    """What is known of a part is equal to what a sweep of as many variants in as many chunks has
    reduced.
    """
    case, stops = crank(), []
    variation = vary(tmp_path, case, tip=TIP)
    stop(3)
    found = sweep_designs(case, variation, samples=VARIANTS, seed=1, stopped=stops.append)
    assert [type(each) for each in stops] == [KeyboardInterrupt]
    stop(None)
    whole = sweep_designs(case, variation, samples=3 * CHUNK, seed=1)
    for name, each in found.outputs.items():
        assert each.count == whole.outputs[name].count
        assert (each.min, each.max, each.mean) == (
            whole.outputs[name].min,
            whole.outputs[name].max,
            whole.outputs[name].mean,
        )
    assert found.gradients == whole.gradients


def test_stopped_store_is_marked_partial(arguments, tmp_path, stop):
    parquet = pytest.importorskip("pyarrow.parquet")
    out, stored, whole = (tmp_path / name for name in ("out", "part.parquet", "whole.parquet"))
    assert main([*arguments, "--store", str(whole)]) == 0
    stop(3)
    assert main([*arguments, "--out", str(out), "--store", str(stored)]) == 130
    assert (
        parquet.read_metadata(stored).metadata[b"kincheck.partial"]
        == f"{3 * CHUNK} of {VARIANTS} variants".encode()
    )
    assert parquet.read_table(stored).num_rows == 3 * CHUNK
    stop(None)
    assert main([*arguments, "--out", str(out), "--store", str(stored), "--resume"]) == 0
    assert b"kincheck.partial" not in parquet.read_metadata(stored).metadata
    assert parquet.read_table(stored).equals(parquet.read_table(whole))


@pytest.mark.parametrize("change", ["--seed 4", "--samples 700", "--order 1", "--tol 1e-11"])
def test_resume_refuses_part_of_another_sweep(arguments, stopped, tmp_path, capsys, change):
    out = tmp_path / "out"
    shutil.copytree(stopped, out)
    kept = (out / "sweep.part").read_bytes()
    assert main([*arguments, *change.split(), "--out", str(out), "--resume"]) == 2
    assert "is the part of another study" in capsys.readouterr().err
    assert (out / "sweep.part").read_bytes() == kept


@pytest.mark.parametrize("lost", [1, 40, 20_000])
def test_resume_uses_undamaged_chunks(arguments, whole, stopped, tmp_path, lost):
    (whole, _), out = whole, tmp_path / "out"
    shutil.copytree(stopped, out)
    part = out / "sweep.part"
    content = bytearray(part.read_bytes())
    if lost == 40:
        content[len(content) // 2] ^= 1
    else:
        del content[-lost:]
    part.write_bytes(content)
    assert main([*arguments, "--out", str(out), "--resume"]) == 0
    assert numbers(out) == numbers(whole)


def test_resume_without_part_starts_over(arguments, tmp_path, capsys):
    assert main([*arguments, "--out", str(tmp_path / "out"), "--resume"]) == 0
    assert main([*arguments, "--resume"]) == 2
    assert "--resume continues from a folder of results. Give --out DIR" in capsys.readouterr().err


def test_sweep_interrupt_before_first_chunk(arguments, tmp_path, capsys, stop):
    stop(0)
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 130
    assert capsys.readouterr().err == "kincheck: interrupted\n"


def test_unwritable_part_file_keeps_results(arguments, tmp_path, capsys):
    out = tmp_path / "out"
    (out / "sweep.part").mkdir(parents=True)
    assert main([*arguments, "--out", str(out)]) == 2
    assert "sweep.part: cannot be written" in capsys.readouterr().err
    assert numbers(out)["samples"] == VARIANTS


def test_effects_add_up_to_spread(tmp_path, capsys):
    """A normal law of 1 mm moves more than a uniform one of 1.5 mm, which spreads by 0.87 mm."""
    points = {
        "normal_one": {"at": "ball", "sigma": [0.0, 0.0, 1.0]},
        "uniform_one": {"at": "joints.tie_rod.points.1", "half_width": [0.0, 0.0, 1.5]},
        "triangular": {
            "at": "joints.tie_rod.points.0",
            "half_width": [0.0, 0.0, 1.0],
            "distribution": "triangular",
        },
    }
    arguments = ["--samples", "4000", "--seed", "3", "--out", str(tmp_path)]
    file = vary_file(tmp_path, points)
    assert main(["sweep", "mcpherson_strut", "--vary", str(file), *arguments]) == 0
    capsys.readouterr()
    found = json.loads((tmp_path / "sweep.json").read_text())
    sizes = {"normal_one": 1.0, "uniform_one": 1.5 / 3**0.5, "triangular": 1.0 / 6**0.5}
    for name, output in found["outputs"].items():
        own = [each for each in found["gradients"] if each["output"] == name]
        for each in own:
            wanted = 1e-3 * sizes[each["coordinate"].removesuffix(".z")]
            assert each["deviation"] == pytest.approx(wanted, rel=1e-12)
        spread = np.sum([np.multiply(x["along"], x["deviation"]) ** 2 for x in own], axis=0) ** 0.5
        drawn = np.array(output["standard_deviation"])
        # of 4000 draws the deviation is known to 1.1 %; three of these, and a curvature of 1 %
        k = int(drawn.argmax())
        assert spread[k] == pytest.approx(drawn[k], rel=0.045)
    rows = read(tmp_path / "gradients.csv")
    for row, each in zip(rows, found["gradients"], strict=True):
        effect = 1e3 * abs(each["largest"]) * each["deviation"]
        assert float(row["effect"]) == pytest.approx(effect, rel=1e-9)
