"""kincheck nightly: the workflow that it writes, run step by step in a simulator's repository."""

import json
import re
import shutil
import subprocess
import sys

import pytest
import yaml
from kincheck.core.cli.main import main
from kincheck.core.extensions.nightly.command import ACTIONS, MARK
from kincheck.core.extensions.nightly.lock import locked

from ...support.case_texts import BASE, INLINE
from ...support.github_runner import Runner
from ...support.sources import ROOT

ENGINE = """
import time
from pathlib import Path
from kincheck import adapters

class Engine:
    name, mode, loop, settings, in_process = "tinysim", "projection", "python", {}, True
    solver = adapters.engine("native")

    def version(self):
        return "1.0"

    def unsupported(self, case):
        return None

    def build(self, case):
        return self.solver.build(case)

    def solve(self, model, case, tol):
        found = self.solver.solve(model, case, tol)
        time.sleep(0.02)  # beside which a busy machine is no slowdown
        file = Path(case.name + ".off")
        for each in found.points.values():
            each.position[:] += float(file.read_text()) if file.exists() else 0.0
        return found
"""
PROJECT = """
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"
[project]
name = "tinysim"
version = "1.0"
[project.entry-points."kincheck.engines"]
tinysim = "tinysim_engine:Engine"
[tool.setuptools]
py-modules = ["tinysim_engine"]
"""
PYTHON = f"""#!/bin/sh
case "$2" in
  pip) echo "$@" >> "$(dirname "$0")/../installed" ;;
  *) exec {sys.executable} "$@" ;;
esac
"""
KINCHECK = f'#!/bin/sh\nexec {sys.executable} -m kincheck "$@"\n'


def git(folder, *words):
    subprocess.run(("git", *words), cwd=folder, check=True, capture_output=True)


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """The repository of a simulator with two cases, of which the first is the working folder."""
    folder = tmp_path / "tinysim"
    folder.mkdir()
    (folder / "pyproject.toml").write_text(PROJECT)
    (folder / "tinysim_engine.py").write_text(ENGINE)
    (folder / "README.md").write_text("# tinysim\n\nA simulator.\n")
    for name in ("first", "second"):
        (folder / f"{name}.toml").write_text((BASE + INLINE).replace('"slider"', f'"{name}"', 1))
    git(folder, "init", "--quiet", "--initial-branch", "main")
    git(folder, "remote", "add", "origin", "https://github.com/o/r.git")
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def runner(repository, tmp_path):
    """A runner that finds kincheck and the engine installed, and only notes what pip installs."""
    info = tmp_path / "installation/tinysim-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: tinysim\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[kincheck.engines]\ntinysim = tinysim_engine:Engine\n")
    path = f"{info.parent}:{repository}"
    programs = {"python": PYTHON, "kincheck": KINCHECK}
    return Runner(repository, tmp_path / "state", {"PYTHONPATH": path}, programs)


def init(*words):
    return main(["nightly", "init", *words])


def workflow(repository):
    return yaml.safe_load((repository / ".github/workflows/kincheck.yml").read_text())


@pytest.mark.nightly
@pytest.mark.skipif(not shutil.which("jq"), reason="jq, which gh has built in, is not installed")
def test_workflow_comments_on_pull_requests(repository, runner):
    assert init("--case", "[fs]*.toml") == 0
    comments = runner.state / "comments.json"
    off = repository / "first.off"

    (repository / "second.off").write_text("1e-3")  # which no pull request has to do with
    assert runner.run() == 1
    off.write_text("1e-3")
    assert runner.run("pull_request") == 1
    (comment,) = json.loads(comments.read_text())
    assert comment["body"].startswith(f"{MARK}\n**Worse since this commit")
    assert "1 new failure" in comment["body"]
    assert "first" in comment["body"]
    assert "second" not in comment["body"]
    off.unlink()
    assert runner.run("pull_request") == 0
    assert json.loads(comments.read_text()) == []
    installed = (runner.state / "installed").read_text()
    assert "--require-hashes --requirement .github/kincheck.lock" in installed
    assert installed.splitlines()[2] == "-m pip install ."


@pytest.mark.nightly
def test_workflow_keeps_history_in_branch(repository, runner, tmp_path):
    assert init("--history", "branch", "--case", "first.toml", "--no-badge") == 0
    git(tmp_path, "init", "--quiet", "--bare", "origin")
    git(repository, "remote", "set-url", "origin", str(tmp_path / "origin"))
    assert runner.run() == 0
    (repository / "first.off").write_text("1e-3")
    assert runner.run() == 1
    assert runner.run("workflow_dispatch", accept="first:tinysim", reason="another origin") == 0
    summary = (runner.state / "summary").read_text()
    assert "run 2 against run 1" in summary
    assert "accepted in run 2 by ada" in summary
    count = ["git", "rev-list", "--count", "--all"]
    assert subprocess.check_output(count, cwd=tmp_path / "origin", text=True) == "1\n"


