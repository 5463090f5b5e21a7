"""The command bench: its files, its exit statuses, and its place in reports."""

from __future__ import annotations

import json
import shlex
import subprocess

import msgspec
import pytest
from kincheck.core.cli import laboratory as command
from kincheck.core.cli import main
from kincheck.core.extras import THREADS
from kincheck.core.studies.bench import engines
from kincheck.core.studies.paper import formulation

from .test_bench_engines import measured


@pytest.fixture
def one_thread(monkeypatch):
    monkeypatch.setenv(THREADS[0], "1")


@pytest.mark.usefixtures("one_thread")
def test_command_and_report_of_a_run(tmp_path, capsys):
    asked = "bench engines --rounds 1 --engine native --cases rssr --parts work".split()
    assert main.main([*asked, "--json", "-", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "kincheck-bench/1"
    assert {each["case"] for each in found["entries"]} == {"rssr"}
    assert json.loads((tmp_path / "bench.json").read_text("utf-8")) == found
    run = f"run rssr --engine native --out {tmp_path}".split()
    assert main.main(run) == 0
    assert "Work and precision" not in (tmp_path / "report.html").read_text("utf-8")
    assert main.main([*run, "--bench", str(tmp_path / "bench.json")]) == 0
    assert "Work and precision" in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.usefixtures("one_thread")
def test_bench_named_engine_missing_has_status_2(monkeypatch, capsys):
    found = measured()  # of an engine "gone" too
    there = [each for each in found.entries if each.engine != "gone"]
    for name, status in (("gone", 2), ("native", 0)):
        result = found if status else msgspec.structs.replace(found, entries=there)
        monkeypatch.setattr(engines, "measure", lambda *given, found=result, **options: found)
        monkeypatch.setattr(
            "kincheck.core.cli.registry.Registry.find_engines", lambda registry, names, *rest: []
        )
        assert main.main(["bench", "engines", "--engine", name, "--cases", "rssr"]) == status
        assert ("'gone' is requested, but missing" in capsys.readouterr().err) is (status == 2)


def test_run_refuses_invalid_benchmark_file(tmp_path, capsys):
    (tmp_path / "bench.json").write_text("{}")
    bad = str(tmp_path / "bench.json")
    assert main.main(["run", "rssr", "--engine", "native", "--bench", bad]) == 2
    assert "Give --out" in capsys.readouterr().err
    assert (
        main.main(["run", "rssr", "--engine", "native", "--bench", bad, "--out", str(tmp_path)])
        == 2
    )
    assert "written by kincheck bench" in capsys.readouterr().err


@pytest.mark.usefixtures("one_thread")
def test_plain_bench_is_everything(monkeypatch, tmp_path):
    asked = {}
    found = measured()
    monkeypatch.setattr(
        engines,
        "measure",
        lambda cases, engines, **options: asked.update(options, cases=cases) or found,
    )
    monkeypatch.setattr(formulation, "STATES", 1)
    assert main.main(["bench", "--out", str(tmp_path)]) == 0
    assert (tuple(asked["cases"]), asked["parts"]) == (command.CASES, engines.PARTS)
    found = json.loads((tmp_path / "bench.json").read_text("utf-8"))
    assert found["formulation"]["case"] == "mcpherson_strut"


def test_linear_algebra_has_one_thread(monkeypatch):
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    started = []
    monkeypatch.setattr(
        subprocess,
        "run",
        lambda arguments, env, check: (
            started.append((arguments, env)) or subprocess.CompletedProcess([], 5)
        ),
    )
    assert main.main(shlex.split("bench engines --rounds 2")) == 5
    ((arguments, env),) = started
    assert arguments[-4:] == "bench engines --rounds 2".split()
    assert {env[name] for name in THREADS} == {"1"}


@pytest.mark.usefixtures("one_thread")
def test_bad_options_are_named(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for options, said in (
        (["--cases", "rsr"], "'rssr'"),
        (["--engine", "natve"], "'native'"),
        (["--rounds", "0"], "not a whole number of 1 or more"),
        (["--out", str(tmp_path / "file")], "cannot be made a folder"),
    ):
        assert main.main(["bench", "engines", *options]) == 2
        assert said in capsys.readouterr().err
