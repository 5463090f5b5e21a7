"""The pytest plugin, in a repository of somebody else: pytest is run there, in this process, or in
one of its own where imports and processes are tested.
"""

import json
import re
import subprocess
import sys
import tomllib
from codecs import BOM_UTF8

import kincheck.core
import pytest
from kincheck import Outcome, Record
from kincheck.adapters import ENGINES
from kincheck.core.extensions.pytest_plugin import plugin as pytest_plugin

from ...support.case_texts import BASE, INLINE, edited

WRONG = INLINE.replace("1.4, 2.0", "1.4, 2.1")
PLAIN = "[project]\nname = 'theirs'\n# schema = 'kincheck-case/1' is said, and this is none\n"


@pytest.fixture
def repository(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "pyproject.toml").write_text(PLAIN)
    (tmp_path / "data.json").write_text('{"schema": "theirs/1"}')
    (tmp_path / "slider.toml").write_text(BASE + INLINE)
    return tmp_path


QUIET = ("-p", "no:cacheprovider", "-p", "no:faulthandler", "-rs")
# It collects the garbage of this whole process five times at each end.
UNSEARCHED = ("-p", "no:unraisableexception")


@pytest.fixture
def pytest_there(repository, monkeypatch, capsys):
    """Run pytest in the repository; return its text and its exit status."""
    monkeypatch.chdir(repository)

    def run(*argv):
        capsys.readouterr()
        status = pytest.main([*QUIET, *UNSEARCHED, *argv])
        return "".join(capsys.readouterr()), status

    return run


def pytest_alone(repository, *argv):
    """Run pytest in the repository and in a process; return its text and its exit status."""
    command = [sys.executable, "-m", "pytest", *QUIET, *argv]
    done = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr, done.returncode


def test_plugin_collects_case_files_per_engine(pytest_there):
    out, status = pytest_there("--kincheck", "--collect-only", "-q")
    assert status == 0, out
    assert re.findall(r"^(\S+)::(\S+)$", out, re.MULTILINE) == [
        ("slider.toml", name) for name in ENGINES
    ]


def test_plugin_runs_printed_test_id(repository, pytest_there):
    folder = repository / "of.dots"
    folder.mkdir()
    (folder / "my.slider.toml").write_text(BASE + INLINE)
    out, status = pytest_there("--kincheck", "--kincheck-engine", "native", "-v")
    assert status == 0, out
    printed = re.findall(r"^(\S+::\S+) PASSED", out, re.MULTILINE)
    assert sorted(printed) == ["of.dots/my.slider.toml::native", "slider.toml::native"]
    for each in printed:
        out, status = pytest_there("--kincheck", "-v", each)
        assert status == 0, out
        assert re.findall(r"^(\S+::\S+) PASSED", out, re.MULTILINE) == [each]
        assert "1 passed" in out


def test_plugin_reports_worst_sample(repository, pytest_there):
    (repository / "wrong.toml").write_text(edited(('name = "slider"', 'name = "wrong"')) + WRONG)
    out, status = pytest_there("--kincheck", "--kincheck-engine", "native")
    assert status == 1
    assert "1 failed, 1 passed" in out
    assert re.search(r"wrong.toml: native: fail: .*tip_x.* velocity .* against closed form", out), (
        out
    )
    assert "Traceback" not in out


@pytest.mark.needs("recorded")
@pytest.mark.parametrize(("last", "outcome"), [("1.60", "1 passed"), ("1.62", "1 failed")])
def test_plugin_judges_recordings(repository, pytest_there, last, outcome):
    (repository / "rig.csv").write_text(f"Push,Tip\n-0.10,1.40\n0.03,1.53\n0.10,{last}\n")
    maps = ("--kincheck-map", "push=Push", "--kincheck-map", "tip_x=Tip")
    given = ("--kincheck", "slider.toml", "--kincheck-recorded", "rig.csv", *maps)
    out, _ = pytest_there(*given, "--kincheck-engine", "native")
    assert f"{outcome}, 1 skipped" in out  # native has no reference at these samples
    assert ("rig: fail: tip_x: position" in out) == (outcome == "1 failed")


@pytest.mark.needs("recorded")
def test_plugin_reports_unreadable_recordings(repository, pytest_there):
    (repository / "rig.csv").write_text("a,b\n1,2\n")
    out, status = pytest_there("--kincheck", "slider.toml", "--kincheck-recorded", "rig.csv")
    assert (status, "found the columns 'a', 'b'" in out) == (2, True)


