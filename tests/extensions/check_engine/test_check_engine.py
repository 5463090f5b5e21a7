"""check-engine: a sound engine passes, each planted fault is found, and engines from outside enter
by module and class, or by an entry point.
"""

from importlib.metadata import EntryPoint
from pathlib import Path

import kincheck
import kincheck.adapters
import kincheck.cases
import numpy as np
import pytest
from kincheck import Gear, Planar, Screw, Universal
from kincheck.core.case.joint_probe import probe
from kincheck.core.cli import class_loading, main
from kincheck.core.extensions.check_engine import check as checking
from kincheck.core.extensions.check_engine import engine_cases as force_cases
from kincheck.core.extensions.check_engine.check import rates
from kincheck.core.harness.execution import solve_in_process
from kincheck.core.harness.run import run
from kincheck.core.studies.checks.findings import Verdict

from ...support.engine_faults import HARMLESS, OF_FORCES, OF_MOTION, Wrapped
from ...support.fakes import Fake, crank, swept
from ...support.faulty_engine import Odd, Shy, Sound

ROOT = Path(__file__).parents[3]
HERE = "tests.support.faulty_engine"


def reduce(patch, *joint_types, force_type):
    """Check these joint types, forces by one, and one topology."""
    patch.setattr(checking, "probes", lambda: [probe(each) for each in joint_types])
    patch.setattr(force_cases, "probes", lambda: [probe(force_type)])
    patch.setattr("kincheck.core.extensions.check_engine.command.TOPOLOGIES", {"one loop": "rssr"})


@pytest.fixture
def few(patch):
    """Modules of the tests are found by workers."""
    patch.syspath_prepend(str(ROOT))
    reduce(patch, Screw, Planar, Gear, force_type=Screw)


@pytest.fixture
def in_process(patch):
    """Without worker processes: the checks that a faulty engine passes have them."""
    patch.setattr(checking, "in_workers", lambda *_: solve_in_process)


def failures(engine):
    report = kincheck.check_engine(engine)
    return {each.check for each in report.findings if each.verdict is Verdict.FAIL}


def test_check_engine_of_sound_engine_passes(few, in_process):
    report = kincheck.check_engine(Sound())
    assert {each.verdict for each in report.findings} == {Verdict.PASS}
    assert [each.check for each in report.findings] == [
        "protocol",
        "isolation: pickle",
        "version",
        "joint: screw",
        "joint: planar",
        "joint: gear",
        "topology: one loop",
        "topology: uneven drives",
        "forces: screw",
        "forces: elements",
        "forces: drivers",
        "forces: turns",
        "forces: undetermined",
        "rates: velocity",
        "rates: acceleration",
        "refusal: beyond a fold",
        "refusal: unknown joint",
        "determinism",
    ]
    assert str(report).endswith("sound: 18 pass\n")


