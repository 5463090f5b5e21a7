"""Loading of a user's objects by module and name. Only the command line names them; a case file
imports nothing.
"""

from __future__ import annotations

import importlib
import re
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..doors import entry_points
from ..errors import KincheckError, similar

if TYPE_CHECKING:
    from ..harness.engine import Engine


# Files and pseudo-files whose lines do not explain a failed import, and the number of lines shown
# from other files.
_NOT_THEIRS, MOST_PLACES = (str(Path(__file__).parents[1]), importlib.__file__, "<"), 3


def _import_error_text(error: Exception) -> str:
    """Return the text of an import error with its places, the last first, except places in the
    importer and in kincheck.
    """
    frames = [
        each
        for each in traceback.extract_tb(error.__traceback__)
        if not each.filename.startswith(_NOT_THEIRS)
    ]
    places = [
        f"{each.filename}, line {each.lineno}: {each.line}"
        for each in (*frames[:MOST_PLACES], *frames[MOST_PLACES:][-1:])
    ]
    from ..harness.execution import error_text

    message = error_text(error)
    # a syntax error has its place outside the traceback
    if isinstance(error, SyntaxError) and error.text:
        message = f"{type(error).__name__}: {error.msg}"
        places.append(f"{error.filename}, line {error.lineno}: {error.text.strip()}")
    return f"{message} ({', called from '.join(reversed(places))})" if places else message


def _members(module: ModuleType, is_wanted: Callable[[object], bool]) -> list[str]:
    """Return the names of the wanted objects that a module or package defines or loads on first
    use; objects imported from elsewhere are left out.
    """
    found = {
        name: getattr(module, name, None)
        for name in sorted({*dir(module), *getattr(module, "__all__", ())})
    }
    return [
        name
        for name, each in found.items()
        if is_wanted(each)
        and f"{getattr(each, '__module__', '')}.".startswith(f"{module.__name__}.")
    ]


def load_named(where: str, kind: str, is_wanted: Callable[[object], bool]) -> Any:
    """Return the object at MODULE:NAME; modules of the current folder are found too.

    Args:
        kind: "joint" or "engine", for messages.
        is_wanted: tells whether an object is of the kind, for the list of candidates in a message.

    Raises:
        KincheckError: there is no such module or name, or the module cannot be imported.
    """
    module_name, _, name = where.partition(":")
    if not (module_name and name):
        raise KincheckError(
            f"{where!r} names no class. Write MODULE:CLASS, such as my_{kind}:My{kind.capitalize()}"
            f" for a class in my_{kind}.py."
        )
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        module = importlib.import_module(module_name)
        found = getattr(module, name, None)
        members = [] if found is not None else _members(module, is_wanted)
    except SystemExit as end:  # a script; its exit would skip the check and set the exit status
        raise KincheckError(
            f"module {module_name!r} ends the process when it is imported (status {end.code})."
            ' Guard what it does there by if __name__ == "__main__":'
        ) from end
    except Exception as error:  # any error of the module's own code
        if isinstance(error, ModuleNotFoundError) and f"{module_name}.".startswith(
            f"{error.name}."
        ):
            raise KincheckError(
                f"there is no module {module_name!r}. Start in its folder, or install it, and leave"
                " out the ending .py."
            ) from error
        raise KincheckError(
            f"module {module_name!r} cannot be imported: {_import_error_text(error)}. Correct it."
        ) from error
    if found is None:
        close = similar(name, members)
        known = ", ".join(members) or "none"
        remedy = f"did you mean {close!r}?" if close else f"its {kind}s: {known}"
        raise KincheckError(f"module {module_name!r} has no class {name!r}; {remedy}")
    return found


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
    return create_engine(where, load_named(where, "engine", _is_engine))


def create_engine(where: str, found: Any) -> Engine:
    """Return the engine that a class or function creates, or the engine itself.

    Raises:
        KincheckError: the call fails, or a member of the engine protocol is missing.
    """
    try:
        engine: Any = found() if callable(found) else found
    except Exception as error:  # any error of the engine's own code
        raise KincheckError(
            f"{where} cannot be created: {type(error).__name__}: {error}. It must be"
            " possible to call it without arguments."
        ) from error
    missing = [name for name in MEMBERS if not hasattr(engine, name)]
    if missing:
        raise KincheckError(
            f"{where} is no engine: {', '.join(missing)} missing. See"
            " kincheck.core.harness.engine.Engine."
        )
    return engine


def _is_engine(each: object) -> bool:
    return isinstance(each, type) and all(hasattr(each, name) for name in MEMBERS[4:])


def names_of_entry_points(known: Sequence[str]) -> tuple[str, ...]:
    """Return the names of other packages' engines.

    Args:
        known: names of kincheck's own engines.

    Raises:
        KincheckError: another package's engine has one of these names.
    """
    for name, each in entry_points(GROUP).items():
        if name in known:
            raise KincheckError(
                f"package {each.dist.name if each.dist else each.value!r} offers an engine named"
                f" {name!r}, which is kincheck's own. Rename its entry point."
            )
    return tuple(entry_points(GROUP))
