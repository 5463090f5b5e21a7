"""Joint types of users on the command line: in case files, in check-joint, and what is refused."""

import importlib
import math
import os
import re
import sys
from pathlib import Path

import kincheck.core
import pytest
from kincheck.core import Joint
from kincheck.core.cli.main import main
from kincheck.core.harness.results_file import read_results

pytestmark = pytest.mark.usefixtures("own_joint_types")


# In case files

SLOT = """
schema = "kincheck-case/1"
name = "slot"
source = "made up"
[bodies.block]
[bodies.crank]
[joints.guide]
type = "translational"
bodies = ["ground", "block"]
point = [0, 0, 0]
axis = [0, 1, 0]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[joints.slot]
type = "pin_in_slot"
bodies = ["block", "crank"]
point = [0.5, 0, 0]
axes = [[1, 0, 0], [0, 0, 1]]
[points.tip]
body = "block"
position = [0, 0, 0]
[drivers.turn]
type = "joint_angle"
joint = "pivot"
[sweep]
driver = "turn"
start = -0.5
stop = 0.5
steps = 5
"""


def test_case_file_uses_joint_type_option(in_folder, capsys, tmp_path, monkeypatch):
    """A Scotch yoke: the block is where the pin's height is, 0.5 sin(turn)."""
    monkeypatch.delitem(Joint.registry, "pin_in_slot", raising=False)
    monkeypatch.delitem(sys.modules, "pin_in_slot", raising=False)
    file, out = tmp_path / "slot.toml", tmp_path / "slot.json"
    file.write_text(SLOT)
    run = f"run {file} --engine native pinocchio --json {out}".split()
    assert main(run) == 2
    assert "joints.slot.type: found 'pin_in_slot', expected a joint type" in capsys.readouterr().err
    given = ["--joint-type", "pin_in_slot:PinInSlot"]
    assert main([*run, *given]) == 0
    native, other = read_results(out).records
    expected = [0.5 * math.sin(angle) for angle in native.driver["turn"]]
    assert native.outputs["tip.y"].position == pytest.approx(expected, abs=1e-15)
    assert other.outcome == "pass"  # by the equivalent
    assert other.outputs["tip.y"].position == pytest.approx(expected, abs=1e-12)
    capsys.readouterr()
    assert main(["list", "--joints", *given]) == 0
    assert re.search(
        r"^  pin_in_slot +point, axes +4 rows  2 free: slide, turn +Body i has",
        capsys.readouterr().out,
        re.MULTILINE,
    )
    assert main(f"explain {file} --joint-type pin_in_slot:PinSlot".split()) == 2
    assert (
        capsys.readouterr().err
        == "kincheck: module 'pin_in_slot' has no class 'PinSlot'; did you mean 'PinInSlot'?\n"
    )


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (
            'type = "revolute"',
            (
                "is taken by kincheck.core.joints.revolute.Revolute; give it another name (own.py,"
                " line 2: class Mine("
            ),
        ),
        (
            'type = "gear"',
            "own:Mine: the type 'gear' belongs to joints that couple two others. Give it another",
        ),
        (
            "pass",
            (
                'own:Mine has no type, the name of such joints in case files. Write type = "..."'
                " in the class"
            ),
        ),
    ],
)
def test_check_joint_refuses_unusable_type_name(monkeypatch, tmp_path, capsys, body, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", ["", *sys.path])
    monkeypatch.delitem(sys.modules, "own", raising=False)
    Path("own.py").write_text(f"from kincheck.core import Joint\nclass Mine(Joint):\n    {body}\n")
    importlib.invalidate_caches()
    for argv in (["check-joint", "own:Mine"], "list --joints --joint-type own:Mine".split()):
        assert main(argv) == 2
        said = capsys.readouterr().err
        assert message in said.replace(f"{tmp_path}{os.sep}", ""), said


# The command


def test_command(few, in_folder, capsys):
    assert main("check-joint pin_in_slot:PinInSlot --seed 1".split()) == 0
    said = capsys.readouterr().out
    assert "spurious branches" in said
    assert "(seed 1)" in said


def test_command_tells_of_a_failure(loops_only, monkeypatch, capsys, tmp_path):
    text = (Path(__file__).parents[1] / "user_joints" / "pin_in_slot.py").read_text(
        encoding="utf-8"
    )
    text = text.replace('("slide", "turn")', '("slide",)')
    (tmp_path / "faulty_joint.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["check-joint", "faulty_joint:PinInSlot"]) == 1
    said = capsys.readouterr().out
    assert (
        "freedoms: leaves 2, names 1: slide; name each freedom that is left, or add the missing row"
        in said
    )


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("no_such_module:Joint", "no module 'no_such_module'"),
        ("rzeppa", "write MODULE:CLASS"),
        ("rzeppa:Rzepa", "did you mean 'Rzeppa'"),
        ("rzeppa:Nothing", "its joints: Rzeppa"),
        ("rzeppa:np", "is no joint type"),
        ("kincheck.core:Revolut", "did you mean 'Revolute'?"),
        (
            "kincheck.core:Xyz",
            "its joints: ConstantVelocity, Cylindrical, Distance, Fixed, InPlane, Inline, ",
        ),
        (".rzeppa:Rzeppa", "module '.rzeppa' cannot be imported: TypeError: "),
    ],
)
def test_check_joint_refuses_unknown_module_or_class(in_folder, capsys, where, message):
    assert main(["check-joint", where]) == 2
    assert message in capsys.readouterr().err


