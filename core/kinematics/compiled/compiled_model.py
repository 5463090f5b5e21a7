"""A mechanism made ready to be swept: its rows selected, its programs traced, its lanes laid
out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...caches import ThreadCache, keep_last
from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import Executor, NumpyExecutor
from ...program.llvm.compiler import available
from ...program.llvm.executor import LlvmExecutor
from ...program.llvm.jit import LlvmCode, make_loops_ready
from ...trajectory import Array
from ..formulation.driver_inputs import samples
from ..structure.components import Section
from .program_cache import Tracing, is_builtin, traced
from .request import EARLIER, FROM, TIME, Request, slots_of
from .sample_rows import rows_of_bodies, rows_of_points

if TYPE_CHECKING:
    from .force_table import ForceTable

# Models that are kept for whoever solves one mechanism again and again: to fetch one from disk
# takes longer than many sweeps.
RECENT = 8
# A design position closes to this part of the mechanism's size: hardpoints in double precision do,
# to a thousand round-offs.
CLOSED = 1e-12
# Iterations from the design position at most: a rod given longer or shorter than its design
# distance is taken up by them.
ASSEMBLING = 50
NONE_VARIED = np.empty((0, 1))
STILL = Path({}, np.zeros(1))


def compile_model(mechanism: Mechanism, request: Request, section: Section | None = None) -> Model:
    """Select the rows and trace the programs of a request.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    if request.compiled and available():
        make_loops_ready()
    return Model(mechanism, request, traced(mechanism, request, section))


@keep_last(RECENT)
def _recent(mechanism: Mechanism, request: Request) -> Model:
    return compile_model(mechanism, request)


def recent_model(mechanism: Mechanism, request: Request) -> Model:
    """Return the compiled model of a mechanism and a request; the last few are kept.

    Threads with the same request at the same time may each make one.
    """
    return (
        _recent(mechanism, request) if is_builtin(mechanism) else compile_model(mechanism, request)
    )


class Model(Tracing):
    """The traced programs of a mechanism, with the lanes that they run on.

    Attributes:
        programs, slots: of the plan.
        geometry: slots of all varied places.
        kept: number of rows kept of a sample.
        design: all slots of a lane at the design position; NaN if the rows were chosen elsewhere.
        bound: cache for each thread.
    """

    def __init__(self, mechanism: Mechanism, request: Request, tracing: Tracing) -> None:
        super().__init__(**vars(tracing))
        self.mechanism, self.request = mechanism, request
        self.programs, self.slots = self.plan.programs, self.plan.slots
        self.geometry, self.kept = slots_of(self.vectors, self.varied), len(self.plan.kept)
        compiled = self.request.compiled and available()
        self._code = LlvmCode(self.plan) if compiled else None
        self.bound = ThreadCache()
        self.design = np.full(len(self.slots), np.nan) if request.rows else self._solve_design()

    @cached_property
    def of_points(self) -> Mapping[str, list[slice | None]]:
        """By point: rows of its position, velocity and acceleration; None for an absent one."""
        return rows_of_points(self.request, self.rows)

    @cached_property
    def of_bodies(self) -> Mapping[str, list[slice | None]]:
        """By body: rows of its r, p, v and a, None for an absent one."""
        return rows_of_bodies(self.request, self.rows)

    @cached_property
    def forces(self) -> ForceTable | None:
        """The forces of a sample; None if none are wanted."""
        wanted = self.request.forces
        if wanted is None:
            return None
        from .force_table import ForceTable  # most motions are without forces

        return ForceTable(wanted, self.rows, self.frame.unit)

    @property
    def orders(self) -> int:
        """How many of position, velocity and acceleration are wanted."""
        return self.request.order + 1

    @cached_property
    def details(self) -> dict[str, Any]:
        """Details of the model for the record of a solution."""
        return {**self.selection.account.details, "program": self.sizes}

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops per lane of each program."""
        return {name: each.size for name, each in self.programs.items()}

    def executor(self, lanes: int) -> Executor:
        """Return the programs bound to lanes of this thread; kept, because binding costs as much as
        running.

        Every caller with the same number of lanes gets the same memory, and sets every slot it
        reads.
        """
        return self.bound(
            lanes,
            lambda: (
                LlvmExecutor(self._code, lanes) if self._code else NumpyExecutor(self.plan, lanes)
            ),
        )

    def samples(self, path: Path, times: Array) -> Array:
        """Return the values of the slots `sampled` at times of a path, shape (sampled, n)."""
        return samples(self.mechanism, self.request.drivers, self.frame.unit, path, times)

    def departing(self, lane: Array, sample: Array) -> Array:
        """Return a lane ready for predictions from a solved lane, with rates by a sample of the
        drives.
        """
        executor = self.executor(1)
        every = range(len(self.slots))
        executor.put(every, lane[:, None])
        self.depart(executor, sample)
        return executor.get(every)[:, 0]

    @cached_property
    def ahead(self) -> list[int]:
        """Slots of the start of a prediction."""
        return [target for _, target in self.plan.carried]

    def depart(self, executor: Executor, sample: Array) -> None:
        """Make solved lanes ready for predictions, with rates by a sample of the drives."""
        executor.put(self.sampled, sample[:, None])
        executor.run(*self.plan.onward)
        executor.carry()
        # there is no step behind it
        executor.put([self.slots[EARLIER + TIME]], executor.get([self.slots[FROM + TIME]]))

    def standing(self, geometry: Array) -> Array:
        """Return all slots of lanes at the design position of variants, shape (slots, variants).

        All drivers have their design value. Lanes that do not close there, or are on a wrong
        branch, are NaN.

        Args:
            geometry: numbers of all varied places, shape (numbers, variants).
        """
        executor = self.executor(geometry.shape[1])
        closes = self.stand(executor, geometry)
        return np.where(closes, executor.get(range(len(self.slots))), np.nan)

    def stand(self, executor: Executor, geometry: Array) -> NDArray[np.bool_]:
        """Put the lanes of an executor at the design position, see `standing`; return which of them
        close.
        """
        return self.stand_at(
            executor,
            self.state,
            self.samples(STILL, STILL.times),
            geometry,
        )

    def stand_at(
        self,
        executor: Executor,
        state: Mapping[str, Sequence[float] | Array],
        sample: Array,
        geometry: Array = NONE_VARIED,
    ) -> NDArray[np.bool_]:
        """Solve the lanes of an executor for a sample of the drives, near a state; return which of
        them close.
        """
        executor.clear()
        for name, value in (*state.items(), *self.prescribed.items()):
            executor.put(self.vectors[name], np.array(value)[:, None])
        executor.put(self.sampled, sample)
        if len(geometry):
            executor.put(self.geometry, geometry)
            executor.run("prepare")
        for _ in range(ASSEMBLING):
            executor.run("newton")
            (residual,) = executor.get([self.slots["residual"]])
            if not (residual > CLOSED).any():
                break
        executor.run("outputs")
        closure, branch = executor.get([self.slots["closure"], self.slots["branch"]])
        return (closure <= CLOSED) & (branch > 0.0)

    def _solve_design(self) -> Array:
        geometry = np.array([number for value in self.varied.values() for number in value])
        found = self.standing(geometry[:, None])[:, 0]
        if np.isnan(found).any():
            closure = float(self.executor(1).get([self.slots["closure"]])[0, 0])
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual"
                f" {closure * self.frame.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        return found
