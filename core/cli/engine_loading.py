"""Engines of users and of other packages: a class by module and name, or by entry point."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from .class_loading import load_named

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from ..harness.engine import Engine

GROUP = "kincheck.engines"
"""Entry-point group of engines in other packages: name = "module:Class"."""

WHERE = re.compile(r"[\w.]+:[\w.]+")
"""MODULE:CLASS, which is neither the name of an engine nor the path of a case file."""

MEMBERS = ("name", "mode", "loop", "settings", "version", "unsupported", "build", "solve")
"""Attributes and methods of an engine; see `Engine`."""


def load_engine(where: str) -> Engine:
    """Return the engine at MODULE:CLASS; a class or function is called without arguments.

    Raises:
        KincheckError: there is no such module or class, the module cannot be imported, the call
            fails, or a member of the engine protocol is missing.
    """
    return made(where, load_named(where, "engine", _is_engine))


def made(where: str, found: Any) -> Engine:
    """Return the engine that a class or function creates, or the engine itself.

    Raises:
        KincheckError: the call fails, or a member of the engine protocol is missing.
    """
    try:
        engine: Any = found() if callable(found) else found
    except Exception as error:  # any error of the engine's own code
        raise KincheckError(
            f"{where} cannot be created: {type(error).__name__}: {error}; it is called without"
            " arguments"
        ) from error
    missing = [name for name in MEMBERS if not hasattr(engine, name)]
    if missing:
        raise KincheckError(
            f"{where} is no engine: {', '.join(missing)} missing; see"
            " kincheck.core.harness.engine.Engine"
        )
    return engine


def _is_engine(each: object) -> bool:
    return isinstance(each, type) and all(hasattr(each, name) for name in MEMBERS[4:])


@cache
def entry_points() -> Mapping[str, EntryPoint]:
    """Return the engines of other installed packages, by name."""
    from importlib import metadata  # slow

    return {each.name: each for each in metadata.entry_points(group=GROUP)}


def offered(known: Sequence[str]) -> tuple[str, ...]:
    """Return the names of other packages' engines.

    Args:
        known: names of kincheck's own engines.

    Raises:
        KincheckError: another package's engine has one of these names.
    """
    for name, each in entry_points().items():
        if name in known:
            raise KincheckError(
                f"package {each.dist.name if each.dist else each.value!r} offers an engine named"
                f" {name!r}, which is kincheck's own; rename its entry point"
            )
    return tuple(entry_points())
