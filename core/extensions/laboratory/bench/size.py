"""Cost against the size of a mechanism: a chain and a ring of loops, solved by every engine in
projection mode.

The chain has the loops of IFToMM's benchmark A02, unit cranks and couplers, with a ball and a
universal joint at each coupler in place of revolutes, so no row is redundant. In the ring (see
`ring`) no loop can be solved before the others. Every crank turns like the first: the truth is a
closed form.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from time import process_time

import msgspec
import numpy as np

from ....case.case import Case, Output, Series, Sweep, Truth
from ....errors import SolveError
from ....harness.engine import STANDARD, Engine
from ....harness.native_engine import NativeEngine
from ....harness.record import Outcome
from ....joints import Inline, Joint, Revolute, Spherical, Universal
from ....kinematics import Method, NativeSolver
from ....mechanism.mechanism import Body, Mechanism, Point, Vector
from ....mechanism.motions import JointAngle
from .precision import contestants
from .rounds import Spread, Work, take_turns, warm_up

LEAN = 0.3
"""Angle of the cranks at design [rad]; a quarter turn from upright the ring is singular."""
BEFORE, AFTER = 1.0, 0.25
"""Heights of a plate's pins above its ball [m]; with equal heights, errors would grow with the
square of the ring's length.
"""
UP: Vector = (0.0, 0.0, 1.0)


def pivot(k: int, cranks: int) -> float:
    """Return the position of a crank's pivot along x [m]: outwards in steps of two and back in
    between, so that the last is near the first.
    """
    return 2.0 * k if 2 * k < cranks else 2.0 * (cranks - k) - 1.0


def tip(k: int, cranks: int, turn: float = 0.0) -> Vector:
    """Return the tip of a crank at a turn of the driver [m]; all cranks turn alike."""
    return pivot(k, cranks) + math.sin(LEAN - turn), math.cos(LEAN - turn), 0.0


def ring(cranks: int) -> Mechanism:
    """Return three or more parallel unit cranks in a ring; a plate ties each crank but the first,
    which is driven, to both neighbours.

    A plate holds a ball of its crank, and by two pins in grooves along the tips of the cranks
    before and after it. Ball and pins leave one equation between three angles, BEFORE d_k+1 =
    -AFTER d_k between their differences at design, so none of the 2 N - 2 loops can be solved
    before the others. There are 12 N - 6 unknowns and as many rows. Like the chain of
    parallelograms of IFToMM's benchmark A02, it has a known motion: every crank turns like the
    first, and every plate moves without turning.
    """
    tips = [tip(k, cranks) for k in range(cranks)]
    joints: list[Joint] = [
        Revolute(f"pivot{k}", "ground", f"crank{k}", (pivot(k, cranks), 0.0, 0.0), UP)
        for k in range(cranks)
    ]
    for k in range(1, cranks):
        joints.append(Spherical(f"ball{k}", f"crank{k}", f"plate{k}", tips[k]))
        for which, to, height in (("before", k - 1, BEFORE), ("after", (k + 1) % cranks, AFTER)):
            x, y, _ = tips[to]
            joints.append(Inline(f"{which}{k}", f"crank{to}", f"plate{k}", (x, y, height), UP))
    return Mechanism(
        f"ring of {cranks} cranks",
        [
            *(Body(f"crank{k}") for k in range(cranks)),
            *(Body(f"plate{k}") for k in range(1, cranks)),
        ],
        joints,
        [Point(f"tip{k}", f"crank{k}", tips[k]) for k in range(cranks)],
        [JointAngle("turn", "pivot0")],
    )


LOOPS = (1, 2, 4, 8, 16)
CRANKS = (4, 8, 16, 24, 48, 100)
MANY = (16, 100, 1000, 5000)
"""Chain lengths for an engine that solves loop by loop."""
# Turn of the cranks to both sides [rad]; a quarter turn from upright the links are in line and the
# motion branches.
TURN = 0.8
SAMPLES = 64
# Largest time for all samples of one size [s]; a slower engine is not tried with the next size,
# which would fill the rounds.
LONGEST = 0.1
CHAIN, RING = "chain of four-bar loops", "ring of cranks"


class Size(msgspec.Struct, frozen=True, kw_only=True):
    """A mechanism of a number of loops, or cranks, solved by an engine.

    Attributes:
        outcome: null if the engine was not tried, for the reason in the message.
        error: largest position error of the last crank's end [m]; residual: the engine's residual;
            null if not solved.
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
    """Return parallel cranks at (k, 0) with couplers in between; the first turns to both sides."""
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
    """Return the ring; its output is the crank farthest from the driver."""
    far = cranks // 2
    return _turned(
        ring(cranks),
        f"tip{far}",
        pivot(far, cranks),
        "a ring of parallelograms: all cranks turn alike",
    )