def test_unreadable_history_ends_night(repository, runner):
    assert init("--history", "branch", "--case", "first.toml") == 0
    git(repository, "remote", "set-url", "origin", str(repository / "nowhere"))
    assert runner.run() != 0
    assert not (repository / "kincheck-night/history.sqlite").exists()


def test_init_asks_on_terminal(repository, monkeypatch):
    (repository / "pyproject.toml").unlink()
    answers = {"package": "cmake --install build", "engine": "mine:Engine"}

    def answer(question):
        return next(text for word, text in answers.items() if word in question)

    monkeypatch.setattr("builtins.input", answer)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert init() == 0
    steps = {each.get("name"): each for each in workflow(repository)["jobs"]["run"]["steps"]}
    assert steps["Install the engine"]["run"].strip() == "cmake --install build"
    assert "--engine mine:Engine" in steps["Run"]["run"]
    assert "actions/workflows/kincheck.yml/badge.svg" in (repository / "README.md").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("", "How is your package installed? Give --install."),
        ("--install make", "Name of your engine, or MODULE:CLASS? Give --engine."),
        ("--install make --engine a;b", "expected a name or MODULE:CLASS"),
        ("--install make --engine mujoco --extras quick", "found quick, expected"),
        ("--install make --engine mujoco --extras usd", "the lock lacks usd-core"),
    ],
)
def test_init_refuses_unknown_facts(repository, capsys, words, told):
    (repository / "pyproject.toml").unlink()
    assert init(*words.split()) == 2
    assert told in capsys.readouterr().err
    assert not (repository / ".github").exists()


def test_init_replaces_only_when_forced(repository, capsys):
    assert init() == 0
    first = (repository / ".github/workflows/kincheck.yml").read_text()
    assert init() == 2
    assert "--force" in capsys.readouterr().err
    assert init("--force", "--history", "branch") == 0
    assert (repository / ".github/workflows/kincheck.yml").read_text() != first
    assert (repository / "README.md").read_text().count("badge.svg") == 1


@pytest.mark.parametrize("history", ["artifact", "branch"])
def test_workflow_grants_least(repository, history):
    assert init("--history", history) == 0
    text = (repository / ".github/workflows/kincheck.yml").read_text()
    found = workflow(repository)
    assert found["permissions"] == {}
    assert not any("write" in each for each in found["jobs"]["run"]["permissions"].values())
    for name, job in found["jobs"].items():
        for step in job["steps"]:
            assert "${{" not in step.get("run", "")  # texts of others are no code
            assert name == "run" or "pip" not in step.get("run", "")
    assert re.findall(r"uses: actions/([\w-]+)@(.*)", text)
    for action, commit in re.findall(r"uses: actions/([\w-]+)@(.*)", text):
        assert commit == ACTIONS[action]


def test_actions_are_those_of_kincheck():
    files = [*ROOT.glob(".github/workflows/*.yml"), *ROOT.glob(".github/actions/*/action.yml")]
    own = "\n".join(file.read_text("utf-8") for file in files)
    for name, commit in ACTIONS.items():
        assert f"actions/{name}@{commit}" in own


@pytest.mark.parametrize(
    ("extras", "there", "absent"),
    [([], "scipy", "llvmlite"), (["fast"], "llvmlite", "mujoco"), (["mujoco"], "glfw", "coal")],
)
def test_lock_has_what_extras_need(extras, there, absent):
    text, lacking = locked(extras)
    names = set(re.findall(r"^([\w.-]+)==", text, flags=re.M))
    assert there in names
    assert absent not in names
    assert not lacking
    assert all("--hash=sha256:" in each for each in re.split(r"^(?=\w)", text, flags=re.M)[1:])
    assert "#" not in text


@pytest.mark.nightly
def test_workflow_installs_in_environment(repository, runner, tmp_path):
    venv = tmp_path / "venv"
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    assert init("--case", "first.toml", "--kincheck", f"kincheck @ {ROOT.as_uri()}") == 0
    programs = {"python": venv / "bin/python", "kincheck": venv / "bin/kincheck"}
    runner.programs = {name: f'#!/bin/sh\nexec {own} "$@"\n' for name, own in programs.items()}
    runner.environment = {}
    assert runner.run() == 0
