"""Loading of a user's objects by module and name. Only the command line names them; a case file
imports nothing.
"""

from __future__ import annotations

import importlib
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from ..errors import KincheckError, similar

# Files and pseudo-files whose lines do not explain a failed import, and the number of lines shown
# from other files.
_NOT_THEIRS, MOST_PLACES = (str(Path(__file__).parents[1]), importlib.__file__, "<"), 3


def _raised(error: Exception) -> str:
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
    from ..harness.execution import error_text  # slow

    message = error_text(error)
    # a syntax error has its place outside the traceback
    if isinstance(error, SyntaxError) and error.text:
        message = f"{type(error).__name__}: {error.msg}"
        places.append(f"{error.filename}, line {error.lineno}: {error.text.strip()}")
    return f"{message} ({', called from '.join(reversed(places))})" if places else message


def _members(module: ModuleType, offered: Callable[[object], bool]) -> list[str]:
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
        if offered(each) and f"{getattr(each, '__module__', '')}.".startswith(f"{module.__name__}.")
    ]


def load_named(where: str, kind: str, offered: Callable[[object], bool]) -> Any:
    """Return the object at MODULE:NAME; modules of the current folder are found too.

    Args:
        kind: "joint" or "engine", for messages.
        offered: tells whether an object is of the kind, for the list of candidates in a message.

    Raises:
        KincheckError: there is no such module or name, or the module cannot be imported.
    """
    module_name, _, name = where.partition(":")
    if not (module_name and name):
        raise KincheckError(
            f"{where!r} names no class; write MODULE:CLASS, such as my_{kind}:My{kind.capitalize()}"
            f" for a class in my_{kind}.py"
        )
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        module = importlib.import_module(module_name)
        found = getattr(module, name, None)
        members = [] if found is not None else _members(module, offered)
    except SystemExit as end:  # a script; its exit would skip the check and set the exit status
        raise KincheckError(
            f"module {module_name!r} ends the process when it is imported (status {end.code});"
            ' guard what it does there by if __name__ == "__main__":'
        ) from end
    except Exception as error:  # any error of the module's own code
        if isinstance(error, ModuleNotFoundError) and f"{module_name}.".startswith(
            f"{error.name}."
        ):
            raise KincheckError(
                f"there is no module {module_name!r}; start in its folder, or install it, and leave"
                " out the ending .py"
            ) from error
        raise KincheckError(
            f"module {module_name!r} cannot be imported: {_raised(error)}; correct it"
        ) from error
    if found is None:
        close = similar(name, members)
        known = ", ".join(members) or "none"
        remedy = f"did you mean {close!r}?" if close else f"its {kind}s: {known}"
        raise KincheckError(f"module {module_name!r} has no class {name!r}; {remedy}")
    return found
