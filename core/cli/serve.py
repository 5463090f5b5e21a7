"""kincheck serve: a page that answers while a design is edited or a mechanism is moved."""

from __future__ import annotations

import argparse
import webbrowser
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from ..report.progress import complain
from . import import_options
from .option_types import whole
from .registry import Registry, Status
from .run_options import TOL, add_curve_options, curve_options, judged

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.io.reader_options import Supplied
    from ..harness.record import Record, Results
    from ..live.server import Judge, Live


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
    serving.add_argument(
        "--measure",
        type=whole(1),
        metavar="N",
        help=(
            "make N edits of a table, print how long each step takes, in the browser too unless"
            " --no-browser, and end"
        ),
    )
    serving.add_argument(
        "--reference",
        type=Path,
        metavar="FILE",
        help=(
            "measured curve (.csv, .xlsx, ...) or proved reference (.json) to lay over the curves,"
            " with its tolerance"
        ),
    )
    serving.add_argument(
        "--vary",
        type=Path,
        metavar="FILE",
        help="tolerances of a table, as of kincheck sweep: histograms, and limits in the curves",
    )
    import_options.add_options(serving)
    add_curve_options(serving)


def _serve(options: argparse.Namespace, registry: Registry) -> int:
    """Serve a page on this machine alone. On a table of hardpoints it shows curves, scene and key
    numbers of the design while points are dragged or typed; on any other mechanism, its pose while
    drivers are moved by sliders.

    The one line printed is its address, with a token that it asks for. Numbers go to new files
    only. Ctrl-C ends it, with status 130; status 2 means that the file cannot be read or the port
    cannot be used.
    """
    from ..live.server import LiveServer

    file, supplied = Path(options.file), import_options.supplied(options)
    curve = curve_options(options)
    if not options.reference and curve.without_curve:
        raise KincheckError(curve.without_curve)

    def referenced(case: Case) -> Case:
        if not options.reference:
            return case
        (case,), notes = judged([case], [options.reference], curve, None)
        if told != notes:
            told[:] = notes
            complain(notes)
        return case

    def read() -> Live:
        return opened(registry, options.file, supplied, referenced, options.vary)

    told = list[str]()
    wanted: int = options.measure or 0
    if wanted:
        _measured(read(), wanted)
        if options.no_browser:
            return Status.WITHIN
    server = LiveServer(
        file, read, registry.engines, judge_by(registry), port=options.port, once=options.once
    )
    try:
        address = server.address + f"&measure={wanted}" * bool(wanted)
        print(address, flush=True)
        if not options.no_browser and not webbrowser.open(address) and wanted:
            raise KincheckError("--measure: no browser is found; give --no-browser, or set BROWSER")
        server.ended.wait()
    finally:
        server.close()
    if wanted:
        _print_times("browser", server.measured)
    return Status.WITHIN


def opened(
    registry: Registry,
    name: str,
    supplied: Supplied,
    referenced: Callable[[Case], Case],
    vary: Path | None,
) -> Live:
    """Return a table of hardpoints with its file of tolerances, or any other mechanism, opened.

    Raises:
        KincheckError: it cannot be read, or there are tolerances of no table.
    """
    from ..case.models.files import is_table
    from ..live.model import LiveModel
    from ..live.table import LiveTable

    file = Path(name)
    if name not in registry.cases() and file.is_file() and is_table(file, supplied):
        return LiveTable(file, supplied, referenced, vary)
    if vary:
        raise KincheckError(f"--vary: {file} is no table of hardpoints; give one")
    return LiveModel(file, referenced(registry.find_case(name, supplied)))


def _print_times(name: str, times: Sequence[float]) -> None:
    from statistics import median

    print(f"  {name:<9} median {median(times):8.2f} ms, most {max(times):8.2f} ms")


def _measured(live: Live, count: int) -> None:
    """Print the times of edits: of each step and of a whole answer as JSON, and the processor's
    share of it, free of other programs.
    """
    import statistics
    from time import perf_counter, process_time

    from ..live.protocol import Solve, encode
    from ..live.table import LiveTable

    if not isinstance(live, LiveTable):
        raise KincheckError(f"--measure: {live.file} is no table of hardpoints; give one")
    points, steps = live.positions, dict[str, list[float]]()
    size = max(abs(x) for row in points for x in row)
    for k in range(count):
        moved = [(x, y + 1e-3 * size * (k % 11 - 5) / 5, z) for x, y, z in points]
        begin, worked = perf_counter(), process_time()
        found = live.solve(Solve(points=moved))
        sent = encode(found)
        whole = {"answer": perf_counter() - begin, "processor": process_time() - worked}
        steps.setdefault("bytes", []).append(float(len(sent)))
        for name, each in (found.milliseconds | {k: 1e3 * v for k, v in whole.items()}).items():
            steps.setdefault(name, []).append(each)
    size_sent = statistics.median(steps.pop("bytes"))
    samples = len(live.case.sweep.values)
    print(f"{live.file.name}: {count} edits, {samples} samples, {size_sent:.0f} bytes each")
    for name, each in steps.items():
        _print_times(name, each)


def judge_by(registry: Registry) -> Judge:
    """Return the function that solves a case by engines in worker processes."""

    def judge(case: Case, names: Sequence[str], tell: Callable[[Record], None]) -> Results:
        from ..harness.resource_limits import Limits
        from ..harness.run import run
        from ..harness.workers.pool import in_workers

        engines = registry.find_engines(names, [])
        return run(
            [case],
            engines,
            tol=TOL,
            baseline=registry.baseline(engines),
            solver=in_workers(1, Limits()),
            progress=lambda record, done, total: tell(record),
        )

    return judge
