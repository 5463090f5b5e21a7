"""check-joint: what is checked, the command, the identity of joint types, and mutants of joints."""

import dataclasses
import importlib
import math
import os
import random
import re
import shutil
import sqlite3
import sys
import tomllib
import types
import warnings
from dataclasses import dataclass
from pathlib import Path

import kincheck.core
import pytest
from kincheck import (
    Body,
    Gear,
    InPlane,
    Joint,
    KincheckError,
    MechanismError,
    Revolute,
    Spherical,
    Universal,
    adapters,
    check_joint,
    clear_caches,
)
from kincheck.core import primitives as p
from kincheck.core.cli.joint_loading import load_joint, sources
from kincheck.core.cli.main import main
from kincheck.core.harness.results_file import read_results
from kincheck.core.joints import AxialJoint
from kincheck.core.studies.checks.findings import Verdict

from ..support.examples import examples
from ..support.fakes import Fake, native_but
from ..support.joint_mutants import mutants
from .test_check_joint_mistakes import mistaken

UNKNOWN, USERS = examples(__file__, "unknown", "users")

JOINTS = Path(__file__).parents[1] / "user_joints"
BUILT_IN = sorted(
    name for name, joint in Joint.registry.items() if joint.__module__.startswith("kincheck.")
)
WITHOUT_EQUIVALENT = ("bowl", "point_on_parabola", "line_no_twist", "torus")


pytestmark = pytest.mark.usefixtures("own_joint_types")


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", BUILT_IN)
def test_check_joint_passes_builtin_joints(few, name):
    report = check_joint(Joint.registry[name], samples=8)
    assert report.passed, report
    assert len({each.check for each in report.findings}) == len(report.findings)


@pytest.mark.by_day(2)
@pytest.mark.parametrize("module", USERS)
def test_check_joint_passes_user_joints(few, in_folder, module):
    engines = [adapters.engine(name) for name in adapters.ENGINES]
    report = check_joint(load_joint(f"{module}:{USERS[module]}"), samples=8, engines=engines)
    assert report.passed, report
    verdicts = {
        engine.name: report[f"loop: {engine.name}"] for engine in engines if engine.name != "native"
    }
    if module in WITHOUT_EQUIVALENT:
        assert all(
            "no equivalent() to solve" in each.message or "not installed" in each.message
            for each in verdicts.values()
        )
        assert {each.verdict for each in verdicts.values()} == {Verdict.SKIP}
    else:
        assert report["loop: native, equivalent"].verdict is Verdict.PASS
        assert all(
            each.message in ("on the equivalent", "not installed") for each in verdicts.values()
        )


def test_check_joint_locked_loops_unjudged(loops_only, in_folder, monkeypatch):
    """All loops with the torus lock up before their sweep ends."""
    monkeypatch.setattr("kincheck.core.studies.checks.joint_loops.HALVINGS", 0)
    report = check_joint(load_joint("torus:Torus"))
    assert report.passed, report
    assert report["loop"].verdict is Verdict.SKIP
    assert report["loop"].message.startswith("not judged, the loop of this check fails: ")


def test_check_joint_loop_large_residual_fails(loops_only):
    loose = native_but(lambda found, case: dataclasses.replace(found, residual=1e-3), "loose")
    found = check_joint(Revolute, engines=[loose])["loop: loose"]
    assert found.verdict is Verdict.FAIL
    assert (
        "the residual of samples that the engine calls solved is 0.001, tolerance 1e-12"
        in found.message
    )


def test_check_joint_loop_without_derivatives_noted(loops_only):
    def without_rates(found, case):
        bare = {
            name: dataclasses.replace(each, velocity=None, acceleration=None)
            for name, each in found.points.items()
        }
        return dataclasses.replace(found, points=bare)

    found = check_joint(Revolute, engines=[native_but(without_rates, "bare")])["loop: bare"]
    assert found.verdict is Verdict.PASS
    assert "not judged: velocity: the engine gives none" in found.message


# Specimens


