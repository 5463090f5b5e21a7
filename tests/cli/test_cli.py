"""The command line: exit statuses, messages, and what goes to which stream."""

import json
from pathlib import Path

import kincheck.adapters
import kincheck.cases
import kincheck.core
import pytest
from kincheck.core.cli.main import main
from kincheck.core.extras import how_to_install

from ..support.case_texts import rows
from ..support.fakes import Fake, crank, off, partial, raising

RIGHT = Fake("native")
WRONG = Fake("wrong", answer=off("acceleration", lambda a: a * (1.0 + 1e-6)))
PARTIAL = Fake("partial", answer=partial)
BROKEN = Fake("broken", answer=raising(ValueError("no [axis] there")))
MISSING = Fake("missing", installed=None)
UNABLE = Fake("unable", refusal="joint 'cv' (universal) has no counterpart")


SOLVED = "kincheck: nothing was solved: every installed engine that supports a case ended"
COMPARED = "kincheck: nothing was compared (2 unsupported, 2 unavailable); run other engines\n"


@pytest.mark.parametrize(
    ("engines", "status", "message"),
    [
        ([RIGHT], 0, ""),
        ([RIGHT, WRONG], 1, ""),
        ([RIGHT, PARTIAL], 1, ""),
        ([RIGHT, BROKEN], 1, ""),
        ([RIGHT, MISSING, UNABLE], 0, ""),
        ([BROKEN], 2, SOLVED),
        ([BROKEN, MISSING, UNABLE], 2, SOLVED),
        ([BROKEN, PARTIAL], 1, ""),
        ([BROKEN, WRONG], 1, ""),
        ([MISSING, UNABLE], 2, COMPARED),
    ],
    ids=lambda each: " and ".join(x.name for x in each) if isinstance(each, list) else "",
)
def test_run_exit_status_by_outcome(kincheck_main, capsys, engines, status, message):
    assert kincheck_main("run", engines=engines) == status
    printed = capsys.readouterr().err
    assert [each for each in (SOLVED, COMPARED) if each in printed] == [message] * bool(message)


@pytest.mark.parametrize(
    ("line", "records"),
    [
        ("", "crank native, crank wrong, crank_two native, crank_two wrong"),
        ("crank_two crank_two --engine native", "crank_two native"),
        ("crank --engine native --require wrong", "crank native, crank wrong"),
        ("crank --engine wrong", "crank wrong"),
    ],
    ids=["all pairs", "chosen", "required", "other than native"],
)
def test_run_solves_chosen_pairs(kincheck_main, capsys, line, records):
    status = kincheck_main(f"run {line} --json -", engines=[RIGHT, WRONG])
    found = json.loads(capsys.readouterr().out)["records"]
    assert ", ".join(f"{each['case']} {each['engine']}" for each in found) == records
    assert status == ("wrong" in records)


def test_unselected_native_is_standard(kincheck_main, capsys):
    cases = {"crank": crank(reference=False)}
    assert kincheck_main("run --engine wrong --json -", engines=[RIGHT, WRONG], cases=cases) == 1
    (record,) = json.loads(capsys.readouterr().out)["records"]
    assert "against native" in record["message"]


@pytest.mark.parametrize(
    ("engines", "options", "inside"),
    [([RIGHT], [], True), ([RIGHT], ["--timeout", "60"], False), ([RIGHT, Fake()], [], False)],
    ids=["native", "native, limited", "both"],
)
def test_simulators_run_in_worker_processes(
    kincheck_main, capsys, monkeypatch, engines, options, inside
):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    RIGHT.solves = 0
    assert kincheck_main("run crank --json -", *options, engines=engines, jobs=None) == 0
    facts = json.loads(capsys.readouterr().out)["run"]
    assert (facts["jobs"] == 0) is inside
    assert ("timeout" in facts) is not inside
    assert (RIGHT.solves > 0) is inside


