"""Options that are wrong, would be ignored, or destroy each other's files are refused, before
anything is computed.
"""

import kincheck
import pytest
from kincheck.core.case.io.atomic_files import unwritable
from kincheck.core.cli.main import every_command, main

from ..support.case_texts import at_hand, rows
from ..support.examples import examples

(REFUSED,) = examples(__file__, "refused")

COMMANDS = every_command()
VARY = """
schema = "kincheck-vary/1"
mode = "monte_carlo"
units.length = "mm"
[hardpoints.ball]
at = "ball"
sigma = 1.0
"""

ONE_FILE = """
run rssr --json a --junit a | --junit | --json
run rssr --junit a --markdown ./no/../a | --markdown | --junit
run rssr --markdown link --json a | --markdown | --json
run rssr --out no --json no/results.json | --json | --out
run rssr --history a --json a | --json | --history
sweep mcpherson_strut --vary vary.toml --samples 3 --store a --json a | --store | --json
sweep mcpherson_strut --vary vary.toml --samples 3 --out no --json no/envelope.csv | --json
    | --out
report a --junit b --markdown b | --markdown | --junit
report --history a --json a | --json | --history
history --history a --export a | --export | --history
history --history a --plot b.csv --export b.csv | --export | --plot
stress --out no --json no/stress.json | --json | --out
bench formulation --out no --json no/bench_formulation.html | --json | --out
assemblies rssr --export mjcf --json a --out a | --out | --json
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """In a folder with a file, a link to it, a folder, and what varies of a strut."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("KINCHECK_HISTORY", raising=False)
    (tmp_path / "a").write_text("here before")
    (tmp_path / "link").symlink_to("a")
    (tmp_path / "no").mkdir()
    (tmp_path / "vary.toml").write_text(VARY)
    return tmp_path


@pytest.mark.parametrize(("line", "said"), at_hand(rows(REFUSED, named=False), COMMANDS))
def test_invalid_command_lines_are_refused(line, said, here, capsys):
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert (out, said in err) == ("", True), err
    assert "Traceback" not in err


def test_run_in_python_takes_iterables():
    found = kincheck.run((each for each in ["rssr"]), {"native"}, tol=None, supplied=None)
    assert [(each.case, each.engine) for each in found.records] == [("rssr", "native")]
    assert found.run["tol"] == 1e-12


def test_option_abbreviation_is_unique_prefix(capsys):
    assert main("run rssr --eng native -q".split()) == 0
    assert capsys.readouterr().out == "1 pass\n"
    assert main("run rssr --re native".split()) == 2
    assert "ambiguous option: --re could match --reference, --require" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "option", "other"), at_hand(rows(ONE_FILE, named=False), COMMANDS)
)
def test_shared_output_file_is_refused(line, option, other, here, capsys):
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    (said,) = err.splitlines()
    assert out == ""
    assert said.startswith(f"kincheck: {option} ")
    assert said.endswith(f": found the file of {other}, expected one of its own. Give another")
    assert (here / "a").read_text() == "here before"
    assert not [*(here / "no").iterdir()]


@pytest.mark.needs("exports", "writers", "assemblies")
def test_export_constraints_file_keeps_json(here, capsys):
    line = "assemblies four_bar --samples 8 --export urdf --out x.urdf --json x.constraints.json"
    assert main(line.split()) == 2
    assert "--out x.constraints.json: found the file of --json" in capsys.readouterr().err
    assert '"kincheck-assemblies/1"' in (here / "x.constraints.json").read_text()
    assert not (here / "x.urdf").exists()


def test_devices_take_several_outputs():
    options = ["--json /dev/null", "--junit /dev/null", "--store -", "--out -"]
    assert unwritable([("--plot", None), *(tuple(each.split()) for each in options)]) == []


def test_largest_memory_and_time_limits_run(capsys):
    assert main("run rssr --engine native --jobs 1 --memory 1e9 --timeout 1e9".split()) == 0
    assert "1 pass" in capsys.readouterr().out
