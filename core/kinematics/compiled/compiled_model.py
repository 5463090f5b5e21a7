"""A mechanism made ready to be swept: its rows selected, its programs traced, its lanes laid out.

Programs with their layout are kept on disk beside their machine code. The key of an entry is the
mechanism, without the numbers that vary, the request and all source files of tracing and of the
wanted outputs: a change of any of them traces anew. Joints and outputs of the user are traced every
time, because their source may be anywhere.
"""

from __future__ import annotations

import hashlib
import os
import pathlib
import pickle
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from io import BytesIO
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ...caches import ThreadCache, cache_last
from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import ITERATIONS, NODES, Plan, groups_behind
from ...program.disk_cache import load_or_make
from ...program.executor import Executor, compiler, ready
from ...trajectory import Array
from ..formulation.constraints import Frames, frames
from ..formulation.parameters import placed
from ..formulation.state_vectors import samples
from ..formulation.styles import MIXED, NATIVE
from ..structure.degrees_of_freedom import Selection
from . import step_programs
from .request import (
    LARGEST,
    LARGEST_OF_PARTS,
    MAX_ITERATIONS,
    RESTING,
    SMALLEST,
    SMALLEST_OF_PARTS,
    TIME,
    Request,
    WantedOutput,
    kept_forces,
    kept_motions,
    kept_outputs,
    kept_tests,
    row_ranges,
    rows_of_motions,
    slots_of,
)

if TYPE_CHECKING:
    from .programs import Alike
    from .solution import ForceTable

CORE = pathlib.Path(__file__).parents[2]
PACKAGE = __name__.split(".kinematics.")[0]
OURS = PACKAGE.partition(".")[0]
KNOWN = {OURS, "numpy", *sys.stdlib_module_names}
"""Packages whose sources are known, or do not change what is traced."""


@dataclass(frozen=True, eq=False)
class Tracing:
    """The programs of a mechanism for a request, and the layout of their lanes.

    Attributes:
        plan: the programs, the slots of a lane, and the loops over the programs.
        vectors: name of a vector -> its slots.
        state: name of a vector of the state -> its value at design.
        varied: name of a varied place -> its values at design.
        prescribed: name of a vector of a prescribed body's motion -> its value at rest at design.
        sampled: slots with a given value at every sample: the time, and five numbers of each moving
            driver.
        rows: name of a motion or test -> its rows among those kept of a sample.
        blocks: of the rows (`Elimination.sigmas`).
        redundant: number of redundant rows among those that forces are solved by.
    """

    plan: Plan
    vectors: Mapping[str, Sequence[int]]
    state: Mapping[str, Sequence[float]]
    varied: Mapping[str, Sequence[float]]
    prescribed: Mapping[str, Sequence[float]]
    sampled: Sequence[int]
    rows: Mapping[str, slice]
    blocks: int
    redundant: int
    selection: Selection
    frame: Frames


def load_or_trace(mechanism: Mechanism, request: Request, alike: Alike | None = None) -> Tracing:
    """Select the rows and trace the programs of a request, or load them from the disk cache.

    Raises:
        SolveError: drivers and degrees of freedom do not match.
    """
    compiled = compiler() if request.compiled else None
    lanes = compiled.width if compiled else NODES  # numpy's are as many or more
    own = is_builtin(mechanism) and request.style in (NATIVE, MIXED)
    modules = modules_of(request.outputs)
    foreign = {each.partition(".")[0] for each in modules} - KNOWN
    if alike or foreign or not (own and compiled):
        return _trace(mechanism, request, alike, lanes)
    files = {sys.modules[each].__file__ for each in modules if each.startswith(f"{OURS}.")}
    folders = sorted({os.path.dirname(each) for each in files if each})
    said, own = (mechanism, request, lanes), dict[str, Any]()
    if request.varied:  # programs of all numbers are the same, but for unit and rows
        from .programs import Tracer

        tracer = Tracer(mechanism, request)
        own = {"varied": tracer.geometry, "frame": frames(mechanism), "selection": tracer.selection}
        zeros = {place: [0.0] * len(numbers) for place, numbers in tracer.geometry.items()}
        shape = replace(placed(mechanism, zeros), name="")
        said = shape, request, lanes, tracer.frame.unit, tracer.selection.chosen
    content = _source(*folders) + pickle.dumps(said)

    def made() -> bytes:
        return msgspec.msgpack.encode(_trace(mechanism, request, None, lanes), enc_hook=_plain)

    def read(whole: bytes) -> Tracing:
        found = msgspec.msgpack.decode(whole, type=Tracing, dec_hook=lambda kind, ends: kind(*ends))
        return replace(found, **own)

    return load_or_make(content, made, read)


