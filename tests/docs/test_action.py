"""The GitHub Action does in a shell what its page says."""

import os
import subprocess
import sys

import pytest
import yaml

from ..support.case_texts import BASE, INLINE
from ..support.sources import ROOT

ACTION = yaml.safe_load((ROOT / ".github/actions/kincheck/action.yml").read_text("utf-8"))
INSTALL, *STEPS = (each["run"] for each in ACTION["runs"]["steps"] if "run" in each)
NIGHTLY = ROOT / "core/extensions/nightly"
PYTHON = f"""#!/bin/sh
case "$2" in
  venv) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
  pip) echo "$@" >> "$RUNNER_TEMP/installed" ;;
  *) exec {sys.executable} "$@" ;;
esac
"""


@pytest.fixture
def job(tmp_path):
    """A night: its status, and what the job's page shows."""
    command = tmp_path / "kincheck" / "bin" / "kincheck"
    command.parent.mkdir(parents=True)
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m kincheck "$@"\n')
    command.chmod(0o755)
    given = {name: each["default"] for name, each in ACTION["inputs"].items()}

    def job(**inputs):
        outputs, summary = tmp_path / "outputs", tmp_path / "summary"
        environment = {
            **{name: x for name, x in os.environ.items() if not name.startswith("KINCHECK")},
            **{name.upper(): x for name, x in {**given, **inputs}.items()},
            "RUNNER_TEMP": str(tmp_path),
            "GITHUB_OUTPUT": str(outputs),
            "GITHUB_STEP_SUMMARY": str(summary),
        }
        status = 0
        for step in STEPS:
            run = subprocess.run(["bash", "-e", "-c", step], cwd=tmp_path, env=environment)
            status = status or run.returncode
        return status, outputs.read_text().split()[-1], summary.read_text()

    return job


@pytest.mark.nightly
def test_github_action_fails_after_regression(job, tmp_path):
    file = tmp_path / "slider.toml"
    file.write_text(BASE + INLINE)
    assert job(cases="slider.toml")[:2] == (0, "status=0")
    file.write_text(BASE + INLINE.replace("1.6", "1.7"))
    status, output, summary = job(cases="slider.toml", engines="", options="--engine native -q")
    assert (status, output) == (1, "status=1")
    assert "1 new failure" in summary


def installed(tmp_path, source):
    """Return what the action installs from the sources in a folder, a line each."""
    program = tmp_path / "bin" / "python"
    program.parent.mkdir()
    program.write_text(PYTHON)
    program.chmod(0o755)
    environment = os.environ | {
        "PATH": f"{program.parent}:{os.environ['PATH']}",
        "RUNNER_TEMP": str(tmp_path),
        "GITHUB_ACTION_PATH": str(source / ".github/actions/kincheck"),
        "EXTRAS": "fast,usd",
        "INSTALL": "python -m pip install .\npython -m pip install ./mine",
    }
    subprocess.run(["bash", "-e", "-c", INSTALL], cwd=tmp_path, env=environment, check=True)
    return (tmp_path / "installed").read_text().splitlines()


@pytest.mark.skipif(not NIGHTLY.is_dir(), reason="its extension is not here")
def test_github_action_installs_by_lock(tmp_path):
    _, lock, rest, *own = installed(tmp_path, ROOT)
    assert "--require-hashes" in lock
    assert "llvmlite==" in (tmp_path / "kincheck.lock").read_text()
    assert rest.endswith("[fast,usd]")  # what the lock lacks, in its newest version
    assert own == ["-m pip install .", "-m pip install ./mine"]


def test_github_action_installs_without_lock(tmp_path):
    """The extension that has it may be deleted."""
    _, rest, *own = installed(tmp_path, tmp_path / "source")
    assert rest.endswith("[fast,usd]")
    assert len(own) == 2
