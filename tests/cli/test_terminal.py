"""The command line at the terminal: completion, patterns, -q and -v, numbers, progress, widths."""

import io
import re
import shutil
import subprocess

import pytest
from kincheck import Revolute, cases
from kincheck.core.cli.joint_loading import named_joint
from kincheck.core.cli.main import every_command, main
from kincheck.core.harness.provenance import truth_of
from kincheck.core.options import whole
from kincheck.core.report.terminal import columns, console

from ..support.case_texts import at_hand, rows
from ..support.examples import examples
from ..support.fakes import Fake

(UNDETERMINED,) = examples(__file__, "undetermined")

RIGHT = Fake("native")


@pytest.mark.parametrize(("text", "value"), [("1000000", 10**6), ("1e6", 10**6), ("2.0", 2)])
def test_whole_number_option_notations(text, value):
    assert whole(1)(text) == value


@pytest.mark.parametrize("text", ["1.5", "1e-3", "nan", "inf", "0", "ten", "1e3000"])
def test_whole_number_option_refuses_other_values(text):
    with pytest.raises(Exception, match="is not a whole number of 1 or more"):
        whole(1)(text)


def test_case_pattern_selects_built_in_cases(kincheck_main, capsys):
    assert kincheck_main("run crank*", engines=[RIGHT]) == 0
    assert "2 pass" in capsys.readouterr().out
    assert kincheck_main("run crank_?wo", engines=[RIGHT]) == 0
    assert "1 pass" in capsys.readouterr().out


@pytest.mark.needs("explain")
def test_explain_refuses_pattern_of_several_cases(kincheck_main, capsys):
    assert kincheck_main("explain cran*", engines=[RIGHT]) == 2
    said = capsys.readouterr().err
    assert "'cran*' matches 2 cases: crank, crank_two. Name one of them" in said


def test_case_pattern_selects_files(kincheck_main, tmp_path, capsys):
    shutil.copy(cases.FOLDER / "rssr.toml", tmp_path / "mine.toml")
    (tmp_path / "other.csv").touch()
    kincheck_main("run", f"{tmp_path}/*.toml", engines=[RIGHT], cases={})
    assert "[1/1] rssr native" in capsys.readouterr().err


def test_quiet_and_verbose_output(kincheck_main, capsys):
    assert kincheck_main("run crank -q", engines=[RIGHT]) == 0
    assert capsys.readouterr() == ("1 pass\n", "")
    assert kincheck_main("run crank -v", engines=[RIGHT]) == 0
    out = capsys.readouterr().out
    assert re.search(r"crank +native +x +\S+ of \S+ +\S+ of", out)
    assert re.search(r"^case +engine +output +position +velocity", out, re.MULTILINE)
    assert kincheck_main("list -q", engines=[RIGHT]) == 0
    assert capsys.readouterr().out.split() == ["crank", "crank_two", "native"]


USAGE = """
runn | kincheck: error: there is no command 'runn'; did you mean 'run'?
--engine native run | it belongs to kincheck run
bench --rounds 3 | '--rounds'; it belongs to kincheck bench engines
sweep --sample 1e3 --vari f | kincheck sweep: error:
run --mode projecton | projection, simulate; did you mean 'projection'?\\n
run --mode dream | 'dream' is none of projection, simulate\\n
sweep --varry f | no option '--varry'; did you mean '--vary'?
explain rssr bennett | kincheck explain: error: too many arguments: bennett
export rssr --at nan | 'nan' is not a number
"""


