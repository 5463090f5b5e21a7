"""A sweep that is stopped writes its finished part and says so; taken up, it has the same bits as
one that was never stopped.
"""

import csv
import json
import shutil

import pytest
from kincheck.core.cli.main import main
from kincheck.core.studies.tolerance.study import Ready
from kincheck.core.studies.tolerance.sweep import sweep_designs

from ..support.fakes import crank
from .test_sweep_study import TIP
from .test_vary import vary, vary_file

POINTS = {"ball": {"at": "ball", "sigma": 1.0}}
VARIANTS, CHUNK = 256, 64
CHECK = ("--check", "native:0.01")


@pytest.fixture(scope="module")
def arguments(tmp_path_factory):
    file = vary_file(tmp_path_factory.mktemp("study"), POINTS)
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


@pytest.mark.parametrize("chunks", [1, 3])
def test_resumed_sweep_has_the_same_bits(arguments, whole, tmp_path, capsys, stop, chunks):
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


def test_stored_values_are_marked_partial(arguments, tmp_path, stop):
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


@pytest.mark.parametrize(
    "change", [["--seed", "4"], ["--samples", "700"], ["--order", "1"], ["--tol", "1e-11"]]
)
def test_resume_refuses_part_of_another_sweep(arguments, stopped, tmp_path, capsys, change):
    out = tmp_path / "out"
    shutil.copytree(stopped, out)
    kept = (out / "sweep.part").read_bytes()
    assert main([*arguments, *change, "--out", str(out), "--resume"]) == 2
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


def test_interrupt_before_first_chunk(arguments, tmp_path, capsys, stop):
    stop(0)
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 130
    assert capsys.readouterr().err == "kincheck: interrupted\n"


def test_unwritable_part_costs_no_result(arguments, tmp_path, capsys):
    out = tmp_path / "out"
    (out / "sweep.part").mkdir(parents=True)
    assert main([*arguments, "--out", str(out)]) == 2
    assert "sweep.part: cannot be written" in capsys.readouterr().err
    assert numbers(out)["samples"] == VARIANTS
