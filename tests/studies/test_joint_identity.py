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
def run(tmp_path, monkeypatch, own_joint_types, capsys):
    """Returns what a run says, in the folder of the modules, which each run imports anew."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", ["", *sys.path])

    def run(*arguments, status=2):
        for module in ("pin_in_slot", "beside", "mine"):
            monkeypatch.delitem(sys.modules, module, raising=False)
        importlib.invalidate_caches()
        clear_caches()
        found = main(["run", *arguments, "--jobs", "0", "--history", "h.sqlite"])
        said = capsys.readouterr().err
        assert found == status, said
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


SLOTTED = "slot.toml --joint-type pin_in_slot:PinInSlot --engine native".split()


def test_edited_joint_code_makes_new_run(folder, run):
    # only native knows the joint, so nothing is compared
    assert "nothing was compared" in run(*SLOTTED)
    for edited, expected in EDITS.items():
        killed(folder)
        (folder / edited).write_text((folder / edited).read_text() + "\n# edited\n")
        assert expected in run(*SLOTTED, "--resume"), edited


ENGINE = """import kincheck.adapters
native = kincheck.adapters.engine("native")

class Mine:
    name, mode, loop, settings = "mine", "projection", "compiled", {}
    version, unsupported = native.version, native.unsupported
    build, solve, in_process = native.build, native.solve, True
"""


def test_edited_engine_code_makes_new_run(tmp_path, run):
    """Whatever version it gives."""
    (tmp_path / "mine.py").write_text(ENGINE)
    command = ["four_bar", "--engine", "mine:Mine"]
    run(*command, status=0)
    killed(tmp_path)
    (tmp_path / "mine.py").write_text(ENGINE + "\n# edited\n")
    assert "run 2 is new" in run(*command, "--resume", status=0)


def test_installed_modules_and_kinchecks_own_are_not_among_the_sources():
    assert sources([]) == {}
    found = sources([f"{__name__}:Nothing", "numpy", "kincheck.adapters.native"])
    assert __name__ in found
    assert not any(name.split(".")[0] in ("kincheck", "scipy", "pytest") for name in found)
    assert "numpy.linalg" not in found
