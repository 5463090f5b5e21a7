"""Joint types of users, loaded by module and class. The command line alone names them; a case
file imports nothing.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from ..errors import KincheckError, similar
from ..harness.execution import said
from ..joints import Coupler, Joint

# Files, also pseudo-files, whose lines do not explain a failed import; and the number of lines
# shown of other files.
_NOT_THEIRS, MOST_PLACES = (str(Path(__file__).parents[1]), importlib.__file__, "<"), 3

INSTALLED = "site-packages"
"""Folder of installed modules: a module in it below the user's folder does not
belong to the user.
"""


def _raised(error: Exception) -> str:
    """Return the text of an error of an import with its places, the last first, without those in
    the importer and in kincheck.
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
    told = said(error)
    # a syntax error has a place of its own, outside the traceback
    if isinstance(error, SyntaxError) and error.text:
        told = f"{type(error).__name__}: {error.msg}"
        places.append(f"{error.filename}, line {error.lineno}: {error.text.strip()}")
    return f"{told} ({', called from '.join(reversed(places))})" if places else told


def _joints(module: ModuleType) -> list[str]:
    """Return the names of the joint types that a module or package defines itself, including those
    that it loads on first use.
    """
    offered = {
        name: getattr(module, name, None)
        for name in sorted({*dir(module), *getattr(module, "__all__", ())})
    }
    joints = {
        name: each
        for name, each in offered.items()
        if isinstance(each, type) and issubclass(each, Joint)
    }
    return [
        name
        for name, each in joints.items()
        if each is not Joint and f"{each.__module__}.".startswith(f"{module.__name__}.")
    ]


def load_joint(where: str) -> type[Joint]:
    """Return the joint class at MODULE:CLASS; modules of the current folder are found too.

    Case files can name it from then on.

    Raises:
        KincheckError: there is no such module or class, it is no joint, its type is missing or
            taken, or the module cannot be imported.
    """
    module_name, _, name = where.partition(":")
    if not (module_name and name):
        raise KincheckError(
            f"{where!r} names no class; write MODULE:CLASS, such as my_joint:MyJoint for a class in"
            " my_joint.py"
        )
    if "" not in sys.path:
        sys.path.insert(0, "")
    try:
        module = importlib.import_module(module_name)
        found = getattr(module, name, None)
        joints = [] if found is not None else _joints(module)
    except SystemExit as end:  # a script: the end would skip the check and set its status
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
        close = similar(name, joints)
        remedy = (
            f"did you mean {close!r}?" if close else f"its joints: {', '.join(joints) or 'none'}"
        )
        raise KincheckError(f"module {module_name!r} has no class {name!r}; {remedy}")
    if not (isinstance(found, type) and issubclass(found, Joint)):
        raise KincheckError(f"{where} is no joint type; derive it from kincheck.core.Joint")
    named = getattr(found, "type", None)
    if not (isinstance(named, str) and named):
        raise KincheckError(
            f'{where} has no type, the name of joints like it in case files; write type = "..." in'
            " the class"
        )
    if named in Coupler.registry:
        raise KincheckError(
            f"{where}: the type {named!r} is that of joints that couple two others; give it another"
        )
    return found


def sources(names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of the source of every module behind joint types at MODULE:CLASS,
    by module name.

    Included are the modules themselves and those loaded from their folders or below, but neither
    installed modules nor kincheck's. Modules imported only later, and files read by a module,
    are not included.
    """
    named = [sys.modules.get(name.partition(":")[0]) for name in names]
    folders = {
        file.parent
        for module in named
        if module is not None and (file := _file(module)) is not None
    }
    found: dict[str, str] = {}
    for name, module in sorted(sys.modules.items()):
        file = _file(module)
        if file is None or name.split(".")[0] == "kincheck":
            continue
        beside = any(
            file.is_relative_to(each) and INSTALLED not in file.relative_to(each).parts
            for each in folders
        )
        if beside or module in named:
            found[name] = hashlib.sha256(file.read_bytes()).hexdigest()
    return found


def _file(module: object) -> Path | None:
    """Return the file a module was loaded from; None if there is no readable one."""
    name = getattr(module, "__file__", None)
    file = Path(name).resolve() if isinstance(name, str) else None
    return file if file is not None and file.is_file() else None
