"""What a run writes, and to which stream: JSON, the table, files, and what is kept where something
fails.
"""

import os
import subprocess
import sys
import xml.etree.ElementTree as ET

import pytest
from kincheck.core.cli.main import main
from kincheck.core.harness.execution import error_text
from kincheck.core.harness.record import from_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import caveats

from ..support.case_texts import rows
from ..support.examples import examples
from ..support.fakes import Fake, off
from .test_cli import BROKEN, MISSING, PARTIAL, RIGHT, UNABLE, WRONG

(ROD,) = examples(__file__, "rod")


def test_json_output_excludes_engine_prints(kincheck_main, capfd):
    def chatty(case):
        print("from Python")
        os.write(1, b"from the file descriptor\n")
        return off("position", lambda p: p)(case)

    assert kincheck_main("run crank --json -", engines=[Fake("native", answer=chatty)]) == 0
    captured = capfd.readouterr()
    assert len(from_json(captured.out.encode()).records) == 1
    for text in ("from Python", "from the file descriptor", "[1/1] crank native: pass", "truth"):
        assert text in captured.err


@pytest.mark.skipif(os.name != "posix", reason="finds the C library by its POSIX name")
def test_json_only_flushes_c_buffers():
    code = (
        "import ctypes\n"
        "from kincheck.core.cli.destinations import json_only\n"
        "with json_only():\n"
        "    ctypes.CDLL(None).puts(b'from C')\n"
        "print('json')\n"
    )
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=buffered
    )
    assert (done.stdout, done.stderr) == ("json\n", "from C\n")


@pytest.mark.parametrize(
    ("length", "noted"), [("1.1", True), ("1.0", False), ("1.0000000001", False), ("1.00001", True)]
)
def test_contradictory_length_is_noted_in_results(tmp_path, capsys, length, noted):
    file, page, out = tmp_path / "rod.toml", tmp_path / "rod.md", tmp_path / "out"
    file.write_text(ROD.replace("LENGTH", length))
    assert main(f"run {file} --engine native --out {out} --markdown {page}".split()) == 2
    note = (
        f"joint 'rod' (distance): length {length} m, points 1 m apart at design: "
        "assembled from there, so the design position is another than the given one"
    )
    results = read_results(out / "results.json")
    assert results.run["cases"]["rod"]["notes"] == [note] * noted
    assert (f"note: rod: {note}\n" in capsys.readouterr().out) is noted
    assert ("Note: rod: joint 'rod'" in page.read_text()) is noted
    assert ("Note on rod" in dict(caveats(results))) is noted
    assert (f"note: {note}" in to_junit(results).decode()) is noted


@pytest.mark.needs("explain")
@pytest.mark.parametrize("length", ["1.1", "1.0"])
def test_contradictory_length_is_noted_by_explain(tmp_path, capsys, length):
    file, vary, out = tmp_path / "rod.toml", tmp_path / "vary.toml", tmp_path / "out"
    file.write_text(ROD.replace("LENGTH", length))
    vary.write_text(
        'schema = "kincheck-vary/1"\nmode = "one_at_a_time"\nunits = { length = "mm" }\n'
        '[hardpoints.tip]\nat = "tip"\nvalues = [1.0]\n'
    )
    note = "note: joint 'rod' (distance): length 1.1 m, points 1 m apart at design"
    for status, command in (
        (0, f"explain {file}"),
        (0, f"sweep {file} --vary {vary} --out {out}"),
        (2, f"run {file} --engine native --explain"),
    ):
        assert main(command.split()) == status
        assert (note in capsys.readouterr().out) == (length == "1.1")
    page = (out / "sweep.html").read_text()
    assert ("Nominal design of rod: joint &#39;rod&#39;" in page) == (length == "1.1")


def test_explain_reports_unsolvable_case(tmp_path, capsys):
    (tmp_path / "far.toml").write_text(
        ROD.replace("LENGTH", "5.0").replace('name = "rod"', 'name = "far"')
    )
    (tmp_path / "rod.toml").write_text(ROD.replace("LENGTH", "1.0"))
    files = [str(tmp_path / f"{name}.toml") for name in ("far", "rod")]
    assert main(["run", *files, "--engine", "native", "--explain"]) == 2
    printed = capsys.readouterr().out
    assert (
        "\nfar: cannot be solved: mechanism 'far' does not close at the design position" in printed
    )
    assert "\n  note: joint 'rod' (distance): length 5 m" in printed
    assert "\nrod: 12 unknowns for crank, rocker\n" in printed


