"""kincheck doctor: what is missing or broken is named with its remedy, and never taken for
sound.
"""

import importlib.metadata
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.doctor import installation
from kincheck.core.program import disk_cache

from ...support.examples import examples

OTHERS, BROKEN = examples(__file__, "others", "broken")


@pytest.fixture
def without_imports(monkeypatch):
    """Nothing is imported in processes of their own: that takes seconds."""
    monkeypatch.setattr(installation, "_with_import_problems", lambda found, *others: found)


def missing(monkeypatch, *names):
    version = importlib.metadata.version

    def found(name):
        if name in names:
            raise importlib.metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(importlib.metadata, "version", found)


def test_doctor_of_sound_installation(without_imports, tmp_path, capsys):
    assert main(["doctor", "--json", str(tmp_path / "found.json")]) == 0
    out = capsys.readouterr().out
    assert re.search(r"pin +\S+ +engine +ok", out)
    assert "self-check mcpherson_strut: pass" in out
    assert "kincheck can do its work" in out
    found = json.loads((tmp_path / "found.json").read_text())
    names = {part["name"] for part in found["parts"]}
    assert {
        "numpy",
        "scipy",
        "llvmlite",
        "mujoco",
        "pin",
        "exudyn",
        "python-flint",
        "distributed",
        "pyarrow",
        "pyyaml",
        "usd-core",
        "websockets",
        "pandas",
        "xarray",
        "matplotlib",
        "chromium",
    } <= names
    assert found["check"]["error"] < 1e-3 * found["check"]["tolerance"]
    assert found["machine"]["processor"]


def test_doctor_names_missing_engine_remedy(without_imports, monkeypatch, capsys):
    missing(monkeypatch, "pin")
    assert main(["doctor"]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("pin:"))
    assert "not installed: pip install 'pin>=" in line


@pytest.mark.parametrize(
    ("version", "sound"), [("4", True), ("4.0.0rc1", True), ("10.1", True), ("3.10.2", False)]
)
def test_doctor_names_version_too_old(version, sound, without_imports, monkeypatch, capsys):
    known = importlib.metadata.version
    monkeypatch.setattr(
        importlib.metadata, "version", lambda name: version if name == "mujoco" else known(name)
    )
    assert main(["doctor"]) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("mujoco:")]
    assert said == ([] if sound else ["mujoco: older than 4: pip install 'mujoco>=4'"])


# Slow to import, and none takes part.


def test_doctor_with_broken_llvmlite_uses_numpy(tmp_path):
    """Its package is there, and its library is not; nothing that it made before is kept here."""
    for file, text in (("__init__.py", ""), ("binding.py", 'raise OSError("no libllvmlite.so")')):
        (tmp_path / "llvmlite").mkdir(exist_ok=True)
        (tmp_path / "llvmlite" / file).write_text(text)
    for name in OTHERS:
        (tmp_path / f"{name}.py").touch()
    here = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)}
    ran = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from kincheck.core.cli.main import main; sys.exit(main())",
            "doctor",
            "--json",
            "-",
        ],
        env=here,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout)
    (llvmlite,) = (part for part in found["parts"] if part["name"] == "llvmlite")
    assert "no libllvmlite.so" in llvmlite["problem"]
    assert (found["check"]["outcome"], found["machine"]["vector_width"]) == ("pass", None)


def test_doctor_fails_without_essential_library(without_imports, monkeypatch, capsys):
    missing(monkeypatch, "scipy")
    assert main(["doctor"]) == 2
    out = capsys.readouterr().out
    assert "kincheck cannot do its work" in out
    assert "pip install 'scipy>=" in out


def imported(name, code):
    """What doctor finds of a library that is imported by code."""
    part = installation.Part(name, "1.0", "kincheck", True, "", "")
    (found,) = installation._with_import_problems([part], {name: code} if code else {}, {})
    return found


@pytest.mark.parametrize(
    ("code", "said", "remedy"),
    BROKEN,
)
def test_doctor_finds_broken_library(code, said, remedy, monkeypatch):
    monkeypatch.setattr(installation, "PATIENCE", 5.0 if "sleep" not in code else 0.5)
    found = imported("numpy", code)
    assert said in found.problem
    assert found.remedy.startswith(remedy)


def test_doctor_ignores_modules_of_working_folder(monkeypatch, tmp_path):
    (tmp_path / "msgspec.py").write_text("raise SystemExit('planted')")
    monkeypatch.chdir(tmp_path)
    assert not imported("msgspec", "").problem


def test_doctor_names_unwritable_cache(without_imports, monkeypatch, tmp_path, capsys):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert "every process compiles again" in out
    assert "XDG_CACHE_HOME" in out


@pytest.mark.skipif(os.name == "nt", reason="Windows has no modes of this kind")
def test_doctor_names_cache_writable_by_others(without_imports, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "kincheck").mkdir()
    (tmp_path / "kincheck").chmod(0o777)
    assert main(["doctor"]) == 0
    assert f"other users can write in {tmp_path / 'kincheck'}; every" in capsys.readouterr().out


def test_doctor_of_user_without_home(without_imports, monkeypatch, capsys):
    """As in a container that is run as a user whom it does not know."""
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", nobody)
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert "nowhere" in out
    assert "the user has no home directory; every process compiles again" in out
    assert disk_cache.load_or_make(b"said", lambda: b"made", bytes) == b"made"
    assert disk_cache.find(b"said", bytes) is None
    assert not disk_cache.contains(b"said")


def nobody():
    raise RuntimeError("Could not determine home directory.")
