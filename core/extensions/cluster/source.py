"""The option --scheduler: pairs on the workers of a scheduler."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...cli.engine_source import WORKERS, EngineSource
from ...options import option, options

if TYPE_CHECKING:
    from ...harness.execution import Solver
    from ...harness.resource_limits import Limits

SCHEDULER = (
    "solve on the workers of this dask.distributed scheduler instead; it exchanges pickles: whoever"
    " runs or reaches it runs code as you, here and on the workers"
)


@options
class Scheduler(EngineSource):
    """Workers of a scheduler in place of those on this machine."""

    FOR = WORKERS
    scheduler: str | None = option(SCHEDULER, metavar="ADDRESS", heading="isolation", default=None)

    @staticmethod
    def contradictions(options: Any) -> list[str]:
        """Return the contradictions between the options."""
        if options.jobs is None:
            return []
        return ["--scheduler: the cluster decides how many pairs run at a time. Leave out --jobs."]

    @staticmethod
    def unreachable(options: Any) -> list[str]:
        """Return why the scheduler cannot be reached."""
        from .distributed import ClusterError, connect_client, load_distributed

        try:
            with connect_client(load_distributed(), options.scheduler):
                return []
        except ClusterError as error:
            return [str(error)]

    @staticmethod
    def solver(options: Any, limits: Limits) -> tuple[Solver, dict[str, Any]]:
        """Return the solver on the workers of the scheduler."""
        from .distributed import on_cluster

        return on_cluster(options.scheduler, limits), {"scheduler": options.scheduler}
