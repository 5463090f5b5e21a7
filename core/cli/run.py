"""kincheck run: solve cases with engines and judge the results."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from os.path import exists
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ..case.io.escape import visible
from ..case.io.reader_options import CurveOptions, Supplied
from ..errors import (
    MOST_NAMED,
    KincheckError,
    SolveError,
    collect_errors,
    labelled,
    refuse,
    shortened,
)
from ..harness.interrupts import hold, status_of, words_of
from ..options import (
    CASES,
    argument,
    asked,
    destination,
    group,
    joint_types,
    json_file,
    option,
    option_fields,
    options,
    positive,
    several,
    switch,
    verbosity,
    with_values,
)
from ..report.progress import complain, explain_no_comparison, missing_requirements, progress
from . import shared_options
from .class_loading import WHERE
from .engine_source import RUN, WorkersError, given, names_of, options_for, sources
from .forms import with_forms
from .registry import Registry, Status, tell_left_out
from .shared_options import HISTORY, MODE, MODES, TOL, Isolated, with_references

if TYPE_CHECKING:
    from ..case.case import Case
    from ..harness.engine import Engine
    from ..harness.record import Facts, Record, Results
    from ..history.runs import Keeping
    from .destinations import Trends


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


_Added: Any = options_for(RUN)
_Formed: Any = with_forms()
CURVES = "write the curves of all engines and references"


@options
class Run(Isolated, _Added, _Formed):  # pyright: ignore[reportUntypedBaseClass]
    """Solve every case with every engine, judge each, print a table and write the requested files.

    Exit status: 0 all within tolerance, 1 something deviates or ends in an error, a timeout or a
    crash, 2 the tool could not do its work: a case cannot be read (the others are run), a file
    cannot be written, an engine that is named or required is missing, or nothing at all was solved
    or compared. Results with nothing to compare are not judged, and do not change the
    status if others are judged.
    """

    about = "solve cases with engines and judge the results"
    LAST = (
        *Isolated.LAST,
        *_Formed.LAST,
        *(each.name for each, *_ in option_fields(_Added) if not each.init),
    )
    cases: str | Path | Case | Sequence[str | Path | Case] | None = argument(
        CASES, "CASE", "*", default=()
    )
    joints: bool = switch(
        "run a small closed loop around every joint type, and the named cases", default=False
    )
    engines: str | Engine | Sequence[str | Engine] | None = option(
        "only these, by name or MODULE:CLASS; all must be installed (else status 2); default: all"
        " engines",
        metavar="NAME",
        flag="--engine",
        several="together",
        kw_only=False,
        default=(),
    )
    mode: str | None = option(MODE, choices=MODES, default=None)
    tol: float = option(
        f"largest accepted constraint residual [m or -]; default {TOL:g}",
        positive,
        "X",
        default=TOL,
    )
    out: Path | None = destination("write results.json and report.html there", Path, "DIR")
    json: str | None = json_file()
    csv: Path | None = destination(f"{CURVES} as CSV", Path)
    parquet: Path | None = destination(f"{CURVES} as Parquet", Path)
    xlsx: Path | None = destination(f"{CURVES} as a workbook", Path)
    long: bool = switch(
        "write curves of hardpoint tables as those of other files, a row per output and sample"
        " in SI units; default: a row per sample and a column per output in the table's units",
        init=False,
    )
    junit: Path | None = destination("write the results as JUnit XML", Path)
    markdown: Path | None = destination("write the table of cases and engines as Markdown", Path)
    reference: str | Path | Sequence[str | Path] | None = option(
        "judge cases by these files instead of by their own references: proved references of"
        " kincheck reference (.json), or one measured curve (.csv, .xlsx, ...)",
        Path,
        "FILE",
        several="together",
        default=(),
    )
    explain: bool = switch(
        "print what the native engine computes for each case, and what it leaves out", init=False
    )
    require: tuple[str, ...] = option(
        "engines that must be installed and support every case (else status 2)",
        metavar="NAME",
        several="together",
        init=False,
    )
    quiet: bool = verbosity("print only messages and the counts of outcomes: no progress, no table")
    verbose: bool = verbosity("print the errors of every output and their tolerances", "-v")
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied)
    curve: CurveOptions = group(default_factory=CurveOptions)
    static: bool = switch(
        "efforts and reactions at rest, at every sample; [sweep] rate = 0 of all cases",
        default=False,
    )
    reactions: bool = switch(
        "every determined reaction of joints, effort of drivers and force of elements as"
        " outputs, first in table and page; what is not determined is a note",
        default=False,
    )
    history: Path | None = destination(
        "store the run in this file, each record at once; default: the file named by the"
        f" environment variable {HISTORY}, if it is set",
        Path,
        environment=HISTORY,
    )
    resume: bool = switch(
        "resume the latest unfinished run in the history with identical cases, engines,"
        " tolerance, limits, versions and commit",
        init=False,
    )

    def answer(self, registry: Registry) -> Results:
        """Solve cases with engines and judge the results.

        A missing engine is a record with the outcome `unavailable`. How a curve of `reference` was
        read is among the notes.

        Raises:
            KincheckError: a case cannot be read, there is no engine of a name, or a member of the
                engine protocol is missing.
        """
        from ..harness import run as running
        from ..harness.scene import with_scenes

        plan = _plan_run(self, registry)
        solver, _ = shared_options.solver(self, plan.engines)
        how: dict[str, Any] = {"baseline": plan.baseline, "solver": solver}
        return with_scenes(running.run(plan.cases, plan.engines, tol=self.tol, **how), plan.cases)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from . import destinations as delivery

        self = _with_cases(self, registry)
        plan = _plan_run(self, registry)
        data: list[Any] = [each.efforts(self) for each in asked(sources(RUN), self)]
        precision = next((each for each in data if each is not None), None)
        with delivery.json_only() if self.json == "-" else nullcontext():
            results, problems, keeping, stopped = _solve(self, plan)
        if self.out or self.json or keeping:
            from ..harness.scene import with_scenes

            results = with_scenes(results, plan.cases)
        history: Any = None
        if keeping:
            keeping.end(results, interrupted=stopped is not None)
            problems += keeping.problems + keeping.store.damage
        # read last, and only for the page: damage costs no result
        if self.history is not None:
            history = partial(past, keeping, problems) if keeping else lambda: None
        delivery.deliver(
            results, problems, self, show=_printer(self), precision=precision, history=history
        )
        if self.explain:
            print(
                *_explanations(plan.cases),
                sep="\n",
                file=sys.stderr if self.json == "-" else sys.stdout,
            )
        problems += missing_requirements(
            results, plan.required, plan.named
        ) + explain_no_comparison(results)
        complain(problems)
        if stopped is not None:
            return stopped
        if problems or plan.unread:
            return Status.FAILED
        return Status.of(results)


def _printer(options: Run) -> Callable[[Results, TextIO], None]:
    """Return a function to print the results."""
    from ..report.table import print_matrix, print_outputs, print_summary, print_table

    if options.quiet:
        return print_summary
    if options.verbose:
        return print_outputs
    if options.reactions:
        return partial(print_table, reactions=True)
    return print_matrix if options.joints else print_table


def _plan_run(options: Run, registry: Registry) -> _Plan:
    """Return the plan of the run. Print messages on unreadable cases before any computation.

    Raises:
        KincheckError: all problems, if no case is readable or an option is wrong.
    """
    from .destinations import REPORT, files_of

    problems: list[str] = shared_options.contradictions(options)
    if options.resume and options.history is None:
        problems.append(f"--resume needs a history. Give --history FILE, or set {HISTORY}.")
    tell: Callable[[Iterable[str]], object] = complain if options.command else list
    unread: dict[str, str] = {}
    cases = _cases(options, registry, unread)
    if options.command:
        tell_left_out(cases)
    unused: list[str] = []
    added: list[Engine] = []
    for source in asked(sources(RUN), options):
        problems += source.contradictions(options)
        cases, found = source.engines(options, cases, problems)
        added += found
    if not (options.reference or given(options, "COLUMNS")):
        problems += filter(None, [options.curve.without_curve])
    if options.reference and not problems:
        with collect_errors(problems):
            # a reference may name an unreadable case, which does not stop the others
            files = [*map(Path, several(options.reference))]
            cases, notes = with_references(cases, files, options.curve, unused if unread else None)
            tell(notes)
            if notes and not options.command:
                cases = [replace(cases[0], assembly=(*cases[0].assembly, *notes))]
    engines = _engines(options, registry, problems)
    baseline = registry.baseline(engines)
    if given(options, "MOTIONS") and not problems:
        from ..kinematics import degrees_of_freedom

        mechanism = cases[0].mechanism
        if degrees_of_freedom(mechanism) > len(mechanism.drivers):  # no engine can solve it
            engines, baseline = [], None
    engines += added
    keys = Counter((engine.name, engine.mode) for engine in engines)
    twice = [name for (name, _), count in keys.items() if count > 1]
    problems += [f"engine {name}: found twice; rename one" for name in twice[:1]]
    problems += options.unwritable(*REPORT)
    problems = problems or shared_options.unreachable(options)
    # With output files or a history, a run without readable cases is recorded too, so that it does
    # not look like the previous run.
    kept = options.out is not None or options.history is not None or files_of(options)
    if problems or not (cases or kept):
        refuse([*unread.values(), *problems])
    tell(line for message in (*unread.values(), *unused) for line in message.splitlines())
    return _Plan(
        cases,
        engines,
        baseline,
        {visible(name): visible(message, also="\n") for name, message in unread.items()},
        [name for name in unread if name not in registry.cases() and not exists(name)],
        [each.name for each in registry.find_engines(options.require, [], options.mode)],
        [each.name for each in engines] if options.engines else [],
    )


def _solve(options: Run, plan: _Plan) -> tuple[Results, list[str], Keeping | None, int | None]:
    """Return the results, the problems, the run in the history, and the status if a signal stopped
    the run early.
    """
    from ..harness import run as running

    solver, settings = shared_options.solver(options, plan.engines)
    if plan.unread:
        settings["unread"] = plan.unread
    settings["selection"] = selection(options)
    keeping, problems = _open_history(
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
    except (KeyboardInterrupt, WorkersError) as reason:
        pairs = running.plan_pairs(plan.cases, plan.engines, unread)
        records.sort(key=lambda each: pairs.index(each.pair))
        why = words_of(reason) if isinstance(reason, KeyboardInterrupt) else str(reason)
        problems.append(f"{why}: {len(records)} of {len(pairs)} records were finished and are kept")
        results = running.results(plan.cases, records, started=started, plan=pairs, **about)
        return (
            results,
            problems,
            keeping,
            status_of(reason) if isinstance(reason, KeyboardInterrupt) else Status.FAILED,
        )


def _explanations(cases: Sequence[Case]) -> Iterator[str]:
    """Yield for each case the account of the native engine's programs, or the reason why there is
    none, and notes on its geometry.
    """
    from ..case.notes import notes
    from ..harness.native_engine import explain

    for case in cases:
        try:
            yield from explain(case)
        except SolveError as error:  # only this case fails: its records have the message too
            yield f"{case.name}: cannot be solved: {error}"
        yield from (f"  {labelled(note)}" for note in notes(case))


def _with_cases(options: Run, registry: Registry) -> Run:
    """Return the options with the cases among the values of options that take several names:
    `run --engine native my_case.toml`.
    """
    swallowed = [
        name
        for name in (*several(options.engines), *options.require)
        if isinstance(name, str)
        and name not in registry.every_engine
        and not WHERE.fullmatch(name)
        and (name in registry.cases() or Path(name).suffix)
    ]
    cases, supplied = shared_options.return_cases(
        (*several(options.cases), *swallowed), options.supplied
    )
    return with_values(
        options,
        cases=tuple(cases),
        engines=tuple(each for each in several(options.engines) if each not in swallowed),
        require=tuple(each for each in options.require if each not in swallowed),
        supplied=supplied,
    )


def _cases(options: Run, registry: Registry, unread: dict[str, str]) -> list[Case]:
    """Return the cases to solve; unreadable ones go to `unread`, or in Python raise."""
    if options.joints and options.reactions:
        raise KincheckError(
            "--reactions: the loops of --joints have no masses and no forces, so all reactions are"
            " zero. Leave out one of both."
        )
    named, found = several(options.cases), []
    if options.joints:
        from ..case.joint_probe import probes

        found = probes()
    elif not named:
        named = registry.cases()
    supplied = replace(options.supplied, recorded=given(options, "MOTIONS"))
    if options.command:
        cases = registry.find_cases([*map(str, named)], unread, found, supplied)
    else:
        cases = [*found, *(registry.find_case(each, supplied) for each in named)]
    if options.static:
        from ..studies.reactions import without_motion

        cases = [without_motion(each) for each in cases]
    if options.reactions:
        from ..studies.reactions import with_reactions

        cases = [with_reactions(each, options.tol) for each in cases]
    return cases


def _engines(options: Run, registry: Registry, problems: list[str]) -> list[Engine]:
    """Return the requested engines."""
    every = registry.simulations if options.mode == "simulate" else registry.engines
    engines = registry.find_engines(
        [*(several(options.engines) or every), *options.require], problems, options.mode
    )
    if not engines and not problems:
        problems.append(f"no engine has the mode {options.mode!r}. Leave out --mode.")
    return engines


def selection(options: Any) -> dict[str, Any]:
    """Return the task of a run, as `Results.run["selection"]`: cases, engines, and the given
    options of solution and judgement.
    """
    run = ["joints", "joint_type", "mode", "reference", "require", "static", "reactions"]
    run += [name for source in sources(RUN) for name in names_of(source)]
    parts: dict[str, dict[str, Any]] = {
        "run": {name: getattr(options, name) for name in run} | {"tol": options.tol},
        "files": vars(options.supplied) | {"recorded": given(options, "MOTIONS")},
        "curve": vars(options.curve),
    }
    return {
        "cases": sorted({*_words(several(options.cases))}),
        "engines": sorted({*_words(several(options.engines))}),
        "options": {
            part: {name: _words(x) for name, x in each.items() if x} for part, each in parts.items()
        },
    }


def _words(given: Any) -> Any:
    """Return an option's value as plain data; file names may contain undecodable bytes."""
    from ..harness.provenance import readable

    if isinstance(given, list | tuple):
        return [_words(each) for each in given]  # pyright: ignore
    return given if isinstance(given, bool | float) else readable(str(given))


