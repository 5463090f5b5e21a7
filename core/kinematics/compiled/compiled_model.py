"""A mechanism made ready to be swept: its rows selected, its programs traced, its lanes laid
out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import ThreadCache, keep_last
from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...program import Executor, NumpyExecutor, Plan, Program
from ...program.llvm.compiler import available
from ...program.llvm.executor import LlvmExecutor
from ...program.llvm.jit import LlvmCode, make_loops_ready
from ...trajectory import Array
from ..formulation.driver_inputs import drive_numbers
from ..structure.components import Section
from . import acceptance, predictor
from .program_cache import Tracing, is_builtin, traced
from .request import EARLIER, FROM, TIME, Request
from .sample_rows import (
    LARGEST,
    LARGEST_OF_PARTS,
    SMALLEST,
    SMALLEST_OF_PARTS,
    kept_motions,
    kept_tests,
    row_ranges,
    rows_of_bodies,
    rows_of_points,
)

MAX_ITERATIONS = 12
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


def compile_model(mechanism: Mechanism, request: Request, section: Section | None = None) -> Model:
    """Select the rows and trace the programs that the request needs.

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
    """As `compile_model`, and the same for the same mechanism and request as long as it is among
    the last few asked for.

    Threads that ask for it at the same time may each make one.
    """
    return (
        _recent(mechanism, request) if is_builtin(mechanism) else compile_model(mechanism, request)
    )


