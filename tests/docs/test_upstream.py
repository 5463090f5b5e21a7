"""The reproducers of the reports to other projects, where the project is installed."""

import importlib.util
import re
import shutil
import subprocess
import sys

import pytest

from ..support.sources import ROOT

FOLDER = ROOT / "docs" / "upstream"


def printed(name, package):
    """What a reproducer prints, on its lines after the version."""
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    command = [sys.executable, FOLDER / f"{name}.py"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_tendon_equality_has_no_acceleration_term():
    _, *lines = printed("mujoco_tendon_equality", "mujoco")
    for line in lines:
        assert "expected -8" in line
        assert "found 0 " in line


def test_accelerations_err_by_the_inverse_of_mu():
    _, *lines = printed("pinocchio_proximal", "pinocchio")
    found = {float(mu): float(error) for mu, error in map(numbers, lines)}
    assert found[1e-1] < 1e-13
    assert found[1e-10] / found[1e-6] == pytest.approx(1e4, rel=0.1)


def numbers(line):
    return re.findall(r"\d\.?\d*e[-+]\d+", line)


def test_ball_on_world_body_ends_the_process():
    world, anchor = printed("drake_ball_on_world", "pydrake")
    assert world.startswith("world body: exit status -")
    assert anchor == "anchor body: exit status 0"


@pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="builds a binary for Linux"
)
def test_outputs_of_fmpy_are_a_step_late():
    _, first, second, *_ = printed("fmpy_late_inputs", "fmpy")
    assert first.split() == "t 0.0 u 0.0 y 0.0".split()
    assert second.split() == "t 0.2 u 0.2 y 0.0".split()


def test_every_draft_has_its_reproducer_and_is_listed():
    listed = (FOLDER / "README.md").read_text("utf-8")
    drafts = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "README")
    assert drafts == sorted(path.stem for path in FOLDER.glob("*.py"))
    assert all(f"({name}.md)" in listed and f"`{name}.py`" in listed for name in drafts)
