"""The command line. The only place that knows adapters and cases; they, and all that is slow to import, are loaded on use."""

from __future__ import annotations

import argparse
import difflib
import importlib.metadata
import math
import os
import shlex
import sys
import traceback
from collections.abc import Sequence
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ..errors import KincheckError, SolveError
from .case import Case
from .console import how_to_install, lacking, progress
from .engine import Engine
from .record import Record

WITHIN, DEVIATES, FAILED = 0, 1, 2
"""Exit status: all within tolerance; something deviates, fails or errs; the tool could not do its work."""

# Largest accepted constraint residual [m or -]: a thousand times the round-off of metre-sized coordinates, and a thousandth of
# the 1e-9 m that outputs are held to, so that a residual amplified a hundredfold by the mechanism still cannot be seen.
TOL = 1e-12

MODES = ("projection", "simulate")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    argv = sys.argv[1:] if argv is None else list(argv)
    try:
        options = _parser().parse_args(argv, argparse.Namespace(command=shlex.join(["kincheck", *argv])))
    except SystemExit as end:  # argparse has said why
        return int(end.code or 0)
    try:
        return options.do(options)
    except KincheckError as error:
        _complain(str(error).splitlines())
    except BrokenPipeError:  # the reader of our output has gone; what it wanted is what it got
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception:  # a defect of ours: shown in full, and never taken for a deviation (Python's own status would be 1)
        traceback.print_exc()
    return FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="kincheck", description="Cross-validation of the kinematics of multibody systems.")
    parser.add_argument("--version", action="version", version=f"kincheck {importlib.metadata.version('kincheck')}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="solve cases with engines and judge the results", description=_run.__doc__)
    run.set_defaults(do=_run)
    run.add_argument("case", nargs="*", metavar="CASE", help="built-in name, or path to a case file; default: all built-in cases")
    run.add_argument("--joints", action="store_true", help="run a small closed loop around every joint type, and the cases named")
    run.add_argument("--engine", nargs="+", action="extend", default=[], metavar="NAME", help="default: all engines")
    run.add_argument("--mode", choices=MODES, help="only engines of this mode")
    run.add_argument("--tol", type=_tol, default=TOL, metavar="X", help=f"largest constraint residual [m or -]; default {TOL:g}")
    run.add_argument("--out", type=Path, metavar="DIR", help="write results.json and report.html there")
    run.add_argument("--json", metavar="FILE", help="write the results as JSON; - for standard output")
    run.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML")
    run.add_argument("--markdown", type=Path, metavar="FILE", help="write the table of cases and engines as Markdown")
    run.add_argument("--explain", action="store_true", help="print what the native engine computes for each case, and leaves out")
    run.add_argument(
        "--require",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="engines that must be there and able (else status 2)",
    )

    bench = commands.add_parser("bench", help="measure the formulation and its programs")
    benchmarks = bench.add_subparsers(title="benchmarks", required=True, metavar="BENCHMARK")
    formulation = benchmarks.add_parser(
        "formulation", help="operation counts and round-off of the paper's rows", description=_bench_formulation.__doc__
    )
    formulation.set_defaults(do=_bench_formulation)
    formulation.add_argument("--seed", type=int, default=943745, metavar="N", help="of the random states; default %(default)s")
    formulation.add_argument("--out", type=Path, metavar="DIR", help="write bench_formulation.json and .html there")
    formulation.add_argument("--json", metavar="FILE", help="write the results as JSON; - for standard output")

    checking = commands.add_parser("check-joint", help="check a joint type of your own", description=_check_joint.__doc__)
    checking.set_defaults(do=_check_joint)
    checking.add_argument("joint", metavar="MODULE:CLASS", help="the class, in a module of this folder or an installed one")
    checking.add_argument("--seed", type=int, default=0, metavar="N", help="of the random poses; default %(default)s")

    listing = commands.add_parser("list", help="list cases and engines", description=_list.__doc__)
    listing.set_defaults(do=_list)
    listing.add_argument("--joints", action="store_true", help="list the types a case file can name: joints, drivers, motions")
    return parser


def _tol(text: str) -> float:
    try:
        tol = float(text)
    except ValueError:
        tol = math.nan
    if not (math.isfinite(tol) and tol > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number; give a residual such as {TOL:g}")
    return tol


def _complain(lines: Sequence[str]) -> None:
    for line in lines:
        print(f"kincheck: {line}", file=sys.stderr)


def _run(options: argparse.Namespace) -> int:
    """Solve every case with every engine, judge each, print a table and write what was asked for."""
    from . import run as running
    from .reporting import deliver as delivery

    problems: list[str] = []
    _return_cases(options)
    cases = _cases(options.case, problems, joints=options.joints)
    engines, baseline = _engines([*options.engine, *options.require] if options.engine else [], options, problems)
    files: dict[str, Any] = {"out": options.out, "json": options.json, "junit": options.junit, "markdown": options.markdown}
    delivery.check_destinations(problems, **files)
    if problems:  # all of them, and before anything is computed
        raise KincheckError("\n".join(problems))

    records: list[Record] = []
    started = datetime.now(UTC)
    with delivery.json_only() if options.json == "-" else nullcontext():
        try:
            results = running.run(
                cases,
                engines,
                tol=options.tol,
                progress=progress(records),
                baseline=baseline,
                command=options.command,
            )
        except KeyboardInterrupt:
            problems.append(f"interrupted: {len(records)} of {len(cases) * len(engines)} records were made and are kept")
            results = running.results(cases, records, started=started, tol=options.tol, command=options.command)
    delivery.deliver(results, problems, matrix=options.joints, **files)
    if options.explain:
        from .explain import explain

        print(*(line for case in cases for line in explain(case)), sep="\n", file=sys.stderr if options.json == "-" else sys.stdout)
    problems += lacking(results, options.require)
    _complain(problems)
    if problems:
        return FAILED
    return DEVIATES if any(record.outcome.bad for record in results.records) else WITHIN


def _return_cases(options: argparse.Namespace) -> None:
    """Give back the cases that an option taking several names has swallowed: `run --engine native my_case.toml`."""
    from ... import adapters, cases

    for names in (options.engine, options.require):
        swallowed = [name for name in names if name not in adapters.ENGINES and (name in cases.names() or Path(name).suffix)]
        options.case += swallowed
        names[:] = [name for name in names if name not in swallowed]


def _cases(names: Sequence[str], problems: list[str], *, joints: bool) -> list[Case]:
    """The cases asked for, after those of the joints if they are; what is wrong with any of them is added to the problems."""
    from ... import cases as builtin
    from ..analysis.freedom import require_driven
    from .probe import probes
    from .reading.casefile import load_case

    found = {case.name: case for case in probes()} if joints else dict[str, Case]()
    known = list(builtin.names())
    for name in dict.fromkeys(names if names or joints else known):
        try:
            if name in known:
                case = builtin.load(name)
            elif Path(name).suffix in (".toml", ".json") or os.sep in name or Path(name).exists():
                case = load_case(Path(name))
            else:
                raise KincheckError(_unknown("case", name, known) + "; a case file ends in .toml or .json")
            require_driven(case.mechanism)
        except SolveError as error:  # it names the mechanism; the file is what the reader has to open
            problems.append(f"{name}: {error}")
            continue
        except KincheckError as error:
            problems += str(error).splitlines()
            continue
        if case.name in found:
            problems.append(f"{name}: there are two cases named {case.name!r}; results go by name: rename one")
        found[case.name] = case
    return list(found.values())


def _engines(names: Sequence[str], options: argparse.Namespace, problems: list[str]) -> tuple[list[Engine], Engine | None]:
    """The engines asked for, and the native one to compare with where it is not among them."""
    from ... import adapters
    from .run import NATIVE

    known = list(adapters.ENGINES)
    named = list(dict.fromkeys([*names, *options.require]))
    problems += [_unknown("engine", name, known) for name in named if name not in known]
    engines: list[Engine] = [adapters.engine(name) for name in dict.fromkeys(names or known) if name in known]
    if options.mode:
        others = {each.name: each.mode for each in engines if each.mode != options.mode}
        engines = [each for each in engines if each.name not in others]
        problems += [
            f"engine {name!r} has the mode {mode!r}, not {options.mode!r}: leave out --mode or the engine"
            for name, mode in others.items()
            if name in named
        ]
        if not engines and not problems:
            problems.append(f"no engine has the mode {options.mode!r}; leave out --mode")
    return engines, None if NATIVE in (each.name for each in engines) else adapters.engine(NATIVE)


def _unknown(what: str, name: str, known: Sequence[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f"there is no {what} {name!r}; " + (f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}")


def _bench_formulation(options: argparse.Namespace) -> int:
    """Measure the paper's claims: operation counts (Table 3), round-off of rows, errors of a whole sweep. Needs mpmath."""
    from ... import cases
    from .bench import formulation as bench_formulation
    from .bench import pages as bench
    from .reporting import deliver as delivery

    problems: list[str] = []
    names = [f"{bench_formulation.NAME}.{kind}" for kind in ("json", "html")]
    delivery.check_destinations(problems, out=options.out, json=options.json, names=names)
    if problems:
        raise KincheckError("\n".join(problems))
    found = bench_formulation.measure(cases.load("mcpherson_strut"), options.seed, bench_formulation.STATES)
    bench.deliver(bench_formulation.report(found), found, out=options.out, json=options.json)
    return WITHIN


def _check_joint(options: argparse.Namespace) -> int:
    """Check a joint type: its equations against their derivatives, its branches, and a closed loop in every engine."""
    from ... import adapters
    from .joint_check.check_joint import check_joint, load_joint

    report = check_joint(load_joint(options.joint), seed=options.seed, engines=[*map(adapters.engine, adapters.ENGINES)])
    report.print(sys.stdout)
    return WITHIN if report.passed else DEVIATES


def _list(options: argparse.Namespace) -> int:
    """List the built-in cases with their truth and source, and the engines with their versions; or the types of joints."""
    from ... import adapters, cases
    from .catalogue import catalogue
    from .circumstances import truth_of

    if options.joints:
        print(*catalogue(), sep="\n")
        return WITHIN
    print("cases:")
    names = list(cases.names())
    for name in names:
        case = cases.load(name)
        print(f"  {name:{max(map(len, names))}}  {str(truth_of(case)).replace('_', ' '):16}  {case.source}")
    print("engines:")
    for name in adapters.ENGINES:
        engine = adapters.engine(name)
        version = engine.version()
        state = f"not installed: {how_to_install(name)}" if version is None else f"{version}  {engine.mode}, loop: {engine.loop}"
        print(f"  {name:{max(map(len, adapters.ENGINES))}}  {state}")
    return WITHIN