def test_check_engine_faults_fail_their_rows(few, capsys):
    assert main.main(["check-engine", f"{HERE}:Faulty"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert {line.split("  ")[0] for line in lines if "  fail " in line} == {
        "joint: screw",
        "joint: planar",
        "rates: acceleration",
        "refusal: beyond a fold",
        "refusal: unknown joint",
        "determinism",
    }
    said = "\n".join(lines)
    assert "planar: tip_" in said
    assert "has values at samples that cannot be reached; mark them unsolved" in said
    assert "KeyError: 'unknown_to_engines'; unsupported() is to return the reason" in said
    assert "determinism: keeps a state from one case to the next" in said
    assert lines[-1] == "faulty: 12 pass, 6 fail"


def test_check_engine_stops_on_protocol_error(few):
    assert failures(Odd()) == {"protocol", "isolation: pickle"}
    message = kincheck.check_engine(Odd())["protocol"].message
    assert "mode is 'magic', expected projection or simulate" in message
    assert failures(Shy()) == {"version"}


@pytest.mark.parametrize(
    ("where", "message"),
    [
        (f"{HERE}:Fauly", "has no class 'Fauly'; did you mean 'Faulty'?"),
        ("tests.support.engine_faults:Trajectory", "Trajectory cannot be created: TypeError"),
        (
            "tests.support.engine_faults:np",
            "np is no engine: name, mode, loop, settings, unsupported, build, solve missing",
        ),
        ("tests.nothing:Sound", "there is no module 'tests.nothing'"),
        ("mujocco", "there is no engine 'mujocco'; did you mean 'mujoco'?"),
    ],
)
def test_check_engine_refuses_class_without_protocol(monkeypatch, capsys, where, message):
    monkeypatch.syspath_prepend(str(ROOT))
    assert main.main(["check-engine", where]) == 2
    assert message in capsys.readouterr().err


def test_engine_by_module_and_class(monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(ROOT))
    assert main.main(["run", "--jobs", "0", "--engine", f"{HERE}:Sound", "rssr"]) == 0
    assert "rssr  sound   pass" in capsys.readouterr().out


def test_named_engine_class_not_installed_fails(monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(ROOT))
    for option in ("--engine", "--require"):
        argv = ["run", "rssr", "--jobs", "0", "--engine", "native", option, f"{HERE}:Shy"]
        assert main.main(argv) == 2
        assert "engine 'shy'" in capsys.readouterr().err


@pytest.fixture
def offered(monkeypatch):
    """Entry points of other packages, by name."""

    def offer(**points):
        made = {
            name: EntryPoint(name, value, class_loading.GROUP) for name, value in points.items()
        }
        monkeypatch.setattr(class_loading, "entry_points", lambda group: made)
        monkeypatch.syspath_prepend(str(ROOT))

    return offer


def test_entry_points_offer_engines(offered, capsys):
    offered(sound=f"{HERE}:Sound", broken="tests.nothing:Engine")
    assert "sound" in main.registry().engines
    assert main.main("run rssr --jobs 0 --engine sound".split()) == 0
    assert main.main("run rssr --jobs 0 --engine broken".split()) == 2
    assert "No module named 'tests.nothing'" in capsys.readouterr().out


def test_entry_point_with_builtin_name_refused(offered, capsys):
    offered(mujoco=f"{HERE}:Sound")
    assert main.main("run rssr --engine native".split()) == 2
    assert "offers an engine named 'mujoco', which is kincheck's own" in capsys.readouterr().err


def test_entry_point_group_is_kincheck_engines(monkeypatch):
    asked = []

    def entry_points(*, group):
        asked.append(group)
        return [EntryPoint("own", "own:Own", group)]

    class_loading.entry_points.cache_clear()
    monkeypatch.setattr("importlib.metadata.entry_points", entry_points)
    assert class_loading.names_of_entry_points(["native"]) == ("own",)
    assert asked == ["kincheck.engines"]
    class_loading.entry_points.cache_clear()


@pytest.mark.parametrize(("samples", "compared"), [(21, False), (22, True)])
def test_rates_of_short_sweeps_are_skipped(samples, compared):
    """Three times as many steps as a difference has weights."""
    case = crank(reference=False)
    case = swept(case, np.linspace(-1.0, 1.0, samples))
    solved = [(case, record) for record in run([case], [Fake()], tol=1e-12).records]
    assert {each.verdict for each in rates(solved)} == {Verdict.PASS if compared else Verdict.SKIP}


# Engines with one fault each


@pytest.fixture
def two(in_process, patch):
    reduce(patch, Screw, Universal, force_type=Universal)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("fault", OF_MOTION)
def test_check_engine_finds_fault_of_motion(fault, two, patch):
    patch.setattr(checking, "force_cases", list)
    assert failures(Wrapped(fault))


@pytest.mark.by_day(3)
@pytest.mark.parametrize("fault", OF_FORCES)
def test_check_engine_finds_fault_of_forces(fault, two, patch):
    patch.setattr(checking, "probes", list)
    patch.setattr("kincheck.core.extensions.check_engine.command.TOPOLOGIES", {})
    found = failures(Wrapped(fault))
    assert any(check.startswith("forces: ") for check in found)
    assert not any(check.startswith(("rates: ", "refusal: ")) for check in found)


@pytest.mark.by_day(3)
@pytest.mark.parametrize("change", ["no fault, with bodies", "", *HARMLESS])
def test_check_engine_passes_harmless_changes(change, two):
    assert failures(Wrapped(change)) == set()


@pytest.mark.needs("recorded")
def test_check_engine_takes_one_engine():
    with pytest.raises(kincheck.KincheckError, match="Name one engine to check"):
        kincheck.check_engine("native", engine_command="x")
