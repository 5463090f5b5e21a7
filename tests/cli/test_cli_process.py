"""The command as a process: its version, its module, and what it loads."""

import importlib.metadata
import subprocess
import sys

import kincheck.core
import pytest
from kincheck.core.cli.main import main
from kincheck.core.version import VERSION


def test_version_option_prints_installed_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"kincheck {kincheck.core.__version__}\n"
    assert kincheck.core.__version__ == importlib.metadata.version("kincheck")


def test_python_module_runs_command(tmp_path):
    module = [sys.executable, "-m", "kincheck"]
    done = subprocess.run(
        [*module, "--version"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout == f"kincheck {VERSION}\n"
    wrong = subprocess.run(
        [*module, "run", "no_such_case"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (wrong.returncode, wrong.stderr[:9]) == (2, "kincheck:")


LOADED = """
import contextlib, io, sys
from kincheck.core.cli.main import main
with contextlib.redirect_stdout(io.StringIO()):
    main(sys.argv[1:])
print(*sys.modules)
"""


def modules_of(line):
    """Modules that a command loads, in a fresh interpreter."""
    command = [sys.executable, "-c", LOADED, *line.split()]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_check_joint_help_loads_few_modules():
    own = [name.rpartition(".") for name in modules_of("check-joint --help")]
    commands = {name for folder, _, name in own if folder == "kincheck.core.cli"}
    assert " ".join(sorted(commands)) == ("checks class_loading main parser registry")


SIMULATORS = "mujoco pinocchio exudyn pydrake opensim"
LIBRARIES = (
    "numpy scipy rich jinja2 llvmlite flint pyarrow sqlite3 asyncio multiprocessing distributed "
    "kincheck.core.kinematics kincheck.core.program"
)


@pytest.mark.parametrize(
    ("line", "others"),
    [
        ("--version", f"{SIMULATORS} {LIBRARIES}"),
        ("--help", f"{SIMULATORS} {LIBRARIES}"),
        ("list", SIMULATORS),
    ],
    ids=["version", "help", "list"],
)
def test_start_loads_no_library(line, others):
    """With numpy, help and completion would take four times as long."""
    assert {*others.split()}.isdisjoint(modules_of(line))
