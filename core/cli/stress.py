"""kincheck stress: test engines with random degenerate mechanisms for silently wrong answers."""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError, unknown
from .option_types import add_json, add_several, positive, whole
from .registry import Registry, Status, given
from .run_options import MODES, TOL
from .verbosity import add_verbosity

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..studies.stress.families import Family
    from ..studies.stress.results import Stress

SAMPLES = 2000
FILES = ("stress.json", "stress.html", "stress.md")
OF_FAMILIES = ("family", "samples", "seed", "no_proofs")
"""Options of random mechanisms."""


def add(commands: Any) -> None:
    """Add the command to the parser."""
    stress: argparse.ArgumentParser
    stress = commands.add_parser(
        "stress",
        help="stress-test engines with random degenerate mechanisms",
        description=_stress.__doc__,
    )
    stress.set_defaults(do=_stress)
    add_several(stress, "--family", "default: all families")
    stress.add_argument("--list", action="store_true", help="list the families")
    stress.add_argument(
        "--samples",
        type=whole(1),
        metavar="N",
        help=f"number of samples over all families; default {SAMPLES}",
    )
    stress.add_argument(
        "--seed", type=whole(0), metavar="S", help="seed of the random mechanisms; default 0"
    )
    add_several(stress, "--engine", "default: native")
    stress.add_argument(
        "--mode",
        choices=MODES,
        help="mode of the engines; default: projection, or simulate if an engine has only this",
    )
    stress.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="write the tables there, and the smallest bad cases as reduced case files",
    )
    add_json(stress)
    stress.add_argument(
        "--no-proofs",
        action="store_true",
        help="skip the proof of a share of the reference motions, which needs python-flint",
    )
    add_several(stress, "--replay", "judge case files instead", metavar="FILE", type=Path)
    stress.add_argument(
        "--tol",
        type=positive,
        metavar="X",
        help=f"largest accepted constraint residual of replayed files; default {TOL:g}",
    )
    add_verbosity(stress, quiet="print no progress")


def _stress(options: argparse.Namespace, registry: Registry) -> int:
    """Run engines on random mechanisms that are difficult for solvers, and judge every sample.

    Exit status: 0 no sample is silently wrong or refused for a wrong reason, 1 some are, 2 the tool
    could not do its work, or an engine supports none of the samples.
    """
    from ..harness.standard import STANDARD
    from ..report.sections import deliver
    from ..report.terminal import page, unheaded
    from ..studies.stress.families import FAMILIES
    from ..studies.stress.report import idle, markdown, report
    from ..studies.stress.verdicts import BAD
    from . import destinations as delivery

    if options.list:
        if found := given(
            options, [name for name in vars(options) if name not in ("list", "command", "do")]
        ):
            raise KincheckError(f"--list runs nothing; leave out {found}")
        rows = [(name, family.about) for name, family in FAMILIES.items()]
        page(None).print(unheaded(rows))
        return Status.WITHIN
    problems: list[str] = []
    engines = registry.find_engines(options.engine or [STANDARD], problems, options.mode)
    if options.replay:
        if options.out or options.json:
            problems.append("--replay only prints its findings; leave out --out and --json")
        if found := given(options, OF_FAMILIES):
            problems.append(f"--replay judges files, which belong to no family; leave out {found}")
        if problems:
            raise KincheckError("\n".join(problems))
        return _replay(options, registry, engines)
    if options.tol is not None:
        problems.append(
            "--tol is for replayed files, and families have their own tolerances; leave it out,"
            " or give --replay"
        )
    wanted = dict.fromkeys(options.family or FAMILIES)
    problems += [unknown("family", name, [*FAMILIES]) for name in wanted if name not in FAMILIES]
    problems += delivery.Destinations.of(options).problems(FILES)
    if problems:
        raise KincheckError("\n".join(problems))
    with delivery.json_only() if options.json == "-" else nullcontext():
        found = _run(options, [FAMILIES[name] for name in wanted], engines, problems)
    made = report(found)
    problems += [
        *(f"family {name} was not finished: {why}" for name, why in found.unfinished.items()),
        *idle(found),
    ]
    beside = {FILES[2]: markdown(made)}
    deliver(made, found, out=options.out, json=options.json, beside=beside, problems=problems)
    bad = any(cell.samples[verdict] for cell in found.cells for verdict in BAD)
    return Status.DEVIATES if bad else Status.WITHIN


def _run(
    options: argparse.Namespace,
    families: list[Family],
    engines: list[Engine],
    problems: list[str],
) -> Stress:
    """Run the families; reduce and save bad examples.

    Args:
        problems: receives the reasons of examples that cannot be written.
    """
    from msgspec.structs import replace

    from ..report.meter import Meter
    from ..studies.stress.reduction import save
    from ..studies.stress.run import stress

    with Meter("stress", quiet=options.quiet) as meter:
        found, examples = stress(
            families,
            engines,
            samples=options.samples or SAMPLES,
            seed=options.seed or 0,
            command=options.command,
            prove=not options.no_proofs,
            progress=meter,
        )
    if options.out is not None and examples:
        saved = [save(example, options.out, problems) for example in examples]
        found = replace(found, findings=saved)
    return found


def _replay(options: argparse.Namespace, registry: Registry, engines: list[Engine]) -> int:
    """Judge case files by following their motion from the design."""
    from ..studies.stress.reduction import judge
    from ..studies.stress.verdicts import BAD, Verdict

    bad, examined = False, set[str]()
    for file in options.replay:
        case = registry.find_case(str(file))
        for engine in engines:
            found = judge(case, engine, options.tol or TOL)
            counts = ", ".join(
                f"{verdict} {found.counts[verdict]}" for verdict in Verdict if found.counts[verdict]
            )
            print(f"{file.name}  {engine.name} {engine.mode}: {counts}")
            if any(
                found.counts[verdict]
                for verdict in Verdict
                if verdict not in (Verdict.UNJUDGED, Verdict.UNSUPPORTED)
            ):
                examined.add(engine.name)
            for verdict in BAD:
                sample = found.first(verdict)
                if sample is not None:
                    bad = True
                    worst = found.worst[0]
                    off = (
                        ""
                        if worst is None
                        else f", position error {worst:.2g} times the round-off bound"
                    )
                    print(
                        f"  {verdict} first at {case.sweep.driver} ="
                        f" {case.sweep.values[sample]:.9g}{off}"
                    )
            if found.message:
                print(f"  {found.message}")
    if idle := [engine.name for engine in engines if engine.name not in examined]:
        raise KincheckError(
            f"no sample of {', '.join(idle)} was examined: give another engine or other files"
        )
    return Status.DEVIATES if bad else Status.WITHIN