@pytest.mark.parametrize(
    ("line", "said"), at_hand(rows(USAGE, named=False), {*every_command(), "runn", "--engine"})
)
def test_usage_errors_state_command_and_remedy(line, said, capsys):
    assert main(line.split()) == 2
    found = capsys.readouterr().err
    assert said in found
    assert len(found.splitlines()) == 2


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_table_keeps_names_within_console_width(width, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    table = columns("case", "engine", ">error", "what it says of itself")
    names = ["chrono_sedan_double_wishbone_arm", "exudyn-static-modified"]
    text = "a sentence of many words that may be wrapped anywhere between any two of them"
    table.add_row(*names, "1.5e-16", text)
    file = io.StringIO()
    console(file).print(table)
    lines = file.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    assert all(name in file.getvalue() for name in (*names, "1.5e-16"))
    assert file.getvalue().split().count("wrapped") == 1


@pytest.mark.parametrize("width", [60, 80, 200])
def test_narrow_run_table_groups_by_case(kincheck_main, capsys, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    assert kincheck_main("run crank", engines=[RIGHT, Fake("twin")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    assert sum("crank" in line for line in lines) == (2 if width == 200 else 1)


def test_case_summary_matches_loaded_case():
    for name in ("rssr", "mcpherson_strut", "modelica_four_bar_distance"):
        case = cases.load(name)
        assert cases.summary(name) == (truth_of(case), case.source)


TRY = """
source {script}
COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); _shtab_kincheck
echo "${{COMPREPLY[@]}}"
"""


@pytest.mark.needs("exports", "explain", "laboratory", "simulate")
@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completion_of_commands_and_values(tmp_path, capsys):
    pytest.importorskip("shtab")
    assert main(["completion", "bash"]) == 0
    (script := tmp_path / "script").write_text(capsys.readouterr().out)
    for words, expected in (
        ("kincheck exp", "export explain"),
        ("kincheck explain rssr_", "rssr_other_branch"),
        ("kincheck run --engine muj", "mujoco mujoco-default mujoco-projecting"),
        ("kincheck export rssr --to mj", "mjcf"),
        ("kincheck bench engines --rou", "--rounds"),
    ):
        told = subprocess.run(
            ["bash", "-c", TRY.format(script=script, words=words)], capture_output=True, text=True
        )
        assert sorted(told.stdout.split()) == sorted(expected.split())


@pytest.mark.parametrize(
    "argv",
    [
        ["list", "--schema"],
        ["list", "--joints"],
        ["list", "--outputs"],
        pytest.param(["stress", "--list"], marks=pytest.mark.needs("laboratory")),
    ],
    ids=" ".join,
)
def test_lists_keep_words_within_console_width(argv, capsys, monkeypatch):
    def words(width):
        monkeypatch.setenv("COLUMNS", str(width))
        assert main(argv) == 0
        lines = capsys.readouterr().out.splitlines()
        assert max(map(len, lines)) <= width or width == 200
        return sorted(" ".join(lines).split())

    assert words(60) == words(80) == words(100) == words(200)


@pytest.mark.parametrize("width", [60, 80, 100])
def test_verbose_and_history_tables_fit_console(
    kincheck_main, tmp_path, capsys, monkeypatch, width
):
    monkeypatch.setenv("COLUMNS", str(width))
    history = ("--history", tmp_path / "runs.sqlite")
    engines = [RIGHT, Fake("a-twin-with-a-long-name")]
    assert kincheck_main("run crank --verbose", *history, engines=engines) == 0
    out = capsys.readouterr().out
    assert kincheck_main("history", *history, engines=engines) == 0
    assert kincheck_main("history --case crank", *history, engines=engines) == 0
    assert max(map(len, (out + capsys.readouterr().out).splitlines())) <= width
    assert out.count("0.0e+00 of ") == 12  # two outputs of two engines, three orders each


VARIED = """
schema = "kincheck-vary/1"
mode = "monte_carlo"

[hardpoints.mass]
at = "bodies.door.mass"
half_width = 0.1
"""


@pytest.mark.needs("sweep")
def test_undetermined_force_is_explained(tmp_path, capsys):
    (case := tmp_path / "two_hinges.toml").write_text(UNDETERMINED)
    main(f"run {case} --engine native -v".split())
    assert "hinge: samples without a value are null; rigid bodies do not" in capsys.readouterr().out
    (varied := tmp_path / "mass.toml").write_text(VARIED)
    assert main(f"sweep {case} --vary {varied} --samples 4 -q".split()) == 0
    out = capsys.readouterr().out
    assert "no variant has a value of hinge; kincheck run CASE --engine native --verbose" in out
    assert "None" not in out


@pytest.mark.needs("hardpoints")
def test_repr_of_case_is_one_line():
    case = cases.load("mcpherson_suspension")
    assert any(point.name.startswith("~") for point in case.mechanism.points)
    assert "~" not in repr(case.mechanism)
    assert "strut_slide" in repr(case.mechanism)
    assert repr(case).startswith("<Case: mcpherson_suspension (in house oracle); 33 samples of ")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("revolut", "did you mean 'revolute'?; write MODULE:CLASS"),
        ("gear", "'gear' couples two other joints"),
    ],
)
def test_check_joint_unknown_type_is_refused(name, said, capsys):
    assert main(["check-joint", name]) == 2
    assert said in capsys.readouterr().err


def test_check_joint_finds_built_in_type():
    assert named_joint("revolute") is Revolute
