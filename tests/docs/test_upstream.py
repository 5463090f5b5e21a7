"""The reproducers of the reports to other projects, where the project is installed."""

import importlib.util
import re
import shutil
import subprocess
import sys

import pytest

from ..support.sources import ROOT

FOLDER = ROOT / "docs" / "upstream"


def printed(name, package, python=sys.executable):
    """What a reproducer prints, on its lines after the version."""
    if importlib.util.find_spec(package) is None and python == sys.executable:
        pytest.skip(f"{package} is not installed")
    command = [python, FOLDER / f"{name}.py"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_mujoco_tendon_equality_lacks_acceleration_term():
    _, *lines = printed("mujoco_tendon_equality", "mujoco")
    for line in lines:
        assert "expected -8" in line
        assert "found 0 " in line


CONNECTS = re.compile(r"(\w+) \S+, (connect|weld): .* expected -2, found (\S+)")


def test_mujoco_connect_has_acceleration_term():
    """Since 3.7.0; each found number has four digits."""
    found = [CONNECTS.match(line).groups() for line in printed("mjx_connect_weld", "mujoco")]
    assert found == [("MuJoCo", tie, "-2") for tie in ("connect", "weld")]


def test_mjx_connect_lacks_acceleration_term():
    python_of = pytest.importorskip("kincheck.core.extensions.environments.environments").python_of
    if (python := python_of("mjx")) == sys.executable:
        pytest.skip("MJX has no environment of its own here")
    found = [CONNECTS.match(line) for line in printed("mjx_connect_weld", "mujoco", python)]
    of_mjx = [each.groups() for each in found if each and each[1] == "MJX"]
    assert of_mjx == [("MJX", tie, "0") for tie in ("connect", "weld")]


def test_mujoco_full_inertia_compiled_exactly():
    """Since 3.14.0."""
    _, line = printed("mujoco_full_inertia", "mujoco")
    median, largest = map(float, numbers(line)[:2])
    assert 0.0 < median < largest < 1e-14
    assert line.endswith("above 1e-12: 0")


def test_dart_reads_no_tensor_of_mjcf():
    _, *lines = printed("dart_mjcf_inertia", "dartpy")
    assert len(lines) == 4
    for line in lines:
        kept = "mass 2, centre 0.3" if "with geom" in line else "mass 1, centre 0"
        assert line.endswith(f"found {kept}, moments [1.0, 1.0, 1.0]")


def test_pinocchio_acceleration_error_grows_with_mu():
    _, *lines = printed("pinocchio_proximal", "pinocchio")
    found = {float(mu): float(error) for mu, error in map(numbers, lines)}
    assert found[1e-1] < 1e-13
    assert found[1e-10] / found[1e-6] == pytest.approx(1e4, rel=0.1)


def numbers(line):
    return re.findall(r"\d\.?\d*e[-+]\d+", line)


def test_drake_ball_on_world_aborts():
    world, anchor = printed("drake_ball_on_world", "pydrake")
    assert world.startswith("world body: exit status -")
    assert anchor == "anchor body: exit status 0"


@pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="builds a binary for Linux"
)
def test_fmpy_outputs_lag_one_step():
    _, first, second, *_ = printed("fmpy_late_inputs", "fmpy")
    assert first.split() == "t 0.0 u 0.0 y 0.0".split()
    assert second.split() == "t 0.2 u 0.2 y 0.0".split()


def test_upstream_drafts_have_listed_reproducers():
    listed = (FOLDER / "README.md").read_text("utf-8")
    drafts = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "README")
    assert drafts == sorted(path.stem for path in FOLDER.glob("*.py"))
    assert all(f"({name}.md)" in listed and f"`{name}.py`" in listed for name in drafts)
