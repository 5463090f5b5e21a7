"""The command line: exit statuses, messages, and what goes to which stream."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import kincheck.adapters
import kincheck.cases
import kincheck.core
import pytest
from kincheck.core.cli import main
from kincheck.core.errors import CaseError
from kincheck.core.extras import how_to_install
from kincheck.core.harness.results_file import read_results
from kincheck.core.report.caveats import caveats
from kincheck.core.report.report import headline

from ..support.fakes import Fake, crank, off, partial, raising

RIGHT = Fake("native")
WRONG = Fake("wrong", answer=off("acceleration", lambda a: a * (1.0 + 1e-6)))
PARTIAL = Fake("partial", answer=partial)
BROKEN = Fake("broken", answer=raising(ValueError("no [axis] there")))
MISSING = Fake("missing", installed=None)
UNABLE = Fake("unable", refusal="joint 'cv' (universal) has no counterpart")


@pytest.mark.parametrize(
    ("engine", "status"),
    [(RIGHT, 0), (WRONG, 1), (PARTIAL, 1), (BROKEN, 1), (MISSING, 0), (UNABLE, 0)],
    ids=lambda each: getattr(each, "name", each),
)
def test_exit_status_of_a_run(kincheck_main, engine, status):
    assert kincheck_main("run", engines=[RIGHT, engine]) == status


@pytest.mark.parametrize(
    ("engines", "status"),
    [
        ([BROKEN], 2),
        ([BROKEN, MISSING, UNABLE], 2),
        ([BROKEN, PARTIAL], 1),
        ([BROKEN, WRONG], 1),
        ([MISSING, UNABLE], 2),
    ],
    ids=[
        "errors",
        "errors and missing",
        "errors and a motion that ends",
        "errors and deviations",
        "missing",
    ],
)
def test_a_run_of_which_nothing_came_but_errors_has_not_found_that_something_deviates(
    kincheck_main, capsys, engines, status
):
    assert kincheck_main("run", engines=engines) == status
    told = capsys.readouterr().err
    solved, tried = status != 2, BROKEN in engines
    assert (
        "kincheck: nothing was solved: every installed engine that supports a case ended" in told
    ) is (tried and not solved)
    nothing = "kincheck: nothing was compared (2 unsupported, 2 unavailable); run other engines\n"
    assert (nothing in told) is not tried


def test_all_cases_and_engines_are_the_default(kincheck_main, capsys):
    assert kincheck_main("run", "--json", "-", engines=[RIGHT, MISSING]) == 0
    records = json.loads(capsys.readouterr().out)["records"]
    assert [(each["case"], each["engine"]) for each in records] == [
        ("crank", "native"),
        ("crank", "missing"),
        ("crank_two", "native"),
        ("crank_two", "missing"),
    ]


@pytest.mark.parametrize(
    ("engines", "options", "inside"),
    [
        ([RIGHT], [], True),
        ([RIGHT], ["--timeout", "60"], False),
        ([RIGHT, Fake()], [], False),
    ],
    ids=["native", "native, limited", "both"],
)
def test_what_is_not_ours_alone_is_solved_in_worker_processes(
    kincheck_main, capsys, monkeypatch, engines, options, inside
):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    RIGHT.solves = 0
    assert kincheck_main("run", "crank", "--json", "-", *options, engines=engines, jobs=None) == 0
    facts = json.loads(capsys.readouterr().out)["run"]
    assert (facts["jobs"] == 0) is inside
    assert ("timeout" in facts) is not inside
    assert (RIGHT.solves > 0) is inside


def test_an_adapter_that_cannot_be_loaded_is_an_error_of_its_pairs(
    kincheck_main, capsys, monkeypatch
):
    def load(name):
        if name == "other":
            raise ImportError("libother.so: no such file")
        return RIGHT

    argv = ["run", "crank", "--json", "-"]
    assert kincheck_main(*argv, engines=[RIGHT, Fake("other")]) == 0
    capsys.readouterr()
    monkeypatch.setattr(kincheck.adapters, "engine", load)
    assert main.main([*argv, "--jobs", "0"]) == 1
    records = json.loads(capsys.readouterr().out)["records"]
    assert [each["outcome"] for each in records] == ["pass", "error"]
    assert (
        records[1]["message"]
        == "ImportError: engine 'other' cannot be loaded: ImportError: libother.so: no such file"
    )


def test_cases_and_engines_can_be_chosen(kincheck_main, capsys):
    assert (
        kincheck_main(
            "run",
            "crank_two",
            "crank_two",
            "--engine",
            "native",
            "--json",
            "-",
            engines=[RIGHT, WRONG],
        )
        == 0
    )
    assert [each["case"] for each in json.loads(capsys.readouterr().out)["records"]] == [
        "crank_two"
    ]


def test_a_case_without_reference_is_compared_with_the_native_engine_even_if_that_was_not_asked_for(
    kincheck_main, capsys
):
    cases = {"crank": crank(reference=False)}
    assert (
        kincheck_main(
            "run", "--engine", "wrong", "--json", "-", engines=[RIGHT, WRONG], cases=cases
        )
        == 1
    )
    (record,) = json.loads(capsys.readouterr().out)["records"]
    assert record["engine"] == "wrong"
    assert "against native" in record["message"]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["crnk"], "there is no case 'crnk'; did you mean 'crank'?"),
        (["crank", "--engine", "nativ"], "there is no engine 'nativ'; did you mean 'native'?"),
        (["crank", "--require", "zzz"], "there is no engine 'zzz'; known: native"),
        (["crank", "--tol", "nan"], "'nan' is not a positive number"),
        (["crank", "--tol", "0"], "'0' is not a positive number"),
        (["crank", "--tol", "inf"], "'inf' is not a positive number"),
        (["crank", "--tol=-1e-9"], "'-1e-9' is not a positive number"),
        (["crank", "--tol", "tight"], "'tight' is not a positive number"),
        (["crank", "--mode", "dream"], "'dream' is none of projection, simulate"),
        (["crank", "--mode", "simulate"], "no engine has the mode 'simulate'"),
        (
            ["crank", "--engine", "native", "--mode", "simulate"],
            "engine 'native' has the mode 'projection', not 'simulate'",
        ),
        (["--unknown"], "kincheck run: error: there is no option '--unknown'"),
        (["--engin", "native", "--ttol=1"], "there is no option '--ttol'; did you mean '--tol'?"),
        (["-x"], "there is no option '-x'"),
        (["cran[q]"], "no built-in case and no file matches 'cran[q]'"),
        (["--jobs", "-1"], "'-1' is not a whole number of 0 or more; give one"),
        (
            ["--timeout", "5"],
            (
                "--jobs 0 solves in this process, which cannot be limited; leave out --timeout and"
                " --memory, or --jobs"
            ),
        ),
        (
            ["--scheduler", "tcp://there:8786"],
            "--scheduler: the cluster decides how many pairs run at a time; leave out --jobs",
        ),
        (["--resume"], "--resume needs a history: give --history FILE, or set KINCHECK_HISTORY"),
    ],
)
def test_bad_options_are_one_message_and_status_2(kincheck_main, capsys, argv, said):
    RIGHT.solves = 0
    assert kincheck_main("run", *argv) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""
    assert RIGHT.solves == 0


def test_no_command_is_status_2_and_help_and_version_are_status_0(capsys):
    assert main.main([]) == 2
    assert main.main(["--help"]) == 0
    assert main.main(["run", "--help"]) == 0
    capsys.readouterr()
    assert main.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("kincheck 0.")


def test_all_bad_case_files_are_named_before_anything_is_computed(kincheck_main, capsys, tmp_path):
    first, second = tmp_path / "first.toml", tmp_path / "second.json"
    first.write_text('schema = "kincheck-case/9"\n')
    second.write_text("{")
    RIGHT.solves = 0
    assert kincheck_main("run", first, second, tmp_path / "third.toml") == 2
    captured = capsys.readouterr()
    said = captured.err.splitlines()
    assert [
        sum(name in line for line in said) for name in ("first.toml", "second.json", "third.toml")
    ] == [1, 1, 1]
    assert "Traceback" not in captured.err
    assert captured.out == ""
    assert RIGHT.solves == 0


@pytest.mark.parametrize("bad", ["bad.toml", "nosuch"])
def test_the_other_cases_of_a_bad_one_are_run_and_recorded(
    kincheck_main, capsys, tmp_path, monkeypatch, bad
):
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_text('schema = "kincheck-case/9"\n')
    files = ["--out", "out", "--junit", "junit.xml", "--history", "history"]
    for _ in range(2):
        assert kincheck_main("run", "crank", bad, "crank_two", *files) == 2
    captured = capsys.readouterr()
    message = f"{bad}: schema: found" if bad == "bad.toml" else f"there is no case {bad!r}"
    assert captured.err.count(message) == 2  # once each run
    assert captured.err.index(message) < captured.err.index("[1/2] crank native: pass")
    found = read_results(Path("out/results.json"))
    assert [record.case for record in found.records] == ["crank", "crank_two"]
    assert found.missing == [(bad, "native", "projection")]
    assert [*found.unread] == [bad]
    assert message in found.unread[bad]
    assert headline(found).endswith("within tolerance; 1 case could not be read")
    assert dict(caveats(found))[f"Not read: {bad}"].startswith(message)
    (error,) = (
        test.find("error")
        for test in ElementTree.parse("junit.xml").iter("testcase")
        if test.find("error") is not None
    )
    assert error.get("message") == found.unread[bad]
    # what is broken tonight is told, and tomorrow too
    assert kincheck_main("report", "--history", "history") == 1
    told = capsys.readouterr().out
    assert message.partition(":")[0].replace("_", r"\_") in told
    assert told.startswith(
        "## run 2: all 2 right, 1 case could not be read; nothing to compare with: no earlier"
        " green run"
    )
    # and is one fault, however many engines were to solve it
    engines = [RIGHT, Fake("other")]
    assert kincheck_main("run", "crank", "--history", "history", engines=engines) == 0
    assert kincheck_main("run", "crank", bad, "--history", "history", engines=engines) == 2
    capsys.readouterr()
    assert kincheck_main("report", "--history", "history") == 1
    told = capsys.readouterr().out.splitlines()[0]
    told = re.sub(r": \d slower, ", ": ", told)  # of sweeps of 0.05 ms, on a busy machine
    assert told == "## run 4 against run 3 (last green): 1 case could not be read"


def test_a_night_in_which_no_case_can_be_read_is_recorded(
    kincheck_main, capsys, tmp_path, monkeypatch
):
    """Else the report would judge the night before, and its files would stand there as those of
    this one.
    """
    monkeypatch.chdir(tmp_path)
    files = [
        "--out",
        "out",
        "--junit",
        "junit.xml",
        "--markdown",
        "cases.md",
        "--history",
        "history",
    ]
    for _ in range(2):
        assert kincheck_main("run", "crank", *files) == 0
    assert kincheck_main("run", "nosuch", *files) == 2
    captured = capsys.readouterr()
    assert captured.err.count("there is no case 'nosuch'") == 1
    assert captured.out.endswith("nothing was run\n1 case could not be read: nosuch\n")
    found = read_results(Path("out/results.json"))
    assert (found.records, found.missing) == ([], [("nosuch", "native", "projection")])
    assert [test.get("name") for test in ElementTree.parse("junit.xml").iter("testcase")] == [
        "not run"
    ]
    assert "1 case could not be read: nosuch" in Path("cases.md").read_text()
    assert kincheck_main("report", "--history", "history") == 1
    assert capsys.readouterr().out.startswith(
        "## run 3: all 0 right, 1 case could not be read; nothing to compare with"
    )


def test_an_option_that_is_wrong_ends_a_run_and_the_bad_cases_are_told_too(kincheck_main, capsys):
    RIGHT.solves = 0
    assert kincheck_main("run", "crank", "nosuch", "--engine", "nativ", engines=[RIGHT]) == 2
    assert [line[:29] for line in capsys.readouterr().err.splitlines()] == [
        "kincheck: there is no case 'n",
        "kincheck: there is no engine ",
    ]
    assert RIGHT.solves == 0


def test_a_bad_built_in_case_is_a_message(kincheck_main, capsys, monkeypatch):
    def load(name):
        raise CaseError("crank.toml: sweep.steps = 0: expected at least 1")

    status = kincheck_main("run", "crank", cases={"crank": crank()})
    assert status == 0
    monkeypatch.setattr(kincheck.cases, "load", load)
    capsys.readouterr()
    assert main.main(["run", "crank"]) == 2
    assert capsys.readouterr().err == "kincheck: crank.toml: sweep.steps = 0: expected at least 1\n"


def test_two_cases_of_one_name_are_refused(kincheck_main, capsys):
    assert kincheck_main("run", cases={"a": crank("same"), "b": crank("same")}) == 2
    assert "two cases named 'same'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        (MISSING, "required engine 'missing': missing is not installed"),
        (
            UNABLE,
            (
                "required engine 'unable': case 'crank' is unsupported: joint 'cv' (universal) has"
                " no counterpart"
            ),
        ),
    ],
    ids=["missing", "unable"],
)
def test_a_required_engine_that_cannot_is_status_2_and_the_results_are_kept(
    kincheck_main, capsys, engine, said
):
    assert (
        kincheck_main(
            "run", "crank", "--require", engine.name, "--json", "-", engines=[RIGHT, engine]
        )
        == 2
    )
    captured = capsys.readouterr()
    assert said in captured.err
    assert json.loads(captured.out)["records"][0]["outcome"] == "pass"


def test_a_required_engine_is_run_even_if_others_were_asked_for(kincheck_main, capsys):
    argv = ["run", "crank", "--engine", "native", "--require", "wrong", "--json", "-"]
    assert kincheck_main(*argv, engines=[RIGHT, WRONG]) == 1
    assert [each["engine"] for each in json.loads(capsys.readouterr().out)["records"]] == [
        "native",
        "wrong",
    ]


def test_how_to_install_comes_from_the_metadata():
    assert how_to_install("pinocchio").startswith("pip install 'pin>=")
    assert how_to_install("mujoco").startswith("pip install 'mujoco>=")


def test_list_shows_truth_and_source_and_what_to_install(kincheck_main, capsys, monkeypatch):
    monkeypatch.setattr("kincheck.core.cli.list.installed_version", lambda name: None)
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
