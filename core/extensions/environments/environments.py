"""Environments of engines that cannot live in kincheck's own."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path

ENVIRONMENTS = "KINCHECK_ENVIRONMENTS"
"""Environment variable: folder of virtual environments, each with the name of an engine that cannot
live in kincheck's own.
"""


def python_of(engine: str) -> str:
    """Return the Python of an engine's own environment; without one, the running Python."""
    folder = os.environ.get(ENVIRONMENTS, "")
    programs = (Path(folder) / engine / each for each in ("bin/python", "Scripts/python.exe"))
    return next(
        (str(each.absolute()) for each in programs if folder and each.is_file()), sys.executable
    )


def how_to_add(engine: str, requirements: str) -> str:
    """Return the commands that make the environment of an engine."""
    known = os.environ.get(ENVIRONMENTS)
    folder = shlex.quote(str(Path(known) / engine)) if known else f"${ENVIRONMENTS}/{engine}"
    return f"python -m venv {folder} && {folder}/bin/pip install numpy {requirements}"
