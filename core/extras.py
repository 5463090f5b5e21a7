"""Libraries: optional ones on use, the command to install a missing one, and threads of numpy."""

from __future__ import annotations

import importlib
import re
import shlex
from typing import Any

from .errors import KincheckError

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that set the number of linear algebra threads when numpy is loaded."""


def how_to_install(extra: str) -> str:
    """Return the command to install an extra, from kincheck's own metadata. An engine's extra
    has the engine's name up to a hyphen.
    """
    wanted = _requirements(extra)
    return f"pip install {shlex.join(wanted)}" if wanted else f"install what {extra} needs"


def installed_version(extra: str) -> str | None:
    """Return the version of an extra's first distribution, from its metadata, without importing it;
    None if it is not installed.
    """
    import importlib.metadata  # rarely needed, and slow

    try:
        return importlib.metadata.version(distribution_of(extra) or "-")
    except (ValueError, importlib.metadata.PackageNotFoundError):
        return None


def distribution_of(extra: str) -> str | None:
    """Return the name of an extra's first distribution; None if there is no such extra."""
    first = next(iter(_requirements(extra)), "")
    return re.split(r"[^\w.-]", first, maxsplit=1)[0] or None


def is_extra(name: str) -> bool:
    """Return whether kincheck has an extra for the engine of a name."""
    return bool(_requirements(name))


def _requirements(extra: str) -> list[str]:
    """Return the requirements of an extra, from kincheck's own metadata."""
    import importlib.metadata

    return [
        requirement.split(";")[0].strip()
        for requirement in importlib.metadata.requires("kincheck") or []
        if re.search(rf"""extra == ['"]{extra.split("-")[0]}['"]""", requirement)
    ]


def library(purpose: str, module: str, extra: str) -> Any:
    """Return an optional module.

    Args:
        purpose: the subject of the message, such as "to_dataframe".

    Raises:
        KincheckError: the module is not installed, or cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        absent = error.name if isinstance(error, ModuleNotFoundError) else None
        missing = (absent or "").partition(".")[0] == name
        found = "which is not installed" if missing else f"which cannot be imported ({error})"
        raise KincheckError(f"{purpose} needs {name}, {found}: {how_to_install(extra)}") from error
