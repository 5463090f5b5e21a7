"""Joint types and engines of users: a class given by module and name, and the sources behind it."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable
from pathlib import Path

from ..errors import KincheckError, unknown
from ..joints import Coupler, Joint
from .class_loading import load_named

INSTALLED = "site-packages"
"""Name of folders of installed modules: a module there is not the user's, even below the user's
folder.
"""


def _is_joint(each: object) -> bool:
    return isinstance(each, type) and issubclass(each, Joint) and each is not Joint


def named_joint(where: str) -> type[Joint]:
    """Return the joint class at MODULE:CLASS, or the built-in one of this type.

    Raises:
        KincheckError: there is no such type; or see `load_joint`.
    """
    if where in Joint.registry:
        return Joint.registry[where]
    if ":" in where:
        return load_joint(where)
    if where in Coupler.registry:
        raise KincheckError(
            f"{where!r} couples two other joints. check-joint checks those between two bodies:"
            f" {', '.join(sorted(Joint.registry))}."
        )
    raise KincheckError(
        f"{unknown('joint type', where, sorted(Joint.registry))}; write MODULE:CLASS"
        " for your own class, such as my_joint:MyJoint for a class in my_joint.py."
    )


def load_joint(where: str) -> type[Joint]:
    """Return the joint class at MODULE:CLASS; modules of the current folder are found too.

    From then on, case files can name it.

    Raises:
        KincheckError: there is no such module or class, it is no joint, its type is missing or
            taken, or the module cannot be imported.
    """
    found = load_named(where, "joint", _is_joint)
    if not (isinstance(found, type) and issubclass(found, Joint)):
        raise KincheckError(f"{where} is no joint type. Derive it from kincheck.core.Joint.")
    named = getattr(found, "type", None)
    if not (isinstance(named, str) and named):
        raise KincheckError(
            f'{where} has no type, the name of such joints in case files. Write type = "..." in'
            " the class."
        )
    if named in Coupler.registry:
        raise KincheckError(
            f"{where}: the type {named!r} belongs to joints that couple two others."
            " Give it another."
        )
    return found


def sources(names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of the source of every module behind joint types or engines, by module
    name.

    Included are the modules themselves and those loaded from their folders or below, but neither
    installed modules nor kincheck's. Modules imported only later, and files read by a module,
    are not included.

    Args:
        names: of them, MODULE:CLASS or MODULE.
    """
    named = [module for name in names if (module := sys.modules.get(name.partition(":")[0]))]
    folders = {
        file.parent
        for module in named
        if (file := _file(module)) is not None and INSTALLED not in file.parts
    }
    found: dict[str, str] = {}
    for name, module in sorted(sys.modules.items()) if named else ():
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
