"""The door every engine enters by, the native one included. The harness knows nothing else of
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from ..case.case import Case
from ..trajectory import Trajectory


class Engine(Protocol):
    """A way to solve a case.

    Attributes:
        name: as on the command line.
        mode: "projection" (the simulator's kinematics, residuals and Jacobians in a Newton loop) or
            "simulate" (its own solver or time stepping). Modes are different products and never
            share a ranking. Name and mode together are an engine's identity: the simulate mode that
            is recommended has the simulator's name, variants of it have one of their own.
        loop: where the loop over samples and iterations runs: "python", "simulator" or "compiled".
        settings: what the report prints so that a reader can repeat the run.
    """

    @property
    def name(self) -> str: ...
    @property
    def mode(self) -> str: ...
    @property
    def loop(self) -> str: ...
    @property
    def settings(self) -> Mapping[str, Any]: ...

    def version(self) -> str | None:
        """Version of the simulator, or None where it is not installed. Never raises."""
        ...

    def unsupported(self, case: Case) -> str | None:
        """Return the reason why this engine cannot express the case, naming the joint or driver;
        None where it can.
        """
        ...

    def build(self, case: Case) -> Any:
        """The engine's model of the case, at the design position. Not timed."""
        ...

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Solve all samples, from the design position outwards. Timed after a warm-up.

        Args:
            model: what `build` gave; may be used for several solves.
            tol: largest accepted constraint residual, relative to the mechanism's size. A pair
                whose solved samples have a larger one fails. In simulate mode the simulator's own
                settings say what it accepts, and the residual tells what came of it.

        Returns:
            A trajectory of case.points; samples that cannot be reached are NaN and explained, never
            numbers. Its iterations are Newton's; in simulate mode, time or load steps.
        """
        ...


@dataclass(frozen=True)
class Floor:
    """A bound from below on what an engine can take for a sample.

    Attributes:
        us_per_sample: the sum of the parts [us].
        counted: what was counted and how, for a reader.
        parts: time by what takes it [us].
    """

    us_per_sample: float
    counted: str
    parts: Mapping[str, float]


@runtime_checkable
class Measurable(Engine, Protocol):
    """An engine that a diagram of work against precision can be drawn of.

    The predictor and the warm start are the same for all its efforts; what an effort spares or
    spends is in its settings.
    """

    def efforts(self) -> Mapping[str, Engine]:
        """The same engine at several efforts, from coarse to fine, by what tells them apart."""
        ...

    def floor(self, case: Case) -> Floor | None:
        """What its compiled code alone needs for a sample; None where the loop is compiled and its
        time is the floor itself.
        """
        ...
