"""kincheck run: solve cases with engines and judge the results."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from os.path import exists
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..case.io.escape import visible
from ..errors import KincheckError, SolveError
from ..harness.interrupts import hold, status_of, words_of
from ..report.progress import complain, lacking, progress, uncompared
from . import execution_options, history_options, import_options, recorded_options
from .engine_loading import WHERE
from .registry import Registry, Status
from .run_options import HISTORY, add_options, curve_options, judged

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.record import Record, Results
    from ..history.run_recorder import Keeping
    from .destinations import Destinations


def add(commands: Any) -> None:
    """Add the command to the parser."""
    run: argparse.ArgumentParser
    run = commands.add_parser(
        "run", help="solve cases with engines and judge the results", description=_run.__doc__
    )
    run.set_defaults(do=_run)
    add_options(run)


@dataclass(frozen=True)
class _Plan:
    """The cases and engines of a run.

    Attributes:
        baseline: the native engine as the standard, if it is not among the engines.
        required, named: names of the engines that the run must contain.
        unread: messages of unreadable cases, by the given names; the other cases are run.
        mistyped: names among these of which there is neither a case nor a file.
    """

    cases: Sequence[Case]
    engines: Sequence[Engine]
    baseline: Engine | None
    unread: dict[str, str]
    mistyped: Sequence[str]
    required: Sequence[str]
    named: Sequence[str]


def _run(options: argparse.Namespace, registry: Registry) -> int:
    """Solve every case with every engine, judge each, print a table and write the requested files.

    Exit status: 0 all within tolerance, 1 something deviates or ends in an error, a timeout or a
    crash, 2 the tool could not do its work: a case cannot be read (the others are run), a file
    cannot be written, an engine that is named or required is missing, or nothing at all was solved
    or compared. Results with nothing to compare are not judged, and do not change the
    status if others are judged.
    """
    from . import destinations as delivery

    to = delivery.Destinations.of(options)
    plan = _planned(options, registry, to)
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
    # read last, and only for the page: damage costs no result
    if options.history is not None:
        history = partial(history_options.past, keeping, problems) if keeping else lambda: None
    delivery.deliver(
        results, problems, to, show=_shown(options), precision=precision, history=history
    )
    if options.explain:
        print(*_explained(plan.cases), sep="\n", file=sys.stderr if to.json == "-" else sys.stdout)
    problems += lacking(results, plan.required, plan.named) + uncompared(results)
    complain(problems)
    if stopped is not None:
        return stopped
    if problems or plan.unread:
        return Status.FAILED
    return (
        Status.DEVIATES if any(record.outcome.bad for record in results.records) else Status.WITHIN
    )


def _shown(options: argparse.Namespace) -> Callable[[Results, TextIO], None]:
    """Return a function to print the results."""
    from ..report.matrix import print_matrix
    from ..report.table import print_outputs, print_summary, print_table

    if options.quiet:
        return print_summary
    if options.verbose:
        return print_outputs
    if options.reactions:
        return partial(print_table, reactions=True)
    return print_matrix if options.joints else print_table


def _planned(options: argparse.Namespace, registry: Registry, to: Destinations) -> _Plan:
    """Return the plan of the run. Print messages on unreadable cases before any computation.

    Raises:
        KincheckError: all problems, if no case is readable or an option is wrong.
    """
    from ..case.joint_probe import probes

    problems: list[str] = execution_options.contradictions(options)
    if options.resume and options.history is None:
        problems.append(f"--resume needs a history: give --history FILE, or set {HISTORY}")
    if options.bench is not None and options.out is None:
        problems.append("--bench adds to the report: give --out DIR")
    _return_cases(options, registry)
    import_options.return_cases(options)
    named: list[str] = options.case or ([] if options.joints else [*registry.cases()])
    unread: dict[str, str] = {}
    cases = registry.find_cases(
        named, unread, list(probes()) if options.joints else [], import_options.supplied(options)
    )
    import_options.tell_left_out(cases)
    if options.static:
        from ..studies.reactions import without_motion

        cases = [without_motion(each) for each in cases]
    if options.reactions:
        from ..studies.reactions import with_reactions

        cases = [with_reactions(each, options.tol) for each in cases]
    unused: list[str] = []
    recorded: list[Engine] = []
    if options.recorded and len(cases) != 1:
        problems.append(
            f"{options.recorded[0]}: found {len(cases)} cases, expected the one that it records"
        )
    elif options.recorded:
        try:
            cases[0], recorded = recorded_options.recorded_engines(options, cases[0])
        except KincheckError as error:
            problems += str(error).splitlines()
    curve = curve_options(options)
    if not (options.reference or options.recorded or options.fmu) and curve != type(curve)():
        problems.append("options for measured curves need a curve: give --reference FILE")
    if options.reference and not problems:
        try:
            # a reference may name an unreadable case, which does not stop the others
            cases, notes = judged(cases, options.reference, curve, unused if unread else None)
            complain(notes)
        except KincheckError as error:
            problems += str(error).splitlines()
    engines, baseline = _engines(options, registry, problems)
    if recorded and recorded_options.undriven(cases[0]):
        engines, baseline = [], None
    try:
        engines += [*recorded_options.foreign_engines(options, cases), *recorded]
    except KincheckError as error:
        problems += str(error).splitlines()
    keys = [(engine.name, engine.mode) for engine in engines]
    problems += [
        f"engine {name}: found twice; rename one"
        for name, mode in keys
        if keys.count((name, mode)) > 1
    ][:1]
    problems += to.problems(history=options.history)
    problems = problems or execution_options.unreachable(options)
    # With output files or a history, a run without readable cases is recorded too, so that it does
    # not look like the previous run.
    if problems or not (cases or to.wanted or options.history is not None):
        raise KincheckError("\n".join([*unread.values(), *problems]))
    complain(line for message in (*unread.values(), *unused) for line in message.splitlines())
    return _Plan(
        cases,
        engines,
        baseline,
        {visible(name): visible(message, also="\n") for name, message in unread.items()},
        [name for name in unread if name not in registry.cases() and not exists(name)],
        [each.name for each in registry.find_engines(options.require, [], options.mode)],
        [each.name for each in engines] if options.engine else [],
    )


def _solved(
    options: argparse.Namespace, plan: _Plan
) -> tuple[Results, list[str], Keeping | None, int | None]:
    """Return the results, the problems, the run in the history, and the status if a signal stopped
    the run early.
    """
    from ..harness import run as running
    from ..harness.workers.distributed import ClusterError

    solver, settings = execution_options.solver(options, plan.engines)
    if plan.unread:
        settings["unread"] = plan.unread
    settings["selection"] = history_options.selection(options)
    keeping, problems = history_options.keeping(
        options, plan.cases, plan.engines, [*plan.unread], settings, plan.mistyped
    )
    made = [*keeping.made] if keeping else []
    records: list[Record] = [*made]
    show = progress(records, quiet=options.quiet)

    def keep(record: Record, done: int, total: int) -> None:
        if keeping:
            keeping.add(record)
        show(record, done, total)

    # results are kept for later comparison
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
        how: dict[str, Any] = {"baseline": plan.baseline, "solver": solver, "made": made, **about}
        results = running.run(plan.cases, plan.engines, progress=keep, unread=unread, **how)
        # after a signal between the last record and this line, all records are kept below
        hold()
        return results, problems, keeping, None
    except (KeyboardInterrupt, ClusterError) as reason:
        pairs = running.planned(plan.cases, plan.engines, unread)
        records.sort(key=lambda each: pairs.index((each.case, each.engine, each.mode)))
        why = words_of(reason) if isinstance(reason, KeyboardInterrupt) else str(reason)
        problems.append(f"{why}: {len(records)} of {len(pairs)} records were finished and are kept")
        results = running.results(plan.cases, records, started=started, plan=pairs, **about)
        return (
            results,
            problems,
            keeping,
            status_of(reason) if isinstance(reason, KeyboardInterrupt) else Status.FAILED,
        )


def _explained(cases: Sequence[Case]) -> Iterator[str]:
    """Yield for each case the account of the native engine's programs, or the reason why there is
    none, and notes on its geometry.
    """
    from ..case.notes import notes
    from ..harness.program_account import explain

    for case in cases:
        try:
            yield from explain(case)
        except SolveError as error:  # only this case fails: its records have the message too
            yield f"{case.name}: cannot be solved: {error}"
        yield from (f"  note: {note}" for note in notes(case))


def _return_cases(options: argparse.Namespace, registry: Registry) -> None:
    """Move cases back from options that take several names: `run --engine native my_case.toml`."""
    for names in (options.engine, options.require):
        swallowed = [
            name
            for name in names
            if name not in (*registry.engines, *registry.simulations)
            and not WHERE.fullmatch(name)
            and (name in registry.cases() or Path(name).suffix)
        ]
        options.case += swallowed
        names[:] = [name for name in names if name not in swallowed]


def _engines(
    options: argparse.Namespace, registry: Registry, problems: list[str]
) -> tuple[list[Engine], Engine | None]:
    """Return the requested engines, and native as the standard if it is not among them."""
    named = [*options.engine, *options.require]
    every = registry.simulations if options.mode == "simulate" else registry.engines
    engines = registry.find_engines(
        named if options.engine else [*every, *options.require], problems, options.mode
    )
    if not engines and not problems:
        problems.append(f"no engine has the mode {options.mode!r}; leave out --mode")
    return engines, registry.baseline(engines)