def _plain(value: slice | np.generic) -> Any:
    """Return a range of rows as its ends, and a number of numpy as a number."""
    return (value.start, value.stop) if isinstance(value, slice) else value.item()


def is_builtin(mechanism: Mechanism) -> bool:
    """Return whether all parts are of this package: equal parts then mean the same."""
    parts = (*mechanism.joints, *mechanism.couplers, *mechanism.drivers, *mechanism.forces)
    return all(type(each).__module__.startswith(f"{PACKAGE}.") for each in parts)


class _Modules(pickle.Pickler):
    """Finds the modules of all classes and functions of what it writes."""

    def __init__(self) -> None:
        super().__init__(BytesIO())
        self.found = set[str]()

    def reducer_override(self, obj: Any) -> Any:
        """Note the modules of an object, and write it as usual."""
        cls: type[Any] = obj if isinstance(obj, type) else type(obj)
        self.found |= {obj.__module__, *(each.__module__ for each in cls.__mro__)}
        return NotImplemented


def modules_of(outputs: Sequence[WantedOutput]) -> set[str]:
    """Return the modules of the equations of outputs, and of all that they are made of."""
    modules = _Modules()
    modules.dump(outputs)
    return modules.found


@cache
def _source(*folders: str) -> bytes:
    """Return a digest of the source files of tracing, and of those in folders."""
    digest = hashlib.sha256()
    own = (os.path.join(at, name) for at in folders for name in sorted(os.listdir(at)))
    for name in (*source_files(), *(each for each in own if each.endswith(".py"))):
        with open(name, "rb", buffering=0) as file:
            digest.update(file.read())
    return digest.digest()


def source_files() -> list[str]:
    """Return the files of every folder imported by tracing; a test compares them."""
    # a new process reads them all: pathlib would take twice as long
    folders = ("primitives", "joints", "mechanism", "program", "kinematics")
    walks = (os.walk(os.path.join(CORE, folder)) for folder in folders)
    nested = (os.path.join(at, name) for walk in walks for at, _, names in walk for name in names)
    own = (os.path.join(CORE, name) for name in os.listdir(CORE))
    return sorted(name for name in (*own, *nested) if name.endswith(".py"))


def _trace(mechanism: Mechanism, request: Request, alike: Alike | None, lanes: int) -> Tracing:
    from .programs import Tracer  # with all that tracing takes: who finds it done does without
    from .traced_outputs import TracedOutputs

    tracer = Tracer(mechanism, request, alike)
    programs = [tracer.newton(), step_programs.predict(tracer)]
    # a lane needs v and a where the march goes on from it, whatever is asked for
    if request.order < 2:
        programs.append(tracer.tangent())
    if not request.state:
        programs.append(step_programs.extrapolate(tracer, lanes))
    outputs = TracedOutputs(tracer)
    programs.append(tracer.outputs(outputs.store))
    if request.slopes:
        programs.append(outputs.slopes())
    programs += step_programs.tests(tracer, neighbours=False)
    if not request.state:  # parts of a mechanism are attempted lane by lane
        programs += step_programs.tests(tracer, neighbours=True)
    if tracer.geometry:
        programs.append(tracer.prepared.program())
        if not request.state:
            programs.append(step_programs.extend(tracer))
    carried, continued = step_programs.carried_slots(tracer), step_programs.continued_slots(tracer)
    tracer.layout.scalar(ITERATIONS)
    slots, vectors, state = tracer.layout.slots, tracer.layout.vectors, tracer.formulation.design
    sampled = [slots[TIME], *slots_of(vectors, (f"drive {name}" for name in request.drivers))]
    motions = [*kept_motions(request, state), *kept_outputs(vectors)]
    motions += kept_forces(vectors) if request.forces else ()
    tests = kept_tests(request, tracer.blocks)
    fixed = [*(target for _, target in carried), *slots_of(vectors, tracer.geometry)]
    plan = Plan(
        {program.name: program for program in programs},
        slots,
        after=("outputs",),
        alone=step_programs.ALONE,
        joined=() if request.state else step_programs.JOINED,
        onward=("outputs" if request.order == 2 else "tangent",),
        sampled=[*sampled, *vectors.get(step_programs.WEIGHT, ())],
        behind=groups_behind(lanes),
        remembered=slots_of(vectors, state) if step_programs.PAST in vectors else (),
        past=vectors.get(step_programs.PAST, (0,))[0],
        carried=carried,
        continued=continued,
        kept=[*slots_of(vectors, motions), *(slots[name] for name in tests)],
        largest=[slots[name] for name in (LARGEST_OF_PARTS if request.state else LARGEST)],
        smallest=[slots[name] for name in (SMALLEST_OF_PARTS if request.state else SMALLEST)],
        fixed=[*fixed, *tracer.prepared.slots],
        taken=slots_of(vectors, tracer.at_rest),
        tolerance=request.last_iteration,
        most=MAX_ITERATIONS,
    )
    rows = row_ranges({name: len(vectors[name]) for name in motions}, tests)
    rows |= {RESTING + name: rows[of] for name, of in outputs.resting.items()}
    return Tracing(
        plan,
        vectors,
        state,
        tracer.geometry,
        tracer.at_rest,
        sampled,
        rows,
        tracer.blocks,
        len(tracer.force_rows.selection.dropped) if request.forces else 0,
        tracer.selection,
        tracer.described[1],
    )


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


