"""Programs of any language as engines: what they are given, what they answer, how they fail."""

import shutil
import subprocess
import sys

import pytest
from kincheck.core.cli.main import main

from ...support.crank import MECHANISM
from ...support.examples import examples

FAILING, CRANK = examples(__file__, "failing", "crank")

CASE = f"""{MECHANISM}[sweep]
driver = "turn"
start = -1.0
stop = 1.0
steps = 21
rate = 2.0
"""
POSES = """
import csv, math, sys
rows = list(csv.DictReader(open(sys.argv[1])))
out = open(sys.argv[2], "w")
print("crank.x,crank.y,crank.z,crank.e0,crank.e1,crank.e2,crank.e3", file=out)
for row in rows:
    x = float(row["turn"]) / 2 + {error}
    print(f"0,0,{lift},{{math.cos(x)!r}},0,0,{{math.sin(x)!r}}", file=out)
"""


@pytest.fixture
def judged(last_record, tmp_path):
    """Returns status and record of a program, a command or the text of a Python program."""

    def run(program, words="{samples} {out}", *options):
        case, file = tmp_path / "crank.toml", tmp_path / "crank.py"
        case.write_text(CASE)
        command = program
        if "\n" in program:
            file.write_text(program)
            command = f"{sys.executable} {file}"
        jobs = None if "--jobs" in options else "0"
        return last_record(case, "--engine-command", f"{command} {words}", *options, jobs=jobs)

    return run


def test_c_program_as_engine_passes(judged, tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    source, program = tmp_path / "crank.c", tmp_path / "crank"
    source.write_text(CRANK)
    subprocess.run([compiler, source, "-o", program, "-lm"], check=True)
    status, record = judged(str(program))
    errors = record["errors"]
    assert (status, record["engine"], record["mode"]) == (0, "crank", "simulate")
    assert errors["tip.x"]["acceleration"]["max_abs"] < 1e-15
    assert errors["tip.y"]["position"]["max_abs"] < 1e-15
    assert errors["tip.z"]["position"] is None


@pytest.mark.parametrize(("error", "lift", "outcome"), [(0, 0, "pass"), (1e-6, 0, "fail")])
def test_program_with_poses_is_judged(judged, error, lift, outcome):
    _, record = judged(POSES.format(error=error, lift=lift))
    assert record["outcome"] == outcome


def test_program_pose_violating_joint_fails(judged):
    status, record = judged(POSES.format(error=0, lift="0.0000001"))
    assert status == 1
    assert "gap of 1e-07 m in pivot at sample 0 (crank)" in record["message"]


def test_program_reads_case_and_samples(judged):
    program = """
import csv, sys, tomllib
case = tomllib.load(open(sys.argv[1], "rb"))
rows = list(csv.reader(open(sys.argv[2])))
assert case["sweep"] == {"driver": "turn", "start": -1.0, "stop": 1.0, "steps": 21, "rate": 2.0}
assert rows[0] == ["time", "turn", "turn.velocity", "turn.acceleration"]
assert [float(x) for x in rows[1]] == [-0.5, -1.0, 2.0, 0.0]
sys.exit(3)
"""
    _, record = judged(program, "{case} {samples} {out}")
    assert (record["outcome"], record["message"]) == ("unsupported", "crank refuses the case")


@pytest.mark.parametrize(("program", "text"), FAILING)
def test_failing_program_is_an_error(judged, program, text):
    _, record = judged(program)
    assert record["outcome"] == "error"
    assert text in record["message"]


def test_program_samples_without_values_are_unsolved(judged):
    program = """
import sys
open(sys.argv[2], "w").write("tip.z,tip.x\\n" + "0,\\n" * 20 + "nan,nan\\n")
"""
    status, record = judged(program)
    assert (status, record["solved"]) == (1, 20)
    assert "gives no values at 1 sample" in record["message"]


@pytest.mark.parametrize("words", ["{samples}", "{samples} {out} {other}", "{out} {"])
def test_malformed_engine_command_is_refused(judged, capsys, words):
    assert judged("prog", words)[0] == 2
    assert 'Say --engine-command "prog {case} {samples} {out}"' in capsys.readouterr().err


def test_missing_program_is_refused(judged, capsys):
    assert main(["run", "five_bar", "--engine-command", "no-such-program {case} {out}"]) == 2
    assert "there is no program 'no-such-program' that can be run" in capsys.readouterr().err


def test_slow_program_times_out(judged):
    program = "import time\ntime.sleep(100)"
    _, record = judged(program, "{out}", "--jobs", "1", "--timeout", "3")
    assert record["outcome"] == "timeout"