def test_plugin_skips_unjudged_case(repository, pytest_there):
    (repository / "slider.toml").write_text(BASE)
    out, status = pytest_there("--kincheck", "--kincheck-engine", "native")
    assert (status, "1 skipped" in out) == (0, True)
    assert re.search(r"SKIPPED.*: not judged: the case has no reference$", out, re.MULTILINE), out


@pytest.fixture
def bad_engines(monkeypatch):
    """Engines that solve nothing, each with an outcome of its own."""
    outcomes = {"native": "crashed", "mujoco": "unavailable", "pinocchio": "unsupported"}

    def solved(case, engine):
        return Record(
            case=case.name,
            truth="closed_form",
            mode="projection",
            loop="python",
            version=None,
            engine=engine.name,
            outcome=Outcome(outcomes[engine.name]),
            message=f"{engine.name} cannot",
        )

    monkeypatch.setattr(pytest_plugin, "_solve", solved)


def test_plugin_maps_each_outcome(bad_engines, pytest_there):
    rest = [f"--deselect=slider.toml::{name}" for name in [*ENGINES][3:]]
    out, status = pytest_there("--kincheck", *rest)
    assert status == 1
    assert f"1 failed, 2 skipped, {len(rest)} deselected" in out
    assert "slider.toml: native: crashed: native cannot" in out
    assert "unavailable: mujoco cannot" in out
    assert "unsupported: pinocchio cannot" in out


def test_plugin_requires_named_engines(bad_engines, pytest_there):
    out, status = pytest_there(
        "--kincheck", "--kincheck-engine", "mujoco", "--kincheck-engine", "pinocchio"
    )
    assert status == 1
    assert "1 failed, 1 skipped" in out
    assert "slider.toml: mujoco: mujoco cannot: pip install 'mujoco" in out


def test_plugin_isolates_simulators(repository):
    pytest.importorskip("mujoco")
    here = "def pytest_sessionfinish():\n    import sys\n    assert 'mujoco' not in sys.modules\n"
    (repository / "conftest.py").write_text(here)
    out, status = pytest_alone(repository, "--kincheck", "--kincheck-engine", "mujoco")
    assert (status, "1 passed" in out) == (0, True), out


def test_plugin_reports_invalid_file(repository, pytest_there):
    (repository / "broken.json").write_text('{"schema": "kincheck-case/7", "name": "a"}')
    out, status = pytest_there("--kincheck", "--kincheck-engine", "native")
    assert status == 2
    assert "broken.json: line 1: schema: " in out
    assert "kincheck-case/7" in out


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "--kincheck --kincheck-engine mujco",
            "there is no engine 'mujco'; did you mean 'mujoco'?",
        ),
        ("--kincheck-engine native", "--kincheck-engine: give --kincheck too"),
    ],
)
def test_plugin_refuses_invalid_options(pytest_there, line, message):
    out, status = pytest_there(*line.split())
    assert (status, message in out) == (4, True)


def test_plugin_without_option_is_light(repository):
    heavy = {"numpy", "scipy", "msgspec", "rich", "kincheck.core.mechanism.mechanism"}
    light = f"import sys\ndef test_light():\n    assert not {heavy} & {{*sys.modules}}\n"
    (repository / "test_light.py").write_text(
        light + "    assert 'kincheck.core.extensions.pytest_plugin.plugin' in sys.modules\n"
    )
    out, status = pytest_alone(repository, "-p", "no:hypothesispytest")
    assert status == 0, out
    assert "1 passed" in out


def test_core_public_names_are_found():
    assert [name for name in kincheck.core.__all__ if not hasattr(kincheck.core, name)] == []
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        kincheck.core.nothing  # noqa: B018


def test_plugin_finds_case_files_by_content(repository, pytest_there):
    """The schema anywhere in a line of JSON, behind a byte order mark, or in a file with capital
    letters.
    """
    case = tomllib.loads(BASE + INLINE)
    (repository / "sorted.json").write_text(json.dumps(dict(sorted(case.items()))))
    (repository / "marked.toml").write_bytes(BOM_UTF8 + (BASE + INLINE).encode())
    (repository / "LOUD.TOML").write_text(BASE + INLINE)
    out, _ = pytest_there("--kincheck", "--collect-only", "-q")
    assert all(name in out for name in ("sorted.json", "marked.toml", "LOUD.TOML", "slider.toml"))
    assert not any(name in out for name in ("data.json", "pyproject.toml"))