def test_check_joint_specimens_given_or_offered(loops_only):
    one = Universal("u", "a", "ground", (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    given = check_joint(Universal, specimens=[one])
    assert given.passed, given
    assert given.specimens == (repr(one),)
    values = [getattr(one, each.name) for each in dataclasses.fields(one)]
    offered = check_joint(mistaken(Universal, specimens=classmethod(lambda cls: [cls(*values)])))
    assert offered.passed, offered
    assert len(offered.specimens) == 1


def test_check_joint_seed_repeats_findings(few):
    first, again, other = (check_joint(Spherical, seed=seed, samples=4) for seed in (3, 3, 4))
    assert first == again
    assert first.findings != other.findings


def test_check_joint_without_specimen_is_refused():
    @dataclass(frozen=True)
    class Odd(AxialJoint):
        type = "odd"
        freedoms = ()
        teeth: int

        def primitives(self, i, j):
            return (p.Dot12(),)

    with pytest.raises(
        KincheckError,
        match=r"field 'teeth' has no kind. Declare it by .* or offer some by a classmethod",
    ):
        check_joint(Odd)
    with pytest.raises(KincheckError, match="no specimens were offered"):
        check_joint(Revolute, specimens=[])


def test_failing_equivalent_is_reported_as_error(loops_only):
    def equivalent(self):
        raise ValueError("no such bodies")

    lame = Fake("lame", refusal="unknown joint")
    report = check_joint(mistaken(Revolute, equivalent=equivalent), engines=[lame])
    assert report["loop: native, equivalent"].message == "ValueError: no such bodies"
    assert report["loop: lame"].message == "unknown joint; equivalent() fails, see native"
    assert (
        "there is no equivalent()"
        in check_joint(mistaken(Revolute), engines=[lame])["loop: lame"].message
    )


def test_joint_type_name_in_use_refused():
    with pytest.raises(
        MechanismError,
        match=r"Mine: type = 'revolute' is taken by kincheck.core.joints.revolute.Revolute; give",
    ):
        type("Mine", (Revolute,), {"type": "revolute"})
    assert Joint.registry["revolute"] is Revolute
    with pytest.raises(
        MechanismError, match=r"type = 'gear' is taken by kincheck.core.joints.gear.Gear"
    ):
        type("Mine", (Gear,), {"type": "gear"})
    first, second = (
        dataclass(frozen=True, slots=True)(type("Mine", (Revolute,), {"type": "mine"}))
        for _ in range(2)
    )
    assert Joint.registry["mine"] is second is not first


def test_check_joint_report_names_unchecked(few):
    report = check_joint(InPlane)
    skipped = {each.check: each.message for each in report.findings if each.verdict is Verdict.SKIP}
    assert set(skipped) == {
        *("exchange", "mixed style", "driver", "loop: simulators", "driven reaction")
    }
    assert all(skipped.values())
    text = str(report)
    assert all(f"{check}: {message}" in text for check, message in skipped.items())
    assert str(Body("x")) not in text


# Joint types of users on the command line: in case files, in check-joint, and what is refused


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


@pytest.mark.needs("explain")
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


def test_check_joint_command_prints_and_saves(few, in_folder, capsys):
    assert main("check-joint pin_in_slot:PinInSlot --seed 1".split()) == 0
    said = capsys.readouterr().out
    assert "spurious branches" in said
    assert "(seed 1)" in said


def test_check_joint_command_reports_failure(loops_only, monkeypatch, capsys, tmp_path):
    text = (JOINTS / "pin_in_slot.py").read_text("utf-8")
    text = text.replace('("slide", "turn")', '("slide",)')
    (tmp_path / "faulty_joint.py").write_text(text, "utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["check-joint", "faulty_joint:PinInSlot"]) == 1
    said = capsys.readouterr().out
    assert (
        "freedoms: leaves 2, names 1: slide; name each freedom that is left, or add the missing row"
        in said
    )


@pytest.mark.parametrize(
    ("where", "message"),
    UNKNOWN,
)
def test_unknown_joint_module_or_class_refused(in_folder, capsys, where, message):
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
    file.write_text(text, "utf-8")
    too.write_text("y = 1\nx = (\n", "utf-8")
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


# A run is another one when the code of its joint types is: --resume never puts records of two


@pytest.fixture
def folder(tmp_path):
    shutil.copy(JOINTS / "pin_in_slot.py", tmp_path)
    text = (tmp_path / "pin_in_slot.py").read_text()
    (tmp_path / "pin_in_slot.py").write_text(
        "import beside\n" + text.replace("from __future__ import annotations\n", "")
    )
    (tmp_path / "beside.py").write_text("NUMBER = 1\n")
    (tmp_path / "elsewhere.py").write_text("NUMBER = 1\n")
    (tmp_path / "slot.toml").write_text(SLOT)
    return tmp_path


@pytest.fixture
def run(tmp_path, monkeypatch, own_joint_types, capsys):
    """Returns what a run says, in the folder of the modules, which each run imports anew."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", ["", *sys.path])

    def run(*arguments, status=2):
        for module in ("pin_in_slot", "beside", "mine"):
            monkeypatch.delitem(sys.modules, module, raising=False)
        importlib.invalidate_caches()
        clear_caches()
        found = main(["run", *arguments, "--jobs", "0", "--history", "h.sqlite"])
        said = capsys.readouterr().err
        assert found == status, said
        return said

    return run


def killed(folder):
    """Leave the last run of the history without an end."""
    connection = sqlite3.connect(folder / "h.sqlite")
    connection.execute("UPDATE runs SET status = 'interrupted'")
    connection.commit()
    connection.close()


EDITS = {
    "elsewhere.py": "run 1 is resumed after 1 records",
    "beside.py": "run 2 is new",
    "pin_in_slot.py": "run 3 is new",
}


SLOTTED = "slot.toml --joint-type pin_in_slot:PinInSlot --engine native".split()


def test_edited_joint_code_makes_new_run(folder, run):
    # only native knows the joint, so nothing is compared
    assert "nothing was compared" in run(*SLOTTED)
    for edited, expected in EDITS.items():
        killed(folder)
        (folder / edited).write_text((folder / edited).read_text() + "\n# edited\n")
        assert expected in run(*SLOTTED, "--resume"), edited


ENGINE = """import kincheck.adapters
native = kincheck.adapters.engine("native")

class Mine:
    name, mode, loop, settings = "mine", "projection", "compiled", {}
    version, unsupported = native.version, native.unsupported
    build, solve, in_process = native.build, native.solve, True
"""


def test_edited_engine_code_makes_new_run(tmp_path, run):
    """Whatever version it gives."""
    (tmp_path / "mine.py").write_text(ENGINE)
    command = ["four_bar", "--engine", "mine:Mine"]
    run(*command, status=0)
    killed(tmp_path)
    (tmp_path / "mine.py").write_text(ENGINE + "\n# edited\n")
    assert "run 2 is new" in run(*command, "--resume", status=0)


def test_sources_omit_installed_modules():
    assert sources([]) == {}
    found = sources([f"{__name__}:Nothing", "numpy", "kincheck.adapters.native"])
    assert __name__ in found
    assert not any(name.split(".")[0] in ("kincheck", "scipy", "pytest") for name in found)
    assert "numpy.linalg" not in found


# One-term mutants of joint types with equations of their own, and check-joint that finds them


SOURCE = (JOINTS / "telescope.py").read_text()
EVERY = dict(mutants(SOURCE))
CHOSEN, SEED = 16, 5
HARMLESS = tuple(
    name
    for names in tomllib.loads((JOINTS / "telescope_harmless.toml").read_text("utf-8")).values()
    for name in names
)
HARMFUL = sorted(name for name in EVERY if not name.startswith(HARMLESS))


@pytest.mark.by_day(4)
@pytest.mark.parametrize("mutant", random.Random(SEED).sample(HARMFUL, CHOSEN))
def test_check_joint_finds_one_term_mutant(mutant, own_joint_types, monkeypatch):
    module = types.ModuleType("mutant")
    monkeypatch.setitem(sys.modules, "mutant", module)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec(compile(EVERY[mutant], "mutant", "exec"), module.__dict__)
        reports = (check_joint(each, samples=8) for each in (module.Telescope, module.Threaded))
        assert any(not report.passed for report in reports)


@pytest.mark.nightly
def test_check_joint_passes_telescope_joints(own_joint_types, in_folder):
    from telescope import Telescope, Threaded

    assert check_joint(Telescope, samples=8).passed
    assert check_joint(Threaded, samples=8).passed
