"""Engines are asked for their versions in processes of their own: whatever loading them does, it
does not do to ours.
"""

import os
import subprocess
import sys
from pathlib import Path

from kincheck.core.cli import main
from kincheck.core.cli.registry import Status
from kincheck.core.harness.engine import Unloadable, versions

from ..support.engines_asked import DEEDS, Foreign, Loading, Ours


def test_versions_keep_order_of_engines(monkeypatch):
    # where the processes find the engines
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    found = versions([*map(Loading, DEEDS), Unloadable("gone", "no module", "projection")])
    assert found == ["1.2", "3", *[None] * 5]


def test_an_engine_that_hangs_has_no_version(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    assert versions([Loading("hangs")], patience=1.0) == [None]


def test_version_is_read_in_process_on_request(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    ours, foreign = versions([Ours("any"), Foreign("native")])
    assert ours == str(os.getpid())
    assert foreign not in (ours, None)


def test_run_survives_crashing_simulator_imports(tmp_path):
    (tmp_path / "exudyn.py").write_text("import sys; sys.exit(0)")
    (tmp_path / "mujoco.py").write_text("import os; os.abort()")
    command = "run rssr --engine native exudyn mujoco".split()
    files = "--history h.sqlite --json r.json".split()
    code = "import sys; from kincheck.core.cli import main as cli; sys.exit(cli.main(sys.argv[1:]))"
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    found = subprocess.run(
        [sys.executable, "-c", code, *command, *files],
        cwd=tmp_path,
        env=env,
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    assert "/3] rssr native: pass" in found.stderr
    assert "/3] rssr exudyn: unavailable" in found.stderr
    assert "/3] rssr mujoco: crashed" in found.stderr
    assert (tmp_path / "r.json").exists()
    assert (tmp_path / "h.sqlite").exists()


def test_exit_inside_command_is_failure(monkeypatch, capsys):
    monkeypatch.setattr(main, "registry", lambda: sys.exit(0))
    assert main.main(["list"]) == Status.FAILED
    assert "ended the program with status 0" in capsys.readouterr().err
