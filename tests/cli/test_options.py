"""Options that are wrong, would be ignored, or destroy each other's files are refused, before
anything is computed.
"""

import kincheck
import pytest
from kincheck.core.case.io.atomic_files import unwritable
from kincheck.core.cli.main import every_command, main

from ..support.case_texts import at_hand, rows

COMMANDS = every_command()
VARY = """
schema = "kincheck-vary/1"
mode = "monte_carlo"
units.length = "mm"
[hardpoints.ball]
at = "ball"
sigma = 1.0
"""

REFUSED = """
assemblies rssr --number 2 | --number: only an export uses it. Add --export
assemblies rssr --out x.xml --number 1 | --number, --out: only an export
assemblies rssr --export mjcf --number 0 | '0' is not a whole number of 1 or more
explain rssr --samples 0 | '0' is not a whole number of 1 or more
explain rssr --samples -1 | '-1' is not a whole number of 1 or more
stress --list --seed 0 --out x | --list runs nothing. Leave out --seed, --out
stress --list --replay x.toml --no-proofs | --list runs nothing. Leave out --no-proofs, --replay
stress --list --engine native --mode projection | --list runs nothing. Leave out --engine, --mode
stress --replay x.toml --seed 0
    | --replay judges files, which belong to no family. Leave out --seed
stress --replay x.toml --samples 2000 --no-proofs --family units
    | Leave out --family, --samples, --no-proofs
stress --family units --tol 1e-12
    | --tol is for replayed files, and families have their own tolerances. Leave it
run rssr --memory 1e300 | argument --memory: '1e300' is too large. Give 1e+09 at most.
run rssr --timeout 2e9 | argument --timeout: '2e9' is too large. Give 1e+09 at most.
run rssr --out= | argument --out: found an empty name; give one, or leave it out
run --joints rssr --reactions | --reactions: the loops of --joints have no masses
kc rssr --travel -60mm:60mm:5 | rssr: no point is the wheel's centre
kc rssr --jobs 0 --timeout 5 --engine native | cannot be limited. Leave out --timeout
run rssrr | did you mean 'rssr'? Case files end in
sweep rssr --vary x --sampling ltin
    | 'ltin' is none of random, latin, sobol; did you mean 'latin'?
sweep rssr --vary x --order x | 'x' is none of 0, 1, 2
stress --family unit | there is no family 'unit'; did you mean 'units'?
stress --engine nativ | there is no engine 'nativ'
stress --samples 0 | '0' is not a whole number of 1 or more
serve rssr --port abc | --port: 'abc' is not a whole number of 0 or more
run rssr --accuracy 0.02 --signs iso8855
    | --signs, --accuracy: for a measured curve, and there is none; add --reference FILE
serve rssr --accuracy 0.02 | --accuracy: for a measured curve, and there is none
stress --replay nowhere.toml | no such file
stress --tol -1 | is not a positive number
sweep mcpherson_strut --vary vary.toml --samples 0 | '0' is not a whole number of 1 or more
sweep mcpherson_strut --vary vary.toml
    | monte_carlo draws as many variants as it is told. Give --samples
sweep mcpherson_strut --vary vary.toml --samples 5 --check mujocco
    | there is no engine 'mujocco'; did you mean 'mujoco'?
sweep mcpherson_strut --vary vary.toml --samples 5 --check native:2
    | --check native:2: found the share '2', expected a fraction
sweep mcpherson_strut --vary vary.toml --samples 5 --output toe
    | there is no output 'toe'; known: half_track_change, wheelbase_change
sweep mcpherson_strut --vary vary.toml --samples 5 --replay 3
    | --replay: seed and index identify a variant. Leave out --samples
sweep mcpherson_strut --vary vary.toml --replay 3 --store x.parquet
    | in this process and stores nothing
sweep mcpherson_strut --vary vary.toml --samples 5 --jobs 2 --scheduler tcp://127.0.0.1:1
    | the cluster decides the number of threads
sweep mcpherson_strut --vary vary.toml --samples 5 --store no/such/folder.parquet
    | cannot be written; give a file in a folder that exists
sweep mcpherson_strut --vary vary.toml --samples 5 --limit half_track_change:1
    | --limit: found 'half_track_change:1', expected OUTPUT:
sweep mcpherson_strut --vary vary.toml --samples 5 --limit toe:0:1
    | --limit toe:0:1: there is no output 'toe'
sweep mcpherson_strut --vary vary.toml --samples 5 --limit half_track_change:a:b
    | expected OUTPUT:LOW:HIGH
sweep mcpherson_strut --vary vary.toml --sampling latin --replay 1
    | a Latin hypercube depends on the number of variants. Give --samples
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
