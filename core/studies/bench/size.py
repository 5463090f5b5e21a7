"""Cost against the size of a mechanism: a chain and a ring of loops, solved by every engine in
projection mode.

The loops of the chain are those of IFToMM's benchmark A02, unit cranks and couplers, with a ball
and a cross at each coupler in place of revolutes, so no row is redundant. In the ring (see
`ring`) none can be solved before the others. Every crank turns as the first one does: the truth is
a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from time import process_time
from typing import Any

import msgspec
import numpy as np

from ...case.case import Case, Output, Series, Sweep, Truth
from ...harness.engine import Engine
from ...harness.native_engine import NativeEngine
from ...harness.record import Outcome
from ...harness.standard import STANDARD
from ...joints import Revolute, Spherical, Universal
from ...kinematics import Method, NativeSolver
from ...mechanism.drivers import JointAngle
from ...mechanism.mechanism import Body, Mechanism, Point
from .precision import Contestant, contestants
from .ring import pivot, ring
from .rounds import Spread, take_turns, warmed

LOOPS = (1, 2, 4, 8, 16)
CRANKS = (4, 8, 16, 24, 48)
MANY = (16, 100, 1000, 5000)
"""For what solves a chain loop by loop."""
# Of the cranks at design [rad]; a quarter turn from upright the links are in line and the motion
# branches.
LEAN, TURN = 0.3, 0.8
SAMPLES = 64
# An engine that has taken longer than this for all samples of one size is not tried with the next
# [s]: it would fill the rounds.
LONGEST = 0.1
CHAIN, RING = "chain of four-bar loops", "ring of cranks"


class Size(msgspec.Struct, frozen=True, kw_only=True):
    """A mechanism of a number of loops, or cranks, solved by an engine.

    Attributes:
        outcome: null if it was not tried, and the message says why.
        error: largest position error of the last crank's end [m]; residual: the engine's own; null
            if it was not solved.
        us_per_sample: null unless all samples were reached.
    """

    mechanism: str
    loops: int
    bodies: int
    engine: str
    mode: str
    loop: str
    message: str
    outcome: Outcome | None = None
    error: float | None = None
    residual: float | None = None
    us_per_sample: Spread | None = None


def chain(loops: int) -> Case:
    """Return parallel cranks at (k, 0), tied by couplers; the first one turns to both sides."""
    s, c, n, z = math.sin(LEAN), math.cos(LEAN), range(loops), (0.0, 0.0, 1.0)
    cranks = [
        Revolute(f"pivot{k}", "ground", f"crank{k}", (float(k), 0.0, 0.0), z)
        for k in range(loops + 1)
    ]
    balls = [Spherical(f"ball{k}", f"crank{k}", f"coupler{k}", (k + s, c, 0.0)) for k in n]
    crosses = [
        Universal(
            f"cross{k}", f"crank{k + 1}", f"coupler{k}", (k + 1 + s, c, 0.0), (z, (0.0, 1.0, 0.0))
        )
        for k in n
    ]
    mechanism = Mechanism(
        f"chain of {loops} loops",
        [*(Body(f"crank{k}") for k in range(loops + 1)), *(Body(f"coupler{k}") for k in n)],
        [*cranks, *balls, *crosses],
        [Point("end", f"crank{loops}", (loops + s, c, 0.0))],
        [JointAngle("turn", "pivot0")],
    )
    return _turned(mechanism, "end", loops, "IFToMM benchmark A02, N-four-bar mechanism")


def circle(cranks: int) -> Case:
    """The ring; its crank farthest from the driver is looked at."""
    far = cranks // 2
    return _turned(
        ring(cranks),
        f"tip{far}",
        pivot(far, cranks),
        "a ring of parallelograms: all cranks turn alike",
    )


def _turned(mechanism: Mechanism, tip: str, at: float, source: str) -> Case:
    """Return a case whose driver turns to both sides; the tip's crank has its pivot at `at` [m]."""
    turn = np.linspace(-TURN, TURN, SAMPLES)
    x, y = np.sin(LEAN - turn), np.cos(LEAN - turn)
    why = "a thousand round-offs of a loop, by the number of loops they add up over"
    atol = 1e-12 * len(mechanism.moving)
    outputs = tuple(
        Output(name, tip, direction, False, atol, 0.0, why)
        for name, direction in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)))
    )
    reference = {"x": Series(at + x, -y, -x), "y": Series(y, x, -y)}
    return Case(
        mechanism.name,
        source,
        Truth.CLOSED_FORM,
        mechanism,
        Sweep("turn", turn),
        outputs,
        reference,
    )


BY_COMPONENTS = NativeEngine(
    NativeSolver(method=Method.BY_COMPONENTS), name=f"{STANDARD}, by components"
)
"""The native engine, a component of the mechanism after the other, similar ones by the same
code.
"""


def measure_sizes(engines: Sequence[Engine], tol: float, rounds: int) -> list[Size]:
    """Solve chains and rings of all lengths with all engines, in turns; the native engine long
    chains, too, by components.
    """
    asked: list[tuple[str, Engine, Sequence[int]]] = [(CHAIN, engine, LOOPS) for engine in engines]
    if any(isinstance(engine, NativeEngine) for engine in engines):
        asked.insert(1, (CHAIN, BY_COMPONENTS, MANY))
    asked += [(RING, engine, CRANKS) for engine in engines]
    found = [
        each for family, engine, ladder in asked for each in _solved(family, engine, ladder, tol)
    ]
    work = {
        k: each.work
        for k, (_, each) in enumerate(found)
        if each is not None and each.work is not None
    }
    seconds = take_turns(work, rounds)
    times = {k: seconds[k].times(1e6 / SAMPLES) for k in work}
    return [
        msgspec.structs.replace(size, us_per_sample=times.get(k))
        for k, (size, _) in enumerate(found)
    ]


def _solved(
    family: str, engine: Engine, ladder: Sequence[int], tol: float
) -> Iterator[tuple[Size, Contestant | None]]:
    """Return an engine's chains or rings, the shortest first, solved and not yet timed."""
    slow = ""
    for loops in ladder:
        case = chain(loops) if family == CHAIN else circle(loops)
        size = Size(
            mechanism=family,
            loops=loops,
            bodies=len(case.mechanism.moving),
            engine=engine.name,
            mode=engine.mode,
            loop=str(engine.loop),
            message=slow,
        )
        if slow:
            yield size, None
            continue
        (each,) = contestants(case, {"": engine}, tol)
        entry = each.entry
        facts: dict[str, Any] = {
            "outcome": entry.outcome,
            "message": entry.message,
            "residual": entry.residual,
        }
        yield msgspec.structs.replace(size, **facts, error=entry.errors.position), each
        if each.work is not None:
            # on a busy machine no other engine drops out than on a quiet one
            seconds = warmed(each.work, process_time)
            slow = (
                f"not tried: {loops} took {seconds:.2g} s for {SAMPLES} samples"
                if seconds > LONGEST
                else ""
            )


def growth(sizes: Sequence[Size]) -> tuple[int, int, float] | None:
    """Two numbers of loops and the exponent of an engine's cost between them; None where it was not
    timed twice.

    The larger is its largest, the smaller its first of a hundred or more, or else the next.
    """
    timed = [
        (each.loops, each.us_per_sample.median) for each in sizes if each.us_per_sample is not None
    ]
    if len(timed) < 2:
        return None
    m, u = timed[-1]
    n, t = next((each for each in timed[:-1] if each[0] >= 100), timed[-2])
    return n, m, math.log(u / t) / math.log(m / n)
