"""Cross-validation of the kinematics and forces of constrained multibody systems.

    import kincheck

    case = kincheck.load("rssr")
    results = kincheck.run(case, engines=["native", "mujoco"])

The package also has all names of `kincheck.core`. Each is imported on first use, so that the
command line and pytest start without numpy.

This folder is the package kincheck; its parts are in other folders. Imports of them are absolute,
because in the sources a relative import would look in this folder.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from kincheck import core

if TYPE_CHECKING:
    from kincheck import primitives
    from kincheck.by_name import (
        check_engine,
        compare,
        compliance,
        curves,
        curves_by_chunk,
        explain,
        free,
        live,
        load,
        report,
        run,
        sweep,
    )
    from kincheck.core import *  # noqa: F403  # pyright: ignore[reportWildcardImportFromLibrary]

__all__ = [
    "check_engine",
    "compare",
    "compliance",
    "curves",
    "curves_by_chunk",
    "explain",
    "free",
    "live",
    "load",
    "primitives",
    "report",
    "run",
    "sweep",
]
__all__ += core.__all__


if not TYPE_CHECKING:  # otherwise type checkers would accept any name

    def __getattr__(name: str) -> Any:
        """Import a public name on first use."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if name == "primitives":
            found = import_module("kincheck.primitives")
        else:
            module = core if name in core.__all__ else import_module("kincheck.by_name")
            found = getattr(module, name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    """Return the public names, whether loaded or not."""
    return sorted({*globals(), *__all__})
