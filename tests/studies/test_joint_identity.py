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


def run(folder, *arguments):
    """Run as a user does, in the folder of the module."""
    command = [
        sys.executable,
        "-m",
        "kincheck",
        "run",
        "slot.toml",
        "--joint-type",
        "pin_in_slot:PinInSlot",
        "--engine",
        "native",
    ]
    done = subprocess.run(
        [*command, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    # only native knows the joint, so nothing is compared
    assert done.returncode == 2, done.stderr
    assert "nothing was compared" in done.stderr
    return done.stderr


def killed(folder):
    """Have the last run of the history without an end."""
    import sqlite3

    connection = sqlite3.connect(folder / "h.sqlite")
    connection.execute("UPDATE runs SET status = 'interrupted'")
    connection.commit()
    connection.close()


EDITS = {
    None: "run 1 is resumed after 1 records",
    "elsewhere.py": "run 1 is resumed after 1 records",
    "beside.py": "run 2 is new",
    "pin_in_slot.py": "run 3 is new",
}


def test_an_edit_of_the_joints_code_makes_another_run(folder):
    run(folder, "--history", "h.sqlite")
    for edited, expected in EDITS.items():
        killed(folder)
        if edited is not None:
            (folder / edited).write_text((folder / edited).read_text() + "\n# edited\n")
        assert expected in run(folder, "--history", "h.sqlite", "--resume"), edited


def test_installed_modules_and_kinchecks_own_are_not_among_the_sources():
    assert sources([]) == {}
    found = sources([f"{__name__}:Nothing"])
    assert __name__ in found
    assert not any(name.split(".")[0] in ("kincheck", "numpy", "pytest") for name in found)
