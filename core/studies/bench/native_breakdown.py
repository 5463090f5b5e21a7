"""The native engine in detail: by request, by executor, and with and without the Python around its
loops.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...case.case import Case
from ...errors import SolveError
from ...harness.standard import STANDARD
from ...kinematics.compiled import acceptance
from ...kinematics.compiled.compiled_model import Model, compile_model
from ...kinematics.compiled.request import Request
from ...kinematics.compiled.samples import Route
from ...kinematics.continuation.sweep import follow
from ...kinematics.continuation.walk import marcher
from ...program.llvm.compiler import available
from ...trajectory import Array, Trajectory
from ...version import VERSION

EVERYTHING = "every body and point: position, velocity, acceleration"
"""The level that all others are compared with."""
ALONE = f"{EVERYTHING}; loops alone"
NUMPY = f"{EVERYTHING}; numpy executor"


@dataclass(frozen=True)
class Level:
    """The native engine, asked for more or less; see `Engine`.

    Attributes:
        order: 0 positions, 1 and velocities, 2 and accelerations.
        bodies: of every body too, in the paper's variables, and not of the compared points only.
        compiled: by machine code, else by numpy.
    """

    order: int = 2
    bodies: bool = True
    compiled: bool = True
    name = STANDARD
    mode = "projection"
    in_process = True
    bounds_error = True

    @property
    def loop(self) -> str:
        """The place of the loop over samples and iterations."""
        return "compiled" if self.compiled and available() else "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """The request and the executor."""
        return {
            "order": self.order,
            "every_body": self.bodies,
            "executor": "llvm" if self.loop == "compiled" else "numpy",
        }

    def version(self) -> str | None:
        """Version of kincheck."""
        return VERSION

    def unsupported(self, case: Case) -> str | None:
        """Never."""
        return None

    def request(self, case: Case) -> Request:
        """Return the request for a case."""
        bodies = tuple(body.name for body in case.mechanism.moving) if self.bodies else ()
        return Request(
            tuple(case.sweep.path.motions), case.points, bodies, self.order, compiled=self.compiled
        )

    def build(self, case: Case) -> Route:
        """Return the programs of the request, with the samples laid out."""
        return Route(compile_model(case.mechanism, self.request(case)), case.sweep.path)

    def solve(self, model: Route, case: Case, tol: float) -> Trajectory:
        """The whole call, Python included."""
        return follow(model, tol)


LEVELS: Mapping[str, Level] = {
    EVERYTHING: Level(),
    "every body and point: position, velocity": Level(order=1),
    "every body and point: position": Level(order=0),
    "compared points: position, velocity, acceleration": Level(bodies=False),
    "compared points: position": Level(order=0, bodies=False),
    NUMPY: Level(compiled=False),
    "every body and point: position; numpy executor": Level(order=0, compiled=False),
}
"""What is timed as a whole call, by what is asked."""


SAMPLES, MOTIONS = ("extrapolate", *acceptance.JOINED), ("extend", *acceptance.ALONE)
"""Names of the programs that predict and test lanes, by what lanes are."""


def loops_alone(case: Case, tol: float) -> Callable[[], Array]:
    """Return a call of the executor's loops over all samples, everything requested: no Python but
    two calls, no result built.

    It is the native engine's floor, tests and copying included.

    Raises:
        SolveError: a step has to be divided, which needs Python.
    """
    route = Level().build(case)
    track = marcher(route, tol, crossing=False).track

    def work() -> Array:
        kept = track.begin()
        for went, side in zip(track.run(), route.sides, strict=True):
            if went < side.count:
                raise SolveError(
                    f"case {case.name!r}: the loops alone end after {went} of {side.count} samples"
                    " on one side"
                )
        return kept

    return work


def flops_of(model: Model, iterations: float, lanes: Sequence[str] = SAMPLES) -> float:
    """Return the floating-point operations of a sample: predictor, Newton's iterations, rates,
    outputs and the test of a solution.

    Operations of rejected lanes, and further iterations for a neighbour's sake, do not count.

    Args:
        lanes: the programs to predict and test lanes of `SAMPLES` of a motion, or of `MOTIONS`;
            the first few samples use other programs.
    """
    sizes = {name: each["flops"] for name, each in model.sizes.items()}
    return iterations * sizes["newton"] + sum(sizes[name] for name in ("outputs", *lanes))
