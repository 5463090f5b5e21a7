"""Functions on cases and engines by name, as on the command line."""

from pathlib import Path
from typing import Any

from kincheck.core import KincheckError
from kincheck.core.case.case import Case
from kincheck.core.case.io.reader_options import NOTHING, Supplied
from kincheck.core.cli.main import function, registry
from kincheck.core.cli.parser import Command
from kincheck.core.cli.run import Run
from kincheck.core.doors import offers
from kincheck.core.harness.record import Results
from kincheck.core.report.report import write_report

run = function("run", Run)


def offered(name: str) -> Any:
    """Return what an extension offers under a name; of a command, its function.

    Raises:
        TypeError: the command has no answer.
    """
    found: Any = offers("public")[name].load()
    kind: object = found
    if isinstance(kind, type) and issubclass(kind, Command):
        if not hasattr(kind, "answer"):
            raise TypeError(f"kincheck.{name}: {found.__name__} has no method answer(registry)")
        found = function(name, found)
    return found


def load(name: str | Path, supplied: Supplied = NOTHING) -> Case:
    """Return the built-in case of a name, or the case in a file.

    Args:
        name: name of the case, or path to a case file, hardpoint table or model.
        supplied: facts missing in a file of another tool.

    Raises:
        KincheckError: there is no such case, or its file is invalid.
    """
    return registry().find_case(name, supplied, driven=False)


def report(results: Results, file: str | Path) -> None:
    """Write results as the report of `kincheck run --out`: one HTML file, worst first.

    Raises:
        KincheckError: these are no results.
        OSError: the file cannot be written.
    """
    if not isinstance(results, Results):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise KincheckError(f"report: found {results!r}, expected what kincheck.run returns")
    write_report(results, Path(file))