def test_memory_error_states_limit(monkeypatch):
    assert error_text(MemoryError()) == "MemoryError"
    monkeypatch.setattr("kincheck.core.harness.execution.memory_limit", lambda: 4.0)
    assert (
        error_text(MemoryError())
        == "MemoryError; this process may have 4 GB, --memory gives it more"
    )
    assert error_text(ValueError("no axis")) == "ValueError: no axis"


def test_run_table_shows_every_outcome(kincheck_main, capsys):
    engines = [RIGHT, WRONG, PARTIAL, BROKEN, MISSING, UNABLE]
    assert kincheck_main("run crank", engines=engines) == 1
    captured = capsys.readouterr()
    rows = {line.split()[1]: line for line in captured.out.splitlines() if line.startswith("crank")}
    assert "pass" in rows["native"]
    assert "closed form (validated)" in rows["native"]
    for engine in engines[1:]:
        assert "validated" not in rows[engine.name]
    assert "2.0e-06" in rows["wrong"]
    assert "fail: crank · wrong: x: acceleration is off by 2e-06 m/s²" in captured.out
    assert "error: crank · broken: ValueError: no [axis] there" in captured.out
    assert "1 pass, 2 fail, 1 error, 1 unsupported, 1 unavailable" in captured.out
    outcomes = "pass fail fail error unavailable unsupported".split()
    assert captured.err.splitlines() == [
        f"[{k}/6] crank {engine.name}: {outcome}"
        for k, (engine, outcome) in enumerate(zip(engines, outcomes, strict=True), 1)
    ]


def test_run_writes_files_of_options(kincheck_main, capsys, tmp_path):
    out, file, suite = tmp_path / "made" / "here", tmp_path / "r.json", tmp_path / "j.xml"
    assert kincheck_main("run crank --out", out, "--json", file, "--junit", suite) == 0
    results = read_results(out / "results.json")
    assert results == read_results(file)
    assert results.run["command"].startswith("kincheck run crank --out ")
    assert "crank" in (out / "report.html").read_text()
    assert len(ET.parse(suite).findall(".//testcase")) == 2
    assert "[1/1]" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("option", "name"),
    rows(
        """
--out | file/sub
--out | file
--json | no/r.json
--junit | .
""",
        named=False,
    ),
)
def test_unwritable_destination_stops_before_solving(kincheck_main, capsys, tmp_path, option, name):
    (tmp_path / "file").write_text("here already")
    RIGHT.solves = 0
    assert kincheck_main("run crank", option, tmp_path / name) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"kincheck: {option} ")
    assert len(captured.err.splitlines()) == 1
    assert RIGHT.solves == 0


def test_failed_file_leaves_other_files(kincheck_main, capsys, tmp_path):
    def hostile(case):
        (tmp_path / "j.xml").mkdir(exist_ok=True)  # in the way, since the destinations were checked
        return off("position", lambda p: p)(case)

    argv = ["run", "crank", "--junit", tmp_path / "j.xml", "--json", tmp_path / "r.json"]
    assert kincheck_main(*argv, engines=[Fake("native", answer=hostile)]) == 2
    assert "j.xml: cannot be written (Is a directory)" in capsys.readouterr().err
    assert len(read_results(tmp_path / "r.json").records) == 1


def test_internal_defect_has_status_2(kincheck_main, capsys, monkeypatch):
    monkeypatch.setattr("kincheck.core.harness.run.run", lambda *_, **__: 1 / 0)
    assert kincheck_main("run") == 2
    assert "ZeroDivisionError" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--junit", "--markdown"])
def test_standard_output_takes_json_alone(kincheck_main, capsys, option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert kincheck_main("run crank", option, "-", engines=[RIGHT]) == 2
    assert (
        f"{option} -: standard output takes the document of --json alone" in capsys.readouterr().err
    )
    assert not list(tmp_path.iterdir())