def compile_model(mechanism: Mechanism, request: Request, alike: Alike | None = None) -> Model:
    """Select the rows and trace the programs of a request.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    return Model(mechanism, request, load_or_trace(mechanism, request, alike))


def is_known(mechanism: Mechanism, _: Request) -> bool:
    """Return whether what is made of a mechanism for a request may be kept; see `is_builtin`."""
    return is_builtin(mechanism)


@cache_last(RECENT, when=is_known)
def recent_model(mechanism: Mechanism, request: Request) -> Model:
    """Return the compiled model of a mechanism and a request; the last few are kept.

    Threads with the same request at the same time may each make one.
    """
    return compile_model(mechanism, request)


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
        self._bind = ready(self.plan, compiled=request.compiled)
        self.thread_cache = ThreadCache()
        self.design = np.full(len(self.slots), np.nan) if request.rows else self._solve_design()

    @cached_property
    def motions(self) -> tuple[Mapping[str, list[slice | None]], ...]:
        """See `rows_of_motions`."""
        return rows_of_motions(self.request, self.rows)

    @cached_property
    def forces(self) -> ForceTable | None:
        """The forces of a sample; None if none are wanted."""
        wanted = self.request.forces
        if wanted is None:
            return None
        from .solution import ForceTable  # most motions are without forces

        return ForceTable(wanted, self.rows, self.redundant)

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
        return self.thread_cache(lanes, lambda: self._bind(lanes))

    def samples(self, path: Path, times: Array) -> Array:
        """Return the values of the slots `sampled` at times of a path, shape (sampled, n)."""
        return samples(self.mechanism, self.request.drivers, self.frame.unit, path, times)

    def prediction_start(self, lane: Array, sample: Array) -> Array:
        """Return a lane ready for predictions from a solved lane, with rates by a sample of the
        drives.
        """
        executor = self.executor(1)
        every = range(len(self.slots))
        executor.put(every, lane[:, None])
        self.set_prediction_start(executor, sample)
        return executor.get(every)[:, 0]

    @cached_property
    def ahead(self) -> list[int]:
        """Slots of the start of a prediction."""
        return [target for _, target in self.plan.carried]

    def set_prediction_start(self, executor: Executor, sample: Array) -> None:
        """Make solved lanes ready for predictions, with rates by a sample of the drives."""
        executor.put(self.sampled, sample[:, None])
        executor.run(*self.plan.onward)
        executor.carry()

    def design_lanes(self, geometry: Array) -> Array:
        """Return all slots of lanes at the design position of variants, shape (slots, variants).

        All drivers have their design value. Lanes that do not close there, or are on a wrong
        branch, are NaN.

        Args:
            geometry: numbers of all varied places, shape (numbers, variants).
        """
        executor = self.executor(geometry.shape[1])
        closes = self.solve_at_design(executor, geometry)
        return np.where(closes, executor.get(range(len(self.slots))), np.nan)

    def solve_at_design(self, executor: Executor, geometry: Array) -> NDArray[np.bool_]:
        """Put the lanes of an executor at the design position; return which of them close. See
        `design_lanes`.
        """
        return self.solve_near(
            executor,
            self.state,
            self.samples(STILL, STILL.times),
            geometry,
        )

    def solve_near(
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
        found = self.design_lanes(geometry[:, None])[:, 0]
        # outputs that are quotients by a speed have no value there
        if np.isnan(found[self.slots["closure"]]):
            closure = float(self.executor(1).get([self.slots["closure"]])[0, 0])
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual"
                f" {closure * self.frame.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        return found
