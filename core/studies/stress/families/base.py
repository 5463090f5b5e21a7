"""Base of the families: a family makes random specimens, each with a case, its truth and its
correct refusals.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ....case.case import Case, Sweep, Truth
from ....case.io.outputs import with_all_coordinates
from ....failures import FailureKind
from ....mechanism.mechanism import Mechanism
from ....mechanism.motions import Motion
from ....trajectory import Array
from ...truth.motion import Truth as Known
from ...truth.motion import followed

TOL = 1e-12
"""Largest accepted residual, as in `kincheck run`."""

# Correct kinds of refusal at or behind a singular pose, or beyond the end of the motion: Newton's
# iteration finds no pose there, or a pose of another motion.
MOTION_ENDS = frozenset(
    {
        FailureKind.LOCKED,
        FailureKind.DIVERGED,
        FailureKind.NOT_CONVERGED,
        FailureKind.NOT_SETTLED,
        FailureKind.NOT_FOUND,
        FailureKind.NO_POSE,
        FailureKind.CONTRADICTORY,
        FailureKind.WRONG_BRANCH,
        FailureKind.OTHER_ASSEMBLY,
        FailureKind.LONG_STEP,
        FailureKind.SINGULAR_AHEAD,
        FailureKind.SINGULAR_ROWS,
        FailureKind.DEAD_CENTRE,
        FailureKind.UNCERTAIN,
    }
)

Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Specimen:
    """One mechanism and its sweep.

    Attributes:
        describe: makes the case. It may raise KincheckError, which is then the outcome for every
            engine.
        truth: computes the reference of the case; None if every answer is wrong.
        reasons: further correct kinds of refusal, besides singular poses and the end of the motion.
        excused: whether a refusal for these reasons is correct although solutions exist.
        reported: whether an answer must report the contradiction of the geometry
            (`Known.violated`).
        facts: properties of the specimen, by name.
    """

    name: str
    describe: Callable[[], Case]
    truth: Callable[[Case], Known] | None = followed
    tol: float = TOL
    reasons: frozenset[FailureKind] = frozenset()
    excused: bool = False
    reported: bool = False
    facts: tuple[tuple[str, float], ...] = ()


class Family(ABC):
    """Base of the families. Declaring one with a name registers it.

    Attributes:
        about: sentence on the situation and its sizes.
        samples: largest number of samples of a specimen, which limits the fineness of the sweep;
            coarse sweeps are as frequent as fine ones.
        several: whether several specimens share the samples; else one specimen has them all.
    """

    name: ClassVar[str]
    about: ClassVar[str]
    samples: ClassVar[int] = 201
    several: ClassVar[bool] = True
    registry: ClassVar[dict[str, Family]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" in cls.__dict__:
            Family.registry[cls.name] = cls()

    @abstractmethod
    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a random specimen with a number of samples."""


def as_case(
    mechanism: Mechanism,
    driver: str,
    values: Array,
    *,
    rate: float = 1.0,
    motions: dict[str, Motion] | None = None,
    source: str = "kincheck stress",
) -> Case:
    """Return the case of a mechanism with all coordinates of all its points as outputs."""
    sweep = Sweep(driver, np.asarray(values, dtype=np.float64), rate, motions=motions or {})
    return with_all_coordinates(
        Case(mechanism.name, source, Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    )


def direction(rng: Rng) -> Array:
    """Return a random unit vector."""
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)


def power(rng: Rng, low: float, high: float) -> float:
    """Return a number between 10^low and 10^high, uniform in its logarithm."""
    return float(10.0 ** rng.uniform(low, high))


def bodies(rng: Rng, most: int) -> int:
    """Return a random number of bodies, from 3 to the most. Half of the numbers are five or less,
    because the cost grows with the square of the number.
    """
    return int(3.0 * ((most + 1) / 3.0) ** (rng.random() ** 2))
