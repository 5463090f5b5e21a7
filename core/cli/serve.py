"""kincheck serve: a page that answers while a design is edited or a mechanism is moved."""

from __future__ import annotations

import argparse
import webbrowser
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import import_options
from .option_types import whole
from .registry import Registry, Status
from .run_options import TOL

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.record import Record


def add(commands: Any) -> None:
    """Add the command to the parser."""
    serving: argparse.ArgumentParser
    serving = commands.add_parser(
        "serve",
        help="edit a suspension or move a mechanism in a browser",
        description=_serve.__doc__,
    )
    serving.set_defaults(do=_serve)
    serving.add_argument(
        "file", metavar="FILE", help="table of hardpoints, case file, model, or built-in case"
    )
    serving.add_argument(
        "--port",
        type=whole(0),
        default=0,
        metavar="N",
        help="port of this machine; default: a free one",
    )
    serving.add_argument(
        "--no-browser", action="store_true", help="print the address, and open no browser"
    )
    serving.add_argument(
        "--once", action="store_true", help="end when the page is closed, with status 0"
    )
    import_options.add_options(serving)


def _serve(options: argparse.Namespace, registry: Registry) -> int:
    """Serve a page on this machine alone. On a table of hardpoints it shows curves, scene and key
    numbers of the design while points are dragged or typed; on any other mechanism, its pose while
    drivers are moved by sliders.

    The one line printed is its address, with a token that it asks for. Numbers go to new files
    only. Ctrl-C ends it, with status 130; status 2 means that the file cannot be read or the port
    cannot be used.
    """
    from ..case.models.files import is_table
    from ..live.model import LiveModel
    from ..live.server import Live, LiveServer
    from ..live.table import LiveTable

    file, supplied = Path(options.file), import_options.supplied(options)

    def opened() -> Live:
        named = options.file not in registry.cases() and file.is_file()
        if named and is_table(file, supplied):
            return LiveTable(file, supplied)
        return LiveModel(file, registry.find_case(options.file, supplied))

    server = LiveServer(
        file, opened, registry.engines, judge_by(registry), port=options.port, once=options.once
    )
    try:
        print(server.address, flush=True)
        if not options.no_browser:
            webbrowser.open(server.address)
        server.ended.wait()
    finally:
        server.close()
    return Status.WITHIN


def judge_by(registry: Registry) -> Callable[[Case, Sequence[str], Callable[[Record], None]], None]:
    """Return the function that solves a case by engines in worker processes."""

    def judge(case: Case, names: Sequence[str], tell: Callable[[Record], None]) -> None:
        from ..harness.resource_limits import Limits
        from ..harness.run import run
        from ..harness.workers.pool import in_workers

        engines = registry.find_engines(names, [])
        run(
            [case],
            engines,
            tol=TOL,
            baseline=registry.baseline(engines),
            solver=in_workers(1, Limits()),
            progress=lambda record, done, total: tell(record),
        )

    return judge