class Model:
    """The programs of a mechanism and the lanes they run on.

    Attributes:
        selection, frame, slots, vectors, state, prescribed, blocks: see `Tracing`.
        sampled: the places of what is given at every sample: the time, and five numbers of each
            moving driver.
        geometry: the places of the numbers of all varied places.
        design: all slots of a lane that stands at the design position; NaN where the rows were
            chosen elsewhere.
        bound: what is made of it for a thread.
        rows: name of a motion or test -> its rows among what is kept of a sample.
        kept: how many rows there are.
        plan: the programs and how they are looped.
    """

    def __init__(self, mechanism: Mechanism, request: Request, tracing: Tracing) -> None:
        self.mechanism, self.request = mechanism, request
        self.selection, self.frame, self.blocks = tracing.selection, tracing.frame, tracing.blocks
        self.programs: Mapping[str, Program] = {
            program.name: program for program in tracing.programs
        }
        self.slots, self.vectors = tracing.slots, tracing.vectors
        self.state, self.prescribed = tracing.state, tracing.prescribed
        self._geometry = tracing.geometry
        self.geometry = [slot for place in tracing.geometry for slot in self.vectors[place]]
        self.sampled = [self.slots[TIME]]
        self.sampled += [
            slot for name in self.request.drivers for slot in self.vectors[f"drive {name}"]
        ]
        self._tangent = "outputs" if self.request.order == 2 else "tangent"
        motions, tests = kept_motions(request, self.state), kept_tests(request, self.blocks)
        kept = [slot for name in motions for slot in self.vectors[name]]
        self.rows = row_ranges({name: len(self.vectors[name]) for name in motions}, tests)
        self.kept = len(kept) + len(tests)
        self.plan = Plan(
            self.programs,
            self.slots,
            after=("outputs",),
            alone=acceptance.ALONE,
            joined=() if self.request.state else acceptance.JOINED,
            onward=(self._tangent,),
            sampled=[*self.sampled, *self.vectors.get(predictor.WEIGHT, ())],
            behind=tracing.behind,
            remembered=(
                [slot for name in self.state for slot in self.vectors[name]]
                if predictor.PAST in self.vectors
                else ()
            ),
            past=self.vectors.get(predictor.PAST, (0,))[0],
            carried=tracing.carried,
            continued=tracing.continued,
            kept=[*kept, *(self.slots[name] for name in tests)],
            largest=[self.slots[name] for name in (LARGEST_OF_PARTS if request.state else LARGEST)],
            smallest=[
                self.slots[name] for name in (SMALLEST_OF_PARTS if request.state else SMALLEST)
            ],
            fixed=[*(target for _, target in tracing.carried), *self.geometry, *tracing.prepared],
            taken=[slot for name in self.prescribed for slot in self.vectors[name]],
            tolerance=self.request.last_iteration,
            most=MAX_ITERATIONS,
        )
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

    @property
    def orders(self) -> int:
        """How many of position, velocity and acceleration are wanted."""
        return self.request.order + 1

    @cached_property
    def details(self) -> dict[str, Any]:
        """What the record of every solution says of the model."""
        return {**self.selection.account.details, "program": self.sizes}

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops per lane of each program."""
        return {name: each.size for name, each in self.programs.items()}

    def executor(self, lanes: int) -> Executor:
        """The programs bound to that many lanes of this thread; kept, because binding costs as much
        as running.

        Whoever asks for as many gets the same memory, and sets all that it reads.
        """
        return self.bound(
            lanes,
            lambda: (
                LlvmExecutor(self._code, lanes) if self._code else NumpyExecutor(self.plan, lanes)
            ),
        )

    def samples(self, times: Array, drive: Array) -> Array:
        """What `sampled` holds at the times, shape (sampled, n).

        Args:
            drive: value from the design, velocity and acceleration of every moving driver [SI],
                shape (3, drivers, n).
        """
        drivers = [self.mechanism.driver(name) for name in self.request.drivers]
        return np.concatenate([times[None], drive_numbers(drivers, drive, self.frame.unit)])

    def departing(self, lane: Array, sample: Array) -> Array:
        """A lane that goes on from where a solved lane stands, with the rates that a sample of the
        drives gives it there.
        """
        executor = self.executor(1)
        every = range(len(self.slots))
        executor.put(every, lane[:, None])
        self.depart(executor, sample)
        return executor.get(every)[:, 0]

    @cached_property
    def ahead(self) -> list[int]:
        """The places of what lanes are predicted from."""
        return [target for _, target in self.plan.carried]

    def depart(self, executor: Executor, sample: Array) -> None:
        """Make solved lanes those that go on from where they stand, with the rates that a sample of
        the drives gives them.
        """
        executor.put(self.sampled, sample[:, None])
        executor.run(self._tangent)
        executor.carry()
        # there is no step behind it
        executor.put([self.slots[EARLIER + TIME]], executor.get([self.slots[FROM + TIME]]))

    def standing(self, geometry: Array) -> Array:
        """All slots of lanes that stand at the design position of variants, all drivers at their
        design value.

        Normally that is the design itself. Lanes that do not close there, or are on a wrong branch,
        are NaN.

        Args:
            geometry: the numbers of all varied places, shape (numbers, variants).

        Returns:
            Shape (slots, variants).
        """
        executor = self.executor(geometry.shape[1])
        closes = self.stand(executor, geometry)
        return np.where(closes, executor.get(range(len(self.slots))), np.nan)

    def stand(self, executor: Executor, geometry: Array) -> NDArray[np.bool_]:
        """Put the lanes of an executor where `standing` says; which of them close there."""
        return self.stand_at(
            executor,
            self.state,
            self.samples(np.zeros(1), np.zeros((3, len(self.request.drivers), 1))),
            geometry,
        )

    def stand_at(
        self,
        executor: Executor,
        state: Mapping[str, Sequence[float] | Array],
        sample: Array,
        geometry: Array = NONE_VARIED,
    ) -> NDArray[np.bool_]:
        """Put the lanes of an executor where a sample of the drives has them, near a state; which
        of them close there.
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
        geometry = np.array([number for value in self._geometry.values() for number in value])
        found = self.standing(geometry[:, None])[:, 0]
        if np.isnan(found).any():
            closure = float(self.executor(1).get([self.slots["closure"]])[0, 0])
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual"
                f" {closure * self.frame.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths"
            )
        return found
