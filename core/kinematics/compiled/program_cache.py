"""Traced mechanisms: programs with their layout, kept on disk beside their machine code.

The key of an entry is the mechanism, the request and all source files of tracing: a change of any
of them traces anew. Joint types of the user are traced every time, because their source may be
anywhere.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ...mechanism.mechanism import Mechanism
from ...program import ITERATIONS, NODES, Plan, groups_behind
from ...program.disk_cache import kept
from ...program.llvm import compiler
from ..formulation.constraints import Frames
from ..structure.components import Section
from ..structure.degrees_of_freedom import Selection
from . import acceptance, predictor
from .request import MAX_ITERATIONS, TIME, Request, slots_of
from .sample_rows import (
    LARGEST,
    LARGEST_OF_PARTS,
    SMALLEST,
    SMALLEST_OF_PARTS,
    kept_forces,
    kept_motions,
    kept_tests,
    row_ranges,
)

CORE = Path(__file__).parents[2]
PACKAGE = __name__.split(".kinematics.")[0]


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
    """

    plan: Plan
    vectors: Mapping[str, Sequence[int]]
    state: Mapping[str, Sequence[float]]
    varied: Mapping[str, Sequence[float]]
    prescribed: Mapping[str, Sequence[float]]
    sampled: Sequence[int]
    rows: Mapping[str, slice]
    blocks: int
    selection: Selection
    frame: Frames


def traced(mechanism: Mechanism, request: Request, section: Section | None = None) -> Tracing:
    """Select the rows and trace the programs of a request, or load them from the disk cache.

    Raises:
        SolveError: drivers and degrees of freedom do not match.
    """
    compiled = request.compiled and compiler.available()
    lanes = compiler.vector_width() if compiled else NODES  # numpy's are as many or more
    if section or request.varied or not (is_builtin(mechanism) and compiled):
        return _trace(mechanism, request, section, lanes)
    content = _source() + pickle.dumps((mechanism, request, lanes))
    return kept(content, lambda: _packed(_trace(mechanism, request, None, lanes)), _unpacked)


def _packed(tracing: Tracing) -> bytes:
    return msgspec.msgpack.encode(tracing, enc_hook=_plain)


def _unpacked(whole: bytes) -> Tracing:
    return msgspec.msgpack.decode(whole, type=Tracing, dec_hook=lambda kind, ends: kind(*ends))


def _plain(value: slice | np.generic) -> Any:
    """Return a range of rows as its ends, and a number of numpy as a number."""
    return (value.start, value.stop) if isinstance(value, slice) else value.item()


def is_builtin(mechanism: Mechanism) -> bool:
    """Return whether all parts are of this package: equal parts then mean the same."""
    parts = (*mechanism.joints, *mechanism.couplers, *mechanism.drivers, *mechanism.forces)
    return all(type(each).__module__.startswith(f"{PACKAGE}.") for each in parts)


@cache
def _source() -> bytes:
    """Return a digest of the source files of tracing."""
    digest = hashlib.sha256()
    for name in source_files():
        with open(name, "rb", buffering=0) as file:
            digest.update(file.read())
    return digest.digest()


def source_files() -> list[str]:
    """Return the files of every folder imported by tracing; a test compares them."""
    # a new process reads them all: pathlib would take twice as long
    folders = ("primitives", "joints", "mechanism", "program", "kinematics")
    nested = [name for folder in folders for name in _modules(os.path.join(CORE, folder))]
    return sorted([*(each.path for each in os.scandir(CORE) if _is_module(each)), *nested])


def _modules(folder: str) -> Iterator[str]:
    for each in os.scandir(folder):
        if _is_module(each):
            yield each.path
        elif each.is_dir():
            yield from _modules(each.path)


def _is_module(entry: os.DirEntry[str]) -> bool:
    return entry.name.endswith(".py")


def _trace(mechanism: Mechanism, request: Request, section: Section | None, lanes: int) -> Tracing:
    from .programs import Tracer  # with all that tracing takes: who finds it done does without

    tracer = Tracer(mechanism, request, section)
    programs = [tracer.newton(), predictor.predict(tracer)]
    # a lane needs v and a where the march goes on from it, whatever is asked for
    if request.order < 2:
        programs.append(tracer.tangent())
    if not request.state:
        programs.append(predictor.extrapolate(tracer, lanes))
    programs.append(tracer.outputs())
    programs += acceptance.tests(tracer, neighbours=False)
    if not request.state:  # parts of a mechanism are attempted lane by lane
        programs += acceptance.tests(tracer, neighbours=True)
    if request.varied:
        programs.append(tracer.prepared.program())
        if not request.state:
            programs.append(predictor.extend(tracer))
    carried, continued = predictor.carried(tracer), predictor.continued(tracer)
    tracer.layout.scalar(ITERATIONS)
    slots, vectors, state = tracer.layout.slots, tracer.layout.vectors, tracer.formulation.design
    sampled = [slots[TIME], *slots_of(vectors, (f"drive {name}" for name in request.drivers))]
    motions = [*kept_motions(request, state), *(kept_forces(vectors) if request.forces else ())]
    tests = kept_tests(request, tracer.blocks)
    fixed = [*(target for _, target in carried), *slots_of(vectors, tracer.geometry)]
    plan = Plan(
        {program.name: program for program in programs},
        slots,
        after=("outputs",),
        alone=acceptance.ALONE,
        joined=() if request.state else acceptance.JOINED,
        onward=("outputs" if request.order == 2 else "tangent",),
        sampled=[*sampled, *vectors.get(predictor.WEIGHT, ())],
        behind=groups_behind(lanes),
        remembered=slots_of(vectors, state) if predictor.PAST in vectors else (),
        past=vectors.get(predictor.PAST, (0,))[0],
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
    return Tracing(
        plan,
        vectors,
        state,
        tracer.geometry,
        tracer.at_rest,
        sampled,
        row_ranges({name: len(vectors[name]) for name in motions}, tests),
        tracer.blocks,
        tracer.selection,
        tracer.frame,
    )
