"""Solution of single variants of a study, as in a run."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..errors import KincheckError
from ..report.progress import complain, lacking, uncompared
from ..studies.variation.study_choices import Sampling
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..harness.execution import Solver
    from ..studies.tolerance.study import Study


def replay_problems(options: argparse.Namespace) -> list[str]:
    """Return the problems of a replay: a Latin hypercube depends on the number of variants."""
    if not options.replay:
        return []
    if options.sampling is Sampling.LATIN:
        if options.samples is None:
            return ["--replay: a Latin hypercube depends on the number of variants; give --samples"]
    elif options.samples is not None:
        return ["--replay: seed and index identify a variant; leave out --samples"]
    return []


def replay(
    options: argparse.Namespace, registry: Registry, study: Study, engine: Engine | None
) -> int:
    """Solve single variants as a run does, with its table, report and exit status."""
    from ..harness import run as running
    from ..harness.standard import STANDARD
    from . import destinations as delivery

    for index in options.replay:
        if study.samples and index >= study.samples:
            raise KincheckError(
                f"--replay {index}: there are {study.samples} variants, 0 to {study.samples - 1};"
                " give one of them"
            )
    native = registry.engine(STANDARD)
    engines = [native] if engine is None or engine.name == STANDARD else [native, engine]
    cases = [study.of_variant(index) for index in dict.fromkeys(options.replay)]
    results = running.run(
        cases,
        engines,
        tol=options.tol,
        command=options.command,
        solver=checking_solver(options, engines[-1]),
    )
    problems: list[str] = []
    delivery.deliver(results, problems, delivery.Destinations.of(options))
    if engine is not None:
        problems += lacking(results, [], [engine.name]) + uncompared(results)
    complain(problems)
    if problems:
        return Status.FAILED
    return (
        Status.DEVIATES if any(record.outcome.bad for record in results.records) else Status.WITHIN
    )


def checking_solver(options: argparse.Namespace, engine: Engine) -> Solver:
    """Return the solver of checked variants: this process for an engine without foreign code,
    worker processes for others.
    """
    from ..harness.engine import may_run_here
    from ..harness.execution import here
    from ..harness.resource_limits import Limits, default_jobs
    from ..harness.workers.distributed import on_cluster
    from ..harness.workers.pool import in_workers

    if options.scheduler is not None:
        return on_cluster(options.scheduler, Limits())
    if may_run_here(engine):
        return here
    return in_workers(options.jobs or default_jobs(), Limits())