def _turned(mechanism: Mechanism, tip: str, at: float, source: str) -> Case:
    """Return a case whose driver turns to both sides; `at` is the pivot of the tip's crank [m]."""
    turn = np.linspace(-TURN, TURN, SAMPLES)
    x, y = np.sin(LEAN - turn), np.cos(LEAN - turn)
    why = "a thousand round-offs per loop, summed over the loops"
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
"""The native engine, one component of the mechanism after another; similar components share code.
"""


def measure_sizes(engines: Sequence[Engine], tol: float, rounds: int) -> list[Size]:
    """Solve chains and rings of all lengths with all engines, in turns, and long chains with the
    native engine by components.
    """
    requested: list[tuple[str, Engine, Sequence[int]]] = [
        (CHAIN, engine, LOOPS) for engine in engines
    ]
    if any(isinstance(engine, NativeEngine) for engine in engines):
        requested.insert(1, (CHAIN, BY_COMPONENTS, MANY))
    requested += [(RING, engine, CRANKS) for engine in engines]
    found = [each for asked in requested for each in _solved(*asked, tol)]
    work = {k: work for k, (_, work) in enumerate(found) if work is not None}
    times = {k: us.times(1e6 / SAMPLES) for k, us in take_turns(work, rounds).items()}
    return [
        msgspec.structs.replace(size, us_per_sample=times.get(k))
        for k, (size, _) in enumerate(found)
    ]


def _solved(
    family: str, engine: Engine, ladder: Sequence[int], tol: float
) -> Iterator[tuple[Size, Work | None]]:
    """Yield an engine's chains or rings, the shortest first, solved but not timed, with the work
    that can be.
    """
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
        solved = msgspec.structs.replace(
            size,
            outcome=entry.outcome,
            message=entry.message,
            residual=entry.residual,
            error=entry.errors.position,
        )
        yield solved, each.work
        # processor time, so that the same engines drop out on a busy machine as on a quiet one
        if each.work is not None and (seconds := warm_up(each.work, process_time)) > LONGEST:
            slow = f"not tried: {loops} took {seconds:.2g} s for {SAMPLES} samples"


class Scaling(msgspec.Struct, frozen=True, kw_only=True):
    """A mechanism of one size, solved by one method: position, velocity and acceleration of one
    point far from the driver.

    Attributes:
        size: number of loops of the chain, or of cranks of the ring.
        residual: largest constraint residual [m].
        error: position error of the point [m].
    """

    mechanism: str
    size: int
    bodies: int
    unknowns: int
    path: str
    us_per_value: Spread
    residual: float
    error: float


def measure_scalings(sizes: Sequence[int], tol: float, rounds: int) -> list[Scaling]:
    """Solve large chains and rings as one sparse system, in turns.

    Raises:
        SolveError: not all samples of a sweep were reached.
    """
    cases = {("chain", n): chain(n) for n in sizes} | {("ring", n): circle(n) for n in sizes}
    solver = NativeSolver(method=Method.SPARSE)
    work = {
        key: partial(solver.prepare(case.mechanism, case.sweep.path, case.outputs[0].points), tol)
        for key, case in cases.items()
    }
    rows: list[Scaling] = []
    for (name, size), seconds in take_turns(work, rounds).items():
        case, found = cases[name, size], work[name, size]()
        if not found.solved.all():
            raise SolveError(f"bench: {name} of {size}: {found.message}")
        x, y = (case.reference[output.name].position for output in case.outputs)
        expected = np.stack([x, y, np.zeros_like(x)], axis=1)
        off = found.points[case.outputs[0].points[0]].position - expected
        rows.append(
            Scaling(
                mechanism=name,
                size=size,
                bodies=len(case.mechanism.bodies),
                unknowns=found.details["unknowns"],
                path="sparse",
                us_per_value=seconds.times(1e6 / SAMPLES),
                residual=found.residual,
                error=float(np.abs(off).max()),
            )
        )
    return rows


def exponent(small: Scaling, large: Scaling) -> float:
    """Return the exponent of the size in the growth of the cost between two rows."""
    ratio = large.us_per_value.median / small.us_per_value.median
    return math.log(ratio) / math.log(large.unknowns / small.unknowns)


def growth(sizes: Sequence[Size]) -> tuple[int, int, float] | None:
    """Return two numbers of loops, and the exponent of an engine's cost between them; None without
    two times.

    The larger is its largest, the smaller its first of a hundred or more, or else the one before
    the largest.
    """
    timed = [
        (each.loops, each.us_per_sample.median) for each in sizes if each.us_per_sample is not None
    ]
    if len(timed) < 2:
        return None
    m, u = timed[-1]
    n, t = next((each for each in timed[:-1] if each[0] >= 100), timed[-2])
    return n, m, math.log(u / t) / math.log(m / n)
