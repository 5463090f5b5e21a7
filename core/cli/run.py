"""kincheck run: solve cases with engines and judge the results."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..case.io.escape import visible
from ..errors import KincheckError, SolveError
from ..harness.interrupts import hold, status_of, words_of
from ..report.progress import complain, lacking, progress, uncompared
from . import execution_options, history_options, import_options
from .registry import House, Status

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.record import Record, Results
    from ..history.run_recorder import Keeping
    from .destinations import Destinations

# Largest accepted constraint residual [m or -]: a thousand times the round-off of metre-sized
# coordinates, and a thousandth of the 1e-9 m that outputs are held to, so that a residual amplified
# a hundredfold by the mechanism still cannot be seen.
TOL = 1e-12

MODES = ("projection", "simulate")

HISTORY = "KINCHECK_HISTORY"
"""Environment variable: the history file where --history is not given."""


def add(commands: Any) -> None:
    """Add the command to the parser."""
    run: argparse.ArgumentParser
    run = commands.add_parser(
        "run", help="solve cases with engines and judge the results", description=_run.__doc__
    )
    run.set_defaults(do=_run)
    run.add_argument(
        "case",
        nargs="*",
        metavar="CASE",
        help="built-in name, or path to a case file; default: all built-in cases",
    )
    run.add_argument(
        "--joints",
        action="store_true",
        help="run a small closed loop around every joint type, and the cases named",
    )
    must = "only these, which must be installed (else status 2); default: all engines"
    run.add_argument("--engine", nargs="+", action="extend", default=[], metavar="NAME", help=must)
    run.add_argument(
        "--mode",
        choices=MODES,
        help="the engines' mode; projection, unless an engine named has only the other",
    )
    run.add_argument(
        "--tol",
        type=positive,
        default=TOL,
        metavar="X",
        help=f"largest constraint residual [m or -]; default {TOL:g}",
    )
    run.add_argument(
        "--out", type=Path, metavar="DIR", help="write results.json and report.html there"
    )
    run.add_argument(
        "--bench",
        type=Path,
        metavar="FILE",
        help="show the work-precision data of this bench.json in the report",
    )
    run.add_argument(
        "--json", metavar="FILE", help="write the results as JSON; - for standard output"
    )
    run.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML")
    run.add_argument(
        "--markdown",
        type=Path,
        metavar="FILE",
        help="write the table of cases and engines as Markdown",
    )
    run.add_argument(
        "--reference",
        nargs="+",
        action="extend",
        default=[],
        type=Path,
        metavar="FILE",
        help=(
            "judge cases by these proved references, which kincheck reference wrote, instead of"
            " their own"
        ),
    )
    run.add_argument(
        "--explain",
        action="store_true",
        help="print what the native engine computes for each case, and leaves out",
    )
    run.add_argument(
        "--require",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="engines that must be there and able (else status 2)",
    )
    import_options.add_options(run)
    execution_options.add_options(run, positive)
    run.add_argument(
        "--history",
        type=Path,
        metavar="FILE",
        default=os.environ.get(HISTORY) or None,
        help=(
            "keep the run in this file, each record as it is made; default: the environment"
            f" variable {HISTORY}, else not at all"
        ),
    )
    run.add_argument(
        "--resume",
        action="store_true",
        help=(
            "go on with the last run in the history of the same cases, engines, tolerance, limits,"
            " versions and commit that has no end"
        ),
    )


def positive(text: str) -> float:
    """A positive number, as an option gives it."""
    try:
        tol = float(text)
    except ValueError:
        tol = math.nan
    if not (math.isfinite(tol) and tol > 0):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a positive number; give one such as 1, 0.5 or 1e-12"
        )
    return tol


@dataclass(frozen=True)
class _Plan:
    """What is to be run.

    Attributes:
        baseline: what to compare with, where that is not among the engines.
        unread: cases that make no sense, by their names as given, and why: the others are run all
            the same.
    """

    cases: Sequence[Case]
    engines: Sequence[Engine]
    baseline: Engine | None
    unread: dict[str, str]


def _run(options: argparse.Namespace, house: House) -> int:
    """Solve every case with every engine, judge each, print a table and write what was asked for.

    Exit status: 0 all within tolerance, 1 something deviates or ends in an error, a timeout or a
    crash, 2 the tool could not do its work: a case cannot be read (the others are run), a file
    cannot be written, an engine that is named or required is missing, or nothing at all was solved
    or compared. Pairs with nothing to compare are not judged, and change no status as long as
    others are.
    """
    from . import destinations as delivery

    to = delivery.Destinations.of(options)
    plan = _planned(options, house, to)
    precision: Any = None
    if options.bench is not None:
        from ..studies.bench.engines import efforts_in

        precision = efforts_in(options.bench)
    with delivery.json_only() if to.json == "-" else nullcontext():
        results, problems, keeping, stopped = _solved(options, plan)
    if to.out or to.json or keeping:
        from ..harness.scene import with_scenes

        results = with_scenes(results, plan.cases)
    history: Any = None
    if keeping:
        keeping.end(results, interrupted=stopped is not None)
        problems += keeping.problems + keeping.store.damage
    # read last, for the page alone: what is damaged there costs no result
    if options.history is not None:
        history = partial(history_options.past, keeping, problems) if keeping else lambda: None
    delivery.deliver(
        results, problems, to, matrix=options.joints, precision=precision, history=history
    )
    if options.explain:
        print(*_explained(plan.cases), sep="\n", file=sys.stderr if to.json == "-" else sys.stdout)
    problems += lacking(results, options.require, options.engine) + uncompared(results)
    complain(problems)
    if stopped is not None:
        return stopped
    if problems or plan.unread:
        return Status.FAILED
    return (
        Status.DEVIATES if any(record.outcome.bad for record in results.records) else Status.WITHIN
    )


def _planned(options: argparse.Namespace, house: House, to: Destinations) -> _Plan:
    """What is to be run; cases that make no sense are told at once, before anything is computed.

    Raises:
        KincheckError: what cannot be done, all of it, where no case is left or an option is wrong.
    """
    from ..case.joint_probe import probes

    problems: list[str] = execution_options.contradictions(options)
    if options.resume and options.history is None:
        problems.append(f"--resume needs a history: give --history FILE, or set {HISTORY}")
    if options.bench is not None and options.out is None:
        problems.append("--bench is for the report: give --out DIR")
    _return_cases(options, house)
    import_options.return_cases(options)
    named: list[str] = options.case or ([] if options.joints else [*house.cases()])
    unread: dict[str, str] = {}
    cases = house.find_cases(
        named, unread, list(probes()) if options.joints else [], import_options.supplied(options)
    )
    import_options.tell_left_out(cases)
    unused: list[str] = []
    if options.reference and not problems:
        from ..case.io.reference_file import judged_by

        try:
            # a reference names its case, which may be the one that cannot be read: that ends no run
            # of the others
            cases = judged_by(cases, options.reference, unused if unread else None)
        except KincheckError as error:
            problems += str(error).splitlines()
    engines, baseline = _engines(options, house, problems)
    problems += to.problems(history=options.history)
    problems = problems or execution_options.unreachable(options)
    # what could not be read at all is recorded too, where records are kept: a night that ran
    # nothing is not the night before
    if problems or not (cases or to.wanted or options.history is not None):
        raise KincheckError("\n".join([*unread.values(), *problems]))
    complain(line for message in (*unread.values(), *unused) for line in message.splitlines())
    return _Plan(
        cases,
        engines,
        baseline,
        {visible(name): visible(message, also="\n") for name, message in unread.items()},
    )


def _solved(
    options: argparse.Namespace, plan: _Plan
) -> tuple[Results, list[str], Keeping | None, int | None]:
    """Return the results, the problems, the place in the history, and the status if something
    stopped the run before its end.
    """
    from ..harness import run as running
    from ..harness.workers.distributed import ClusterError

    solver, settings = execution_options.solver(options, plan.engines)
    if plan.unread:
        settings["unread"] = plan.unread
    keeping, problems = history_options.keeping(
        options, plan.cases, plan.engines, [*plan.unread], settings
    )
    made = [*keeping.made] if keeping else []
    records: list[Record] = [*made]
    tell = progress(records)

    def keep(record: Record, done: int, total: int) -> None:
        if keeping:
            keeping.add(record)
        tell(record, done, total)

    # results that may be compared with later ones
    if keeping is None and (options.out or options.json):
        from ..harness.provenance import conditions

        settings |= conditions()
    about: dict[str, Any] = {
        "tol": options.tol,
        "command": options.command,
        "facts": keeping.facts if keeping else settings,
    }
    started, unread = datetime.now(UTC), [*plan.unread]
    try:
        how: dict[str, Any] = {
            "baseline": plan.baseline,
            "solver": solver,
            "made": made,
            "unread": unread,
            **about,
        }
        results = running.run(plan.cases, plan.engines, progress=keep, **how)
        # also where the signal comes between the last record and here, all of them are kept below
        hold()
        return results, problems, keeping, None
    except (KeyboardInterrupt, ClusterError) as reason:
        pairs = running.planned(plan.cases, plan.engines, unread)
        records.sort(key=lambda each: pairs.index((each.case, each.engine, each.mode)))
        why = words_of(reason) if isinstance(reason, KeyboardInterrupt) else str(reason)
        problems.append(f"{why}: {len(records)} of {len(pairs)} records were made and are kept")
        results = running.results(plan.cases, records, started=started, plan=pairs, **about)
        return (
            results,
            problems,
            keeping,
            status_of(reason) if isinstance(reason, KeyboardInterrupt) else Status.FAILED,
        )


def _explained(cases: Sequence[Case]) -> Iterator[str]:
    """What the native engine computes for each case, or why nothing, and what is to be known of its
    geometry.
    """
    from ..case.notes import notes
    from ..studies.explain import explain

    for case in cases:
        try:
            yield from explain(case)
        except SolveError as error:  # of this case alone: its records are there, and say it too
            yield f"{case.name}: nothing is computed: {error}"
        yield from (f"  note: {note}" for note in notes(case))


def _return_cases(options: argparse.Namespace, house: House) -> None:
    """Give back the cases that an option taking several names has swallowed: `run --engine native
    my_case.toml`.
    """
    for names in (options.engine, options.require):
        swallowed = [
            name
            for name in names
            if name not in (*house.engines, *house.simulations)
            and (name in house.cases() or Path(name).suffix)
        ]
        options.case += swallowed
        names[:] = [name for name in names if name not in swallowed]


def _engines(
    options: argparse.Namespace, house: House, problems: list[str]
) -> tuple[list[Engine], Engine | None]:
    """The engines asked for, and the native one to compare with where it is not among them."""
    from ..harness.run import NATIVE

    named = [*options.engine, *options.require]
    every = house.simulations if options.mode == "simulate" else house.engines
    engines = house.find_engines(
        named if options.engine else [*every, *options.require], problems, options.mode
    )
    if not engines and not problems:
        problems.append(f"no engine has the mode {options.mode!r}; leave out --mode")
    return engines, None if NATIVE in (each.name for each in engines) else house.engine(NATIVE)
