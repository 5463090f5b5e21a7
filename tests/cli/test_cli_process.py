"""The command as a process: its version, its module, and what it loads."""

import importlib.metadata
import subprocess
import sys

import kincheck.core
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


def test_check_joint_help_loads_few_modules():
    code = (
        "import sys; from kincheck.core.cli import main as cli; cli.main(['check-joint',"
        " '--help']);print(*sorted(name.rpartition('.')[2] for name in sys.modules if"
        " name.startswith('kincheck.core.cli.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == (
        "checks class_loading main parser registry shared_options"
    )


def test_version_option_loads_no_library():
    code = (
        "import sys; from kincheck.core.cli import main as cli; status ="
        " cli.main(['--version']);print(sorted({'rich', 'jinja2', 'mujoco', 'pinocchio',"
        " 'exudyn', 'scipy', 'llvmlite', 'flint', 'pyarrow','sqlite3', 'asyncio',"
        " 'multiprocessing', 'distributed', 'kincheck.core.kinematics', 'kincheck.core.program'}&"
        " set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[1] == "[]"