def _open_history(
    options: Any,
    cases: Sequence[Case],
    engines: Sequence[Engine],
    unread: Sequence[str],
    settings: dict[str, Any],
    mistyped: Sequence[str],
) -> tuple[Keeping | None, list[str]]:
    """Return the run in its history, or None, and the reasons if the history does not store it.

    Args:
        mistyped: names of cases that do not exist: with one, or if no case can be read at all,
            the run is only stored if an earlier one was asked for the same, which then lacks them.
    """
    if options.history is None:
        return None, []
    from ..history.runs import keep
    from ..history.store import HistoryError
    from .joint_loading import sources

    about: dict[str, Any] = {"tol": options.tol, "command": options.command, "settings": settings}
    code = [*options.joint_type, *(type(each).__module__ for each in engines)]
    about |= {"unread": unread, "resume": options.resume, "sources": sources(code)}
    try:
        if (mistyped or not cases) and not _is_in_history(Path(options.history), settings):
            names = shortened(mistyped or unread, MOST_NAMED)
            why = "no such case" if mistyped else "no case could be read"
            return None, [f"{names}: {why}; the run is not in the history"]
        found = keep(Path(options.history), cases, engines, **about)
    except HistoryError as error:
        from .destinations import not_in_history

        return None, [not_in_history(options, error)]
    if options.resume:
        print(
            f"kincheck: run {found.run} is resumed after {len(found.made)} records"
            if found.resumed
            else f"kincheck: no unfinished run to resume: run {found.run} is new",
            file=sys.stderr,
        )
    return found, []


def _is_in_history(path: Path, facts: Facts) -> bool:
    """Return whether a history has a run that was asked for the same."""
    from ..history.queries import same_task
    from ..history.store import Store

    if not os.path.exists(path):
        return False
    with Store(path, writable=False) as store:
        return any(same_task(row.key, facts) for row in store.runs())


def past(keeping: Keeping, problems: list[str]) -> Trends:
    """Return the runs up to this one by case, for the report, and report unreadable parts."""
    from ..history.queries import NIGHTS, read
    from ..history.store import HistoryError, Store
    from ..report.trends import trends

    if keeping.problems:
        return None
    try:
        with Store(keeping.store.path, writable=False) as store:
            found = trends(read(store, before=keeping.run + 1, last=NIGHTS, like=keeping.facts))
            problems += [each for each in store.damage if each not in problems]
    except HistoryError as error:
        problems.append(str(error))
        return None
    return found