RAISING = "def f():\n    return 1 / 0\n\nf()\n"
ENDLESS = "def f():\n    f()\n\nf()\n"
REFUSED = (
    'from kincheck.core import Spherical\nball = Spherical("ball", "a", "a", (0.0, 0.0, 0.0))\n'
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def f(:\n    pass\n",
         "SyntaxError: invalid syntax ({file}, line 1: def f(:). Correct it."),
        ("\nx = 1\n  y = 2\n",
         "IndentationError: unexpected indent ({file}, line 3: y = 2). Correct it."),
        (RAISING, "ZeroDivisionError: division by zero ({file}, line 2: return 1 / 0, called"
                  " from {file}, line 4: f()). "),
        ("import nowhere_to_be_found\n",
         "No module named 'nowhere_to_be_found' ({file}, line 1: import nowhere_to_be_found). "),
        ("import brok\n", "No module named 'brok' ({file}, line 1: import brok). Correct it."),
        ("import broken_too\n", "was never closed ({too}, line 2: x = (, called from {file},"
                                " line 1: import broken_too). "),
        (ENDLESS, "{file}, line 2: f(), called from {file}, line 2: f(), called from {file},"
                  " line 4: f()). "),
        (REFUSED, "joins 'a' with itself; a joint needs two different bodies ({file}, line 2:"
                  " ball = Spherical("),
    ],
    ids=["syntax", "indent", "raises", "needs", "needs a name that begins its own", "imports",
         "recursion", "refused"],
)  # fmt: skip
def test_failing_joint_module_reports_its_line(tmp_path, monkeypatch, capsys, text, said):
    file, too = tmp_path / "broken_joint.py", tmp_path / "broken_too.py"
    file.write_text(text, encoding="utf-8")
    too.write_text("y = 1\nx = (\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check-joint", "broken_joint:Own"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("kincheck: module 'broken_joint' cannot be imported: ")
    assert said.format(file=file, too=too) in line
    assert str(Path(kincheck.core.__file__).parent) not in line


def test_joint_module_that_exits_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "ends_at_once.py").write_text("import sys\nsys.exit(0)\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check-joint", "ends_at_once:Joint"]) == 2
    assert (
        "module 'ends_at_once' ends the process when it is imported (status 0)"
        in capsys.readouterr().err
    )
