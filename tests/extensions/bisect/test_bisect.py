"""kincheck bisect on releases of a small simulator, offline."""

import json
from math import log2

import pytest

from .wheels import case, twelve


@pytest.fixture
def offline(tmp_path, monkeypatch):
    """Folders for wheels and cases; the installer finds nothing else."""
    (tmp_path / "wheels").mkdir()
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "wheels"))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("KINCHECK_ENVIRONMENTS", str(tmp_path / "environments"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def bisect(cli, offline):
    """Return a function that runs the command; it returns status and document."""

    def run(*words):
        status = cli("bisect", "wobble", *words, "--json", "found.json")
        file = offline / "found.json"
        return status, json.loads(file.read_text()) if file.exists() else None

    return run