def test_unloadable_adapter_gives_error_record(capsys, monkeypatch):
    native = kincheck.adapters.engine("native")

    def load(name, mode):
        if name == "other":
            raise ImportError("libother.so: no such file")
        return native

    monkeypatch.setattr(kincheck.adapters, "ENGINES", {"native": "", "other": ""})
    monkeypatch.setattr(kincheck.adapters, "SIMULATIONS", {})
    monkeypatch.setattr(kincheck.adapters, "engine", load)
    assert main("run four_bar --jobs 0 --json -".split()) == 1
    records = json.loads(capsys.readouterr().out)["records"]
    assert [each["outcome"] for each in records] == ["pass", "error"]
    assert (
        records[1]["message"]
        == "ImportError: engine 'other' cannot be loaded: ImportError: libother.so: no such file"
    )


INVALID = """
crnk | there is no case 'crnk'; did you mean 'crank'?
crank --engine nativ | there is no engine 'nativ'; did you mean 'native'?
crank --require zzz | there is no engine 'zzz'; known: native
crank --tol nan | 'nan' is not a positive number
crank --tol 0 | '0' is not a positive number
crank --tol inf | 'inf' is not a positive number
crank --tol=-1e-9 | '-1e-9' is not a positive number
crank --tol tight | 'tight' is not a positive number
crank --mode dream | 'dream' is none of projection, simulate
crank --mode simulate | no engine has the mode 'simulate'
crank --engine native --mode simulate | engine 'native' has the mode 'projection', not 'simulate'
--unknown | kincheck run: error: there is no option '--unknown'
--engin native --ttol=1 | there is no option '--ttol'; did you mean '--tol'?
-x | there is no option '-x'
cran[q] | no built-in case and no file matches 'cran[q]'
--jobs -1 | '-1' is not a whole number of 0 or more. Give one
--timeout 5
    | cannot be limited. Leave out --timeout and --memory, or --jobs
--resume | --resume needs a history. Give --history FILE, or set KINCHECK_HISTORY
"""


@pytest.mark.parametrize(("line", "said"), rows(INVALID, named=False))
def test_run_invalid_options_have_status_2(kincheck_main, capsys, line, said):
    RIGHT.solves = 0
    assert kincheck_main("run", *line.split()) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""
    assert RIGHT.solves == 0


def test_help_and_missing_command_exit_status(capsys):
    assert main([]) == 2
    assert main(["--help"]) == 0
    assert main(["run", "--help"]) == 0


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        (MISSING, "missing is not installed"),
        (UNABLE, "case 'crank' is unsupported: joint 'cv' (universal) has no counterpart"),
    ],
    ids=["missing", "unable"],
)
def test_unable_required_engine_has_status_2(kincheck_main, capsys, engine, said):
    line = f"run crank --require {engine.name} --json -"
    assert kincheck_main(line, engines=[RIGHT, engine]) == 2
    captured = capsys.readouterr()
    assert f"required engine '{engine.name}': {said}" in captured.err
    assert json.loads(captured.out)["records"][0]["outcome"] == "pass"


def test_how_to_install_matches_package_metadata():
    assert how_to_install("pinocchio").startswith("pip install 'pin>=")
    assert how_to_install("mujoco").startswith("pip install 'mujoco>=")


def test_list_shows_truth_source_and_installation(kincheck_main, capsys, monkeypatch):
    monkeypatch.setattr("kincheck.core.cli.lists.installed_version", lambda name: None)
    pinocchio = Fake("pinocchio", installed=None)
    cases = {"crank": crank(), "free": crank("free", reference=False)}
    assert kincheck_main("list", engines=[RIGHT, pinocchio], cases=cases) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines if "made up" in line] == [
        ["crank", "closed", "form", "made", "up"],
        ["free", "consensus", "only", "made", "up"],
    ]
    assert any(line.startswith("  native     1.2  projection, loop: python") for line in lines)
    assert any(line.startswith("  pinocchio  not installed: pip install 'pin>=") for line in lines)
