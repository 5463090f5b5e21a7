"""Cross-validation of the kinematics and forces of constrained multibody systems.

    import kincheck

    case = kincheck.load("rssr")
    results = kincheck.run(case, engines=["native", "mujoco"])

The package also has all names of `kincheck.core`. Each is imported on first use, so that the
command line and pytest start without numpy.

This folder is the package kincheck; its parts are in other folders. Imports of them are absolute,
because in the sources a relative import would look in this folder.
"""

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from kincheck import core

if TYPE_CHECKING:
    from kincheck import primitives
    from kincheck.by_name import load, report, run
    from kincheck.core import *  # noqa: F403  # pyright: ignore[reportWildcardImportFromLibrary]

    __all__ = ["load", "primitives", "report", "run"]
    __all__ += core.__all__

    # what extensions offer has no type here: the kernel names none of them
    def __getattr__(name: str) -> Any: ...


_OWN = ("load", "primitives", "report", "run")


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Import a public name on first use: of this package, of the core, or of an extension."""
        if name == "__all__":
            found = __dir__()
        elif name == "primitives":
            found = import_module("kincheck.primitives")
        elif name in _OWN:
            found = getattr(import_module("kincheck.by_name"), name)
        elif name in core.__all__:
            found = getattr(core, name)
        elif name in _offered():
            found = import_module("kincheck.by_name").offered(name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    """Return the public names, whether loaded or not."""
    return sorted({*_OWN, *core.__all__, *_offered()})


def _offered() -> Iterable[str]:
    from kincheck.core.doors import offers

    return offers("public")
