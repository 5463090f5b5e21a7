"""A run is another one when the code of its joint types is: --resume never puts records of two
joints into one run.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from kincheck.core.cli.joint_loading import sources

from .test_check_joint import SLOT

HERE = Path(__file__).parents[1]


@pytest.fixture
def folder(tmp_path):
    shutil.copy(HERE / "user_joints" / "pin_in_slot.py", tmp_path)
    text = (tmp_path / "pin_in_slot.py").read_text()
    (tmp_path / "pin_in_slot.py").write_text(
        "import beside\n" + text.replace("from __future__ import annotations\n", "")
    )
    (tmp_path / "beside.py").write_text("NUMBER = 1\n")
    (tmp_path / "elsewhere.py").write_text("NUMBER = 1\n")
    (tmp_path / "slot.toml").write_text(SLOT)
    return tmp_path


SLOTTED = ["slot.toml", "--joint-type", "pin_in_slot:PinInSlot", "--engine", "native"]


def run(folder, *arguments, status=2):
    """Run as a user does, in the folder of the module."""
    command = [sys.executable, "-m", "kincheck", "run", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    return done.stderr


def killed(folder):
    """Have the last run of the history without an end."""
    import sqlite3

    connection = sqlite3.connect(folder / "h.sqlite")
    connection.execute("UPDATE runs SET status = 'interrupted'")
    connection.commit()
    connection.close()


EDITS = {
    None: "run 1 goes on, 1 records are there",
    "elsewhere.py": "run 1 goes on, 1 records are there",
    "beside.py": "run 2 is new",
    "pin_in_slot.py": "run 3 is new",
}


def test_an_edit_of_the_joints_code_makes_another_run(folder):
    # only native knows the joint, so nothing is compared
    assert "nothing was compared" in run(folder, *SLOTTED, "--history", "h.sqlite")
    for edited, expected in EDITS.items():
        killed(folder)
        if edited is not None:
            (folder / edited).write_text((folder / edited).read_text() + "\n# edited\n")
        assert expected in run(folder, *SLOTTED, "--history", "h.sqlite", "--resume"), edited


ENGINE = """import kincheck.adapters
native = kincheck.adapters.engine("native")

class Mine:
    name, mode, loop, settings = "mine", "projection", "compiled", {}
    version, unsupported = native.version, native.unsupported
    build, solve, in_process = native.build, native.solve, True
"""


def test_an_edit_of_an_engines_code_makes_another_run(tmp_path):
    """Whatever version it gives."""
    (tmp_path / "mine.py").write_text(ENGINE)
    command = ["four_bar", "--engine", "mine:Mine", "--history", "h.sqlite"]
    run(tmp_path, *command, status=0)
    killed(tmp_path)
    (tmp_path / "mine.py").write_text(ENGINE + "\n# edited\n")
    assert "run 2 is new" in run(tmp_path, *command, "--resume", status=0)


def test_installed_modules_and_kinchecks_own_are_not_among_the_sources():
    assert sources([]) == {}
    found = sources([f"{__name__}:Nothing", "numpy", "kincheck.adapters.native"])
    assert __name__ in found
    assert not any(name.split(".")[0] in ("kincheck", "scipy", "pytest") for name in found)
    assert "numpy.linalg" not in found
