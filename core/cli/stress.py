"""kincheck stress: test engines with random degenerate mechanisms for silently wrong answers."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..errors import KincheckError, unknown
from ..options import (
    destination,
    json_file,
    option,
    options,
    positive,
    switch,
    verbosity,
    whole,
)
from .parser import Command
from .registry import Registry, Status, given
from .run_options import MODE, MODES, TOL

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..studies.stress.families import Family
    from ..studies.stress.results import Stress

SAMPLES = 2000
FILES = ("stress.json", "stress.html", "stress.md")
OF_FAMILIES = ("family", "samples", "seed", "no_proofs")
"""Options of random mechanisms."""


@options
class StressEngines(Command):
    """Run engines on random mechanisms that are difficult for solvers, and judge every sample.

    Exit status: 0 no sample is silently wrong or refused for a wrong reason, 1 some are, 2 the tool
    could not do its work, or an engine supports none of the samples.
    """

    about: ClassVar[str] = "stress-test engines with random degenerate mechanisms"
    family: tuple[str, ...] = option(
        "default: all families", metavar="NAME", several="together", default=()
    )
    list: bool = switch("list the families", default=False)
    samples: int | None = option(
        f"number of samples over all families; default {SAMPLES}",
        whole(1),
        "N",
        default=None,
    )
    seed: int | None = option(
        "seed of the random mechanisms; default 0", whole(0), "S", default=None
    )
    engine: tuple[str, ...] = option(
        "default: native", metavar="NAME", several="together", default=()
    )
    mode: str | None = option(MODE, choices=MODES, default=None)
    out: Path | None = destination(
        "write the tables there, and the smallest bad cases as reduced case files", Path, "DIR"
    )
    json: str | None = json_file()
    no_proofs: bool = switch(
        "skip the proof of a share of the reference motions, which needs python-flint",
        default=False,
    )
    replay: tuple[Path, ...] = option(
        "judge case files instead", Path, "FILE", several="together", default=()
    )
    tol: float | None = option(
        f"largest accepted constraint residual of replayed files; default {TOL:g}",
        positive,
        "X",
        default=None,
    )
    quiet: bool = verbosity("print no progress")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..harness.standard import STANDARD
        from ..report.sections import deliver
        from ..report.terminal import page, unheaded
        from ..studies.stress.families import Family
        from ..studies.stress.report import idle, markdown, report
        from ..studies.stress.verdicts import BAD
        from . import destinations as delivery

        if self.list:
            if found := given(
                self, [name for name in vars(self) if name not in ("list", "command")]
            ):
                raise KincheckError(f"--list runs nothing; leave out {found}")
            rows = [(name, family.about) for name, family in Family.registry.items()]
            page(None).print(unheaded(rows))
            return Status.WITHIN
        problems: list[str] = []
        engines = registry.find_engines(self.engine or [STANDARD], problems, self.mode)
        if self.replay:
            if self.out or self.json:
                problems.append("--replay only prints its findings; leave out --out and --json")
            if found := given(self, OF_FAMILIES):
                problems.append(
                    f"--replay judges files, which belong to no family; leave out {found}"
                )
            if problems:
                raise KincheckError("\n".join(problems))
            return _replay(self, registry, engines)
        if self.tol is not None:
            problems.append(
                "--tol is for replayed files, and families have their own tolerances; leave it out,"
                " or give --replay"
            )
        known = Family.registry
        problems += [unknown("family", name, [*known]) for name in self.family if name not in known]
        problems += delivery.Destinations.of(self).problems(FILES)
        if problems:
            raise KincheckError("\n".join(problems))
        with delivery.json_only() if self.json == "-" else nullcontext():
            found = _run(
                self,
                [known[name] for name in dict.fromkeys(self.family or known)],
                engines,
                problems,
            )
        made = report(found)
        problems += [
            *(f"family {name} was not finished: {why}" for name, why in found.unfinished.items()),
            *idle(found),
        ]
        beside = {FILES[2]: markdown(made)}
        deliver(made, found, out=self.out, json=self.json, beside=beside, problems=problems)
        bad = any(cell.samples[verdict] for cell in found.cells for verdict in BAD)
        return Status.DEVIATES if bad else Status.WITHIN


def _run(
    options: StressEngines,
    families: list[Family],
    engines: list[Engine],
    problems: list[str],
) -> Stress:
    """Run the families; reduce and save bad examples.

    Args:
        problems: receives the reasons of examples that cannot be written.
    """
    from msgspec.structs import replace

    from ..report.terminal import Meter
    from ..studies.stress.reproducers import save
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


def _replay(options: StressEngines, registry: Registry, engines: list[Engine]) -> int:
    """Judge case files by following their motion from the design."""
    from ..studies.stress.reproducers import judge
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
