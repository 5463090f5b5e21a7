"""The engine protocol: all that the harness knows of an engine. The native engine implements it
too.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol, runtime_checkable

from ..case.case import Case
from ..doors import offers
from ..errors import UnsupportedError
from ..trajectory import Trajectory

STANDARD = "native"
"""Name of the standard engine, for cases without a complete reference."""

RECORDED = "recorded"
"""Mode of engines that solve nothing: their results come from a file."""


class Engine(Protocol):
    """A solver of cases.

    Attributes:
        name: name on the command line.
        mode: "projection" (the simulator's kinematics, residuals and Jacobians in a Newton loop) or
            "simulate" (its own solver or time stepping), or "recorded" (results of a file). Modes
            are separate products and never share a ranking. Name and mode together identify an
            engine: the recommended simulate mode has the simulator's name, and each variant has
            another name.
        loop: place of the loop over samples and iterations: "python", "simulator" or "compiled".
        settings: the settings in the report that a reader needs to repeat the run.

    Three attributes are optional, and False by default. `in_process`: the engine loads no foreign
    code. `bounds_error`: the engine itself bounds the error of each pose. `untimed`: its time means
    nothing, and it solves each case once.
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
        """Return the version of the simulator, or None if it is not installed. Never raises."""
        ...

    def unsupported(self, case: Case) -> str | None:
        """Return the reason if the engine cannot express the case, naming the joint or driver; else
        None.
        """
        ...

    def build(self, case: Case) -> Any:
        """Return the engine's model of the case, at the design position. Not timed."""
        ...

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Solve all samples, from the design position outwards. Timed after a warm-up.

        Args:
            model: the result of `build`; several solves may share it.
            tol: largest accepted constraint residual, relative to the mechanism's size. A pair
                fails if a solved sample has a larger one. In simulate mode the simulator's own
                settings decide on acceptance, and the residual shows the result.

        Returns:
            A trajectory of case.points. Samples out of reach are NaN with an explanation, never
            numbers. The iterations are Newton iterations; in simulate mode, time or load steps.
        """
        ...


def runs_in_process(engine: Engine) -> bool:
    """Return whether an engine may run in this process, by its attribute `in_process`. Other
    engines run in separate processes.
    """
    return bool(getattr(engine, "in_process", False))


def untimed(engine: Engine) -> bool:
    """Return whether the time of an engine means nothing, by its attribute `untimed`."""
    return bool(getattr(engine, "untimed", False))


def bounds_error(engine: Engine) -> bool:
    """Return whether an engine itself bounds the error of each pose, by its attribute
    `bounds_error`. Other engines must keep their residuals within the tolerance.
    """
    return bool(getattr(engine, "bounds_error", False))


@runtime_checkable
class Balancing(Engine, Protocol):
    """An engine that finds equilibria, of a case with `balance`."""

    def equilibria(self, case: Case) -> Trajectory:
        """Return positions and efforts at the samples: the drivers hold their values, and all other
        motions are in equilibrium, on the way of continuous loads and values from the design.
        """
        ...


def equilibria_of(engine: Any, case: Case, kind: str) -> Trajectory:
    """Return the equilibria that an extension finds with an engine of a kind.

    Raises:
        UnsupportedError: no extension does.
    """
    if kind not in (known := offers("equilibria")):
        raise UnsupportedError(f"no extension finds equilibria with {engine.name}")
    return known[kind].load()(engine, case)


@runtime_checkable
class Measurable(Engine, Protocol):
    """An engine with a work-precision diagram.

    Predictor and warm start are the same for all efforts; an effort differs only by its settings.
    """

    def efforts(self) -> Mapping[str, Engine]:
        """Return the engine at several efforts, coarse to fine, by the setting that differs."""
        ...


# This marker precedes the version: a library may also print, and may end its process with status 0.
MARKER = "its version is "
COMMAND = f"""
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
version = pickle.load(sys.stdin.buffer).version()
print({MARKER!r}, version or "", sep="")
"""

# Longest import [s]; a slower one counts as hanging. The slowest needs some seconds on a cold disk.
PATIENCE = 60.0


def versions(engines: Sequence[Engine], patience: float = PATIENCE) -> list[str | None]:
    """Return the version of each engine, in order; None if not installed, or if its process gives
    no answer.

    Args:
        patience: longest time for an answer [s].
    """
    with ThreadPoolExecutor(max(1, len(engines))) as threads:
        return list(threads.map(partial(_version, patience=patience), engines))


def _version(engine: Engine, patience: float) -> str | None:
    if runs_in_process(engine):
        return engine.version()
    ask = partial(
        subprocess.run, [sys.executable, "-P", "-c", COMMAND], capture_output=True, check=True
    )
    try:
        ended = ask(input=pickle.dumps(sys.path) + pickle.dumps(engine), timeout=patience)
    except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
        return None
    except (
        pickle.PicklingError,
        AttributeError,
        TypeError,
    ):  # the engine's pairs cannot be sent either, and their records say so
        return None
    _, marker, version = ended.stdout.decode("utf-8", "replace").rpartition(MARKER)
    return version.strip() or None if marker else None


@dataclass(frozen=True)
class Unloadable:
    """Substitute for an engine whose module cannot be imported: its pairs end in an error."""

    name: str
    reason: str
    mode: str
    loop: str = "unknown"
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def version(self) -> str | None:
        """Raise the import error. The harness calls this method first.

        Raises:
            ImportError: always.
        """
        raise ImportError(f"engine {self.name!r} cannot be loaded: {self.reason}")

    def unsupported(self, case: Case) -> str | None:
        """Return None; never called."""
        return None

    def build(self, case: Case) -> Any:
        """Return None; never called."""

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Raise an error; never called."""
        raise NotImplementedError
