"""Options of worker processes: their number and their limits."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from ..harness.resource_limits import MEMORY, MOST, TIMEOUT, Limits
from .option_types import whole

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..harness.execution import Solver

SCHEDULER = (
    "solve on the workers of this dask.distributed scheduler instead; it exchanges pickles: whoever"
    " runs or reaches it runs code as you, here and on the workers"
)


def add_options(parser: argparse.ArgumentParser, positive: Callable[[str], float]) -> None:
    """Add the options to a command for pairs of case and engine."""

    def limit(text: str) -> float:
        number = positive(text)
        if number > MOST:
            raise argparse.ArgumentTypeError(
                f"{text!r} is too large, expected {MOST:g} at most; give less"
            )
        return number

    group = parser.add_argument_group(
        "isolation", "Each case is solved with each engine in a worker process."
    )
    group.add_argument(
        "--jobs",
        type=whole(0),
        metavar="N",
        help=(
            "worker processes at a time; default: half the processors; 0 solves in this process,"
            " without limits: the default if only the native engine runs and no limit is given"
        ),
    )
    group.add_argument(
        "--timeout",
        type=limit,
        metavar="SECONDS",
        help=(
            f"limit for one case with one engine; default {TIMEOUT:g}, a hundred times as long"
            " as the built-in cases take"
        ),
    )
    group.add_argument(
        "--memory",
        type=limit,
        metavar="GB",
        help=(
            f"limit for a worker process, on Linux; default {MEMORY:g}, sixteen times as much as"
            " the built-in cases take"
        ),
    )
    group.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help=SCHEDULER,
    )


def contradictions(options: argparse.Namespace) -> list[str]:
    """Return the contradictions between the options."""
    problems: list[str] = []
    if options.scheduler is not None and options.jobs is not None:
        problems.append(
            "--scheduler: the cluster decides how many pairs run at a time; leave out --jobs"
        )
    if options.jobs == 0 and (options.timeout or options.memory):
        problems.append(
            "--jobs 0 solves in this process, which cannot be limited; leave out --timeout and"
            " --memory, or --jobs"
        )
    return problems


def unreachable(options: argparse.Namespace) -> list[str]:
    """Return why the requested cluster cannot be reached. This takes time, so it is the last check
    before the work.
    """
    if options.scheduler is None:
        return []
    from ..harness.workers.distributed import ClusterError, connected, loaded

    try:
        with connected(loaded(), options.scheduler):
            return []
    except ClusterError as error:
        return [str(error)]


def solver(options: argparse.Namespace, engines: Sequence[Engine]) -> tuple[Solver, dict[str, Any]]:
    """Return the solver of the pairs, and its settings for the results."""
    from ..harness.workers.distributed import on_cluster
    from ..harness.workers.pool import solver_for

    limits = Limits(options.timeout or TIMEOUT, options.memory or MEMORY)
    limited = {"timeout": limits.timeout, "memory_gb": limits.memory}
    if options.scheduler is not None:
        return on_cluster(options.scheduler, limits), {"scheduler": options.scheduler, **limited}
    wanted = limits if options.timeout or options.memory else None
    found, jobs = solver_for(engines, options.jobs, wanted)
    if jobs:
        from ..program.disk_cache import ready

        ready()  # its note would not be seen from a worker
    return found, {"jobs": jobs, **(limited if jobs else {})}
