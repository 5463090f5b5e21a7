"""The repository of a simulator: what it says about its package, its engines and its address."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path
from typing import Any

from ...cli.class_loading import GROUP
from ...errors import KincheckError

INSTALL = "python -m pip install"


def root() -> Path:
    """Return the root of the git repository of the working folder.

    Raises:
        KincheckError: there is none.
    """
    found = _git("rev-parse", "--show-toplevel")
    if not found:
        raise KincheckError(
            f"nightly init: {Path.cwd()} is in no git repository. Call it in the repository of the"
            " simulator, or of its adapter."
        )
    return Path(found)


def address() -> str | None:
    """Return OWNER/REPOSITORY of the remote "origin" at GitHub; None if it is elsewhere."""
    remote = _git("remote", "get-url", "origin") or ""
    found = re.search(r"github\.com[:/]([\w.-]+/[\w.-]+?)(?:\.git)?/?$", remote)
    return found and found[1]


def install_command(folder: Path) -> str | None:
    """Return the command that installs the package of a repository; None if it has none in Python
    at its root or in `python/`.
    """
    for name in ("", "python"):
        if any((folder / name / file).is_file() for file in ("pyproject.toml", "setup.py")):
            return f"{INSTALL} ./{name}" if name else f"{INSTALL} ."
    return None


def engines(folder: Path) -> list[str]:
    """Return the names of the engines that the package of a repository offers to kincheck.

    Raises:
        KincheckError: its pyproject.toml cannot be read.
    """
    found: list[str] = []
    for file in (folder / "pyproject.toml", folder / "python/pyproject.toml"):
        if file.is_file():
            try:
                document: dict[str, Any] = tomllib.loads(file.read_text("utf-8"))
            except (OSError, ValueError) as error:
                raise KincheckError(f"{file}: cannot be read ({error}). Mend it.") from None
            points = document.get("project", {}).get("entry-points", {})
            found += points.get(GROUP, {})
    return found


def _git(*words: str) -> str | None:
    """Return the answer of git; None if it fails."""
    try:
        done = subprocess.run(("git", *words), capture_output=True, text=True, check=False)
    except OSError as error:
        raise KincheckError(f"nightly init: git cannot be run ({error}). Install git.") from None
    return done.stdout.strip() if done.returncode == 0 else None
