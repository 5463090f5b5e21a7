"""Joint types of users, by module and class. Only who gives a command names them; a case file
imports nothing.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from ...errors import KincheckError, similar
from ...harness.execution import said
from ...joints import Coupler, Joint

# Files whose lines say nothing of an import that fails, also those that are none; and how many
# lines of others are read.
_NOT_THEIRS, MOST_PLACES = (str(Path(__file__).parents[2]), importlib.__file__, "<"), 3

INSTALLED = "site-packages"
"""Folder of installed modules: one of them in the user's folder is not the user's."""


def _raised(error: Exception) -> str:
    """An error of an import with its places, the last first: those of the importer and of kincheck
    are not the user's.
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
    # has a place of its own, where nothing was running yet
    if isinstance(error, SyntaxError) and error.text:
        told = f"{type(error).__name__}: {error.msg}"
        places.append(f"{error.filename}, line {error.lineno}: {error.text.strip()}")
    return f"{told} ({', called from '.join(reversed(places))})" if places else told


def _joints(module: ModuleType) -> list[str]:
    """Names of the joint types that a module or package defines itself, also of one that loads them
    when they are asked for.
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
    """The joint class at MODULE:CLASS; modules of the current folder are found too.

    Case files can name it from then on.

    Raises:
        KincheckError: there is no such module or class, it is no joint, its type is none or taken,
            or the module cannot be imported.
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
    except (
        SystemExit
    ) as end:  # a script: its class would go unchecked, with the status that it ends in
        raise KincheckError(
            f"module {module_name!r} ends the process when it is imported (status {end.code});"
            ' guard what it does there by if __name__ == "__main__":'
        ) from end
    except Exception as error:  # whatever the module does when it is imported
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
    """Return SHA-256 of the source of every module that joint types at MODULE:CLASS come from, by
    its name.

    These are the modules themselves and those that are loaded from their folders or below, not
    installed ones and not kincheck's. A module that is imported only later, and files that a module
    reads, are not among them.
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
    """Return the file that a module was loaded from; None where there is none to be read."""
    name = getattr(module, "__file__", None)
    file = Path(name).resolve() if isinstance(name, str) else None
    return file if file is not None and file.is_file() else None
