"""A run is another one when the code of its joint types is: --resume never puts records of two
joints into one run.
"""

import importlib
import shutil
import sqlite3
import sys
from pathlib import Path

import pytest
from kincheck.core.caches import clear_caches
from kincheck.core.cli.joint_loading import sources
from kincheck.core.cli.main import main

from .test_check_joint_command import SLOT

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


@pytest.fixture
def run(folder, monkeypatch, own_joint_types, capsys):
    """Returns what a run says, in the folder of the module, which each run imports anew."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr("sys.path", ["", *sys.path])

    def run(*arguments):
        for module in ("pin_in_slot", "beside"):
            monkeypatch.delitem(sys.modules, module, raising=False)
        importlib.invalidate_caches()
        clear_caches()
        joint = ("--joint-type", "pin_in_slot:PinInSlot")
        status = main(["run", "slot.toml", *joint, "--engine", "native", "--jobs", "0", *arguments])
        said = capsys.readouterr().err
        # only native knows the joint, so nothing is compared
        assert status == 2, said
        assert "nothing was compared" in said
        return said

    return run


def killed(folder):
    """Leave the last run of the history without an end."""
    connection = sqlite3.connect(folder / "h.sqlite")
    connection.execute("UPDATE runs SET status = 'interrupted'")
    connection.commit()
    connection.close()


EDITS = {
    "elsewhere.py": "run 1 is resumed after 1 records",
    "beside.py": "run 2 is new",
    "pin_in_slot.py": "run 3 is new",
}


def test_an_edit_of_the_joints_code_makes_another_run(folder, run):
    run("--history", "h.sqlite")
    for edited, expected in EDITS.items():
        killed(folder)
        (folder / edited).write_text((folder / edited).read_text() + "\n# edited\n")
        assert expected in run("--history", "h.sqlite", "--resume"), edited


def test_installed_modules_and_kinchecks_own_are_not_among_the_sources():
    assert sources([]) == {}
    found = sources([f"{__name__}:Nothing"])
    assert __name__ in found
    assert not any(name.split(".")[0] in ("kincheck", "numpy", "pytest") for name in found)
