"""Options of worker processes: their number and their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from ..errors import KincheckError
from ..harness.resource_limits import MEMORY, MOST, TIMEOUT, Limits
from ..options import option, options, positive, whole
from .parser import Command

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..harness.execution import Solver

SCHEDULER = (
    "solve on the workers of this dask.distributed scheduler instead; it exchanges pickles: whoever"
    " runs or reaches it runs code as you, here and on the workers"
)


ISOLATION = "isolation"


def limit(text: str) -> float:
    """Return the number in the text of a limit."""
    number = positive(text)
    if number > MOST:
        raise KincheckError(f"{text!r} is too large. Give {MOST:g} at most.")
    return number


@options
class Isolated(Command):
    """A command for pairs of case and engine, each solved in a worker process."""

    HEADINGS: ClassVar[Mapping[str, str]] = {
        ISOLATION: "Each case is solved with each engine in a worker process."
    }
    jobs: int | None = option(
        "worker processes at a time; default: half the processors; 0 solves in this process,"
        " without limits: the default if only the native engine runs and no limit is given",
        whole(0),
        "N",
        heading=ISOLATION,
        default=None,
    )
    timeout: float | None = option(
        f"limit for one case with one engine; default {TIMEOUT:g}, a hundred times as long"
        " as the built-in cases take",
        limit,
        "SECONDS",
        heading=ISOLATION,
        default=None,
    )
    memory: float | None = option(
        f"limit for a worker process, on Linux; default {MEMORY:g}, sixteen times as much as"
        " the built-in cases take",
        limit,
        "GB",
        heading=ISOLATION,
        default=None,
    )
    scheduler: str | None = option(SCHEDULER, metavar="ADDRESS", heading=ISOLATION, default=None)


def contradictions(options: Isolated) -> list[str]:
    """Return the contradictions between the options."""
    problems: list[str] = []
    if options.scheduler is not None and options.jobs is not None:
        problems.append(
            "--scheduler: the cluster decides how many pairs run at a time. Leave out --jobs."
        )
    if options.jobs == 0 and (options.timeout or options.memory):
        problems.append(
            "--jobs 0 solves in this process, which cannot be limited. Leave out --timeout and"
            " --memory, or --jobs."
        )
    return problems


def unreachable(options: Any) -> list[str]:
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


def solver(options: Isolated, engines: Sequence[Engine]) -> tuple[Solver, dict[str, Any]]:
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
