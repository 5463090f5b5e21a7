"""Cost against the size of large mechanisms: a chain of loops, and a ring of coupled loops."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import msgspec
import numpy as np

from ...errors import SolveError
from ...kinematics import Method, NativeSolver
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path, Ramp
from ...trajectory import Trajectory
from .ring import ring, tip
from .rounds import Spread, take_turns
from .size import LEAN, chain

TURN, SAMPLES = 0.8, 64
"""Range to both sides [rad] and number of driver values of a sweep."""
TOL = 1e-12
"""Largest accepted residual, relative to the mechanism's size."""


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


def measure(chains: Sequence[int], rings: Sequence[int], rounds: int) -> list[Scaling]:
    """Solve chains and rings of the given sizes, in turns.

    Raises:
        SolveError: not all samples of a sweep were reached.
    """
    found: dict[tuple[str, int], tuple[Mechanism, Callable[[], Trajectory]]] = {}
    for name, n in [*(("chain", n) for n in chains), *(("ring", n) for n in rings)]:
        mechanism = chain(n).mechanism if name == "chain" else ring(n)
        found[name, n] = mechanism, _work(mechanism, _far(name, n))
    seconds = take_turns({key: work for key, (_, work) in found.items()}, rounds)
    return [
        _row(name, n, mechanism, work(), seconds[name, n])
        for (name, n), (mechanism, work) in found.items()
    ]


def _far(name: str, n: int) -> str:
    """Return the observed point."""
    return "end" if name == "chain" else f"tip{n // 2}"


def _work(mechanism: Mechanism, point: str) -> Callable[[], Trajectory]:
    path = Path({"turn": Ramp(1.0)}, np.linspace(-TURN, TURN, SAMPLES))
    solver = NativeSolver(method=Method.SPARSE)
    return partial(solver.prepare(mechanism, path, (point,)), TOL)


def _row(name: str, n: int, mechanism: Mechanism, found: Trajectory, seconds: Spread) -> Scaling:
    if not found.solved.all():
        raise SolveError(f"bench: {name} of {n}: {found.message}")
    turns = np.linspace(-TURN, TURN, SAMPLES)
    if name == "chain":
        expected = np.array(
            [(n + math.sin(LEAN - turn), math.cos(LEAN - turn), 0.0) for turn in turns]
        )
    else:
        expected = np.array([tip(n // 2, n, turn) for turn in turns])
    return Scaling(
        mechanism=name,
        size=n,
        bodies=len(mechanism.bodies),
        unknowns=found.details["unknowns"],
        path="sparse",
        us_per_value=seconds.times(1e6 / SAMPLES),
        residual=found.residual,
        error=float(np.abs(found.points[_far(name, n)].position - expected).max()),
    )


def exponent(small: Scaling, large: Scaling) -> float:
    """Return the exponent of the size in the growth of the cost between two rows."""
    ratio = large.us_per_value.median / small.us_per_value.median
    return math.log(ratio) / math.log(large.unknowns / small.unknowns)
