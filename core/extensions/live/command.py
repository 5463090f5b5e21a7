"""kincheck serve: a page that answers while a design is edited or a mechanism is moved."""

from __future__ import annotations

import shlex
import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.atomic_files import require_writable, written
from ...case.io.reader_options import CurveOptions, Supplied
from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL, with_references
from ...errors import KincheckError, refuse
from ...options import argument, destination, group, joint_types, option, options, switch, whole
from ...report.progress import complain

if TYPE_CHECKING:
    from ...case.case import Case
    from ...harness.record import Record, Results
    from ..hardpoints.guess import Guess
    from .server import Judge, Live, LiveServer


@options
class Serve(Command):
    """Serve a page on this machine alone. On a table of hardpoints it shows curves, scene and key
    numbers of the design while points are dragged or typed; on any other mechanism, its pose while
    drivers are moved by sliders.

    The one line printed is its address, with a token that it asks for. Numbers go to new files
    only. Ctrl-C ends it, with status 130; status 2 means that the file cannot be read or the port
    cannot be used.

    A table without names of roles has a page of its own first: its points in 3D with proposed
    roles, and a button to save them as a file of names.
    """

    about = "edit a suspension or move a mechanism in a browser"
    case: str | Path | Case = argument(
        "table of hardpoints, case file, model, or built-in case", "FILE"
    )
    port: int = option(
        "port of this machine; default: a free one", whole(0), "N", default=0, init=False
    )
    no_browser: bool = switch("print the address, and open no browser", init=False)
    once: bool = switch("end when the page is closed, with status 0", init=False)
    save: Path | None = destination(
        "write the page to this file instead, with its solver in it: it opens without"
        " server and Python, and has no engines to check by",
        Path,
        init=False,
    )
    measure: int | None = option(
        "make N edits of a table, print how long each step takes, in the browser too unless"
        " --no-browser, and end",
        whole(1),
        "N",
        init=False,
    )
    reference: str | Path | None = option(
        "measured curve (.csv, .xlsx, ...) or proved reference (.json) to lay over the curves,"
        " with its tolerance",
        Path,
        "FILE",
        default=None,
    )
    variation: str | Path | None = option(
        "tolerances of a table, as of kincheck sweep: histograms, and limits in the curves",
        Path,
        "FILE",
        flag="--vary",
        default=None,
    )
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)
    curve: CurveOptions = group(default_factory=CurveOptions, init=False)

    def answer(self, registry: Registry) -> LiveServer:
        """Serve the page of `kincheck serve`; a notebook on this machine shows it in a frame.

        The server's `case` has the numbers of the page, and its `close` ends it.

        Raises:
            KincheckError: the file cannot be read, or a library is missing.
        """
        return self._server(registry, self._reader(registry, named=False), framed=True)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        if not self.reference and self.curve.without_curve:
            raise KincheckError(self.curve.without_curve)
        wanted = self.measure or 0
        read = self._reader(registry, named=not (wanted or self.save))
        if self.save:
            return self._write_page(read())
        if wanted:
            _measure_edits(read(), wanted)
            if self.no_browser:
                return Status.WITHIN
        how = {"port": self.port, "once": self.once, "measuring": wanted > 0}
        server = self._server(registry, read, **how)
        try:
            address = server.address + f"&measure={wanted}" * bool(wanted)
            print(address, flush=True)
            if not self.no_browser and not webbrowser.open(address) and wanted:
                raise KincheckError(
                    "--measure: no browser is found; give --no-browser, or set BROWSER"
                )
            server.ended.wait()
        finally:
            server.close()
        if wanted:
            _print_times("browser", server.measured)
        return Status.WITHIN

    def _write_page(self, live: Live) -> int:
        from .naming import LiveNaming
        from .saved import saved_page

        served = {"--port": self.port, "--once": self.once, "--measure": self.measure}
        for name, given in (served | {"--vary": self.variation}).items():
            if given:
                raise KincheckError(f"{name}: a saved page has no server. Leave it out, or --save.")
        assert self.save
        assert not isinstance(live, LiveNaming)
        require_writable([("--save", self.save)])
        refuse(written(self.save, saved_page(live).encode()))
        print(self.save)
        return Status.WITHIN

    def _server(self, registry: Registry, read: Callable[[], Live], **how: Any) -> LiveServer:
        from .server import LiveServer

        return LiveServer(self._file, read, registry.engines, judge_by(registry), **how)

    @property
    def _file(self) -> Path:
        return Path(self.case if isinstance(self.case, str | Path) else self.case.name)

    def _reader(self, registry: Registry, *, named: bool) -> Callable[[], Live]:
        """Return the function that opens a table of hardpoints, or any other mechanism.

        Args:
            named: whether points of a table without roles are named first.
        """
        from ..hardpoints.reader import is_table
        from .model import LiveModel
        from .naming import LiveNaming, naming_of
        from .table import LiveTable

        told, supplied = list[str](), self.supplied

        def with_reference(case: Case) -> Case:
            if self.reference is None:
                return case
            (case,), notes = with_references([case], [Path(self.reference)], self.curve, None)
            if self.command and told != notes:
                told[:] = notes
                complain(notes)
            return replace(case, assembly=(*case.assembly, *notes))

        def with_names(guess: Guess, names: Path) -> None:
            nonlocal supplied
            said: Any = replace(guess.taken, names=names)
            supplied = said
            stated = [*guess.question().options[:-1], str(names)]
            complain([f"{names} is written. Next time, add: {shlex.join(stated)}"])

        def read() -> Live:
            case, file, vary = self.case, self._file, self.variation
            typed = isinstance(case, str | Path) and str(case) not in registry.cases()
            if typed and file.is_file() and is_table(file, supplied):
                if named and (guess := naming_of(file, supplied)):
                    return LiveNaming(guess, with_names)
                return LiveTable(file, supplied, with_reference, Path(vary) if vary else None)
            if vary:
                raise KincheckError(f"--vary: {file} is no table of hardpoints; give one")
            return LiveModel(file, with_reference(registry.find_case(case, supplied)))

        return read


def _print_times(name: str, times: Sequence[float]) -> None:
    from statistics import median

    print(f"  {name:<9} median {median(times):8.2f} ms, most {max(times):8.2f} ms")


def _measure_edits(live: Live, count: int) -> None:
    """Print the times of edits: of each step and of a whole answer as JSON, and the processor's
    share of it, free of other programs.
    """
    import statistics
    from time import perf_counter, process_time

    from .protocol import Solve, encode
    from .table import LiveTable

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
        from ...harness.resource_limits import Limits
        from ...harness.run import run
        from ...harness.workers.pool import in_workers

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
