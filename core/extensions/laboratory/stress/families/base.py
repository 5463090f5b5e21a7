"""Descriptions of the families: a family makes random specimens, each with a case, its truth and
its correct refusals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from .....case.case import Case, Sweep, Truth
from .....case.io.outputs import with_all_coordinates
from .....errors import KincheckError
from .....failures import FailureKind
from .....joints import Joint
from .....mechanism.mechanism import Mechanism
from .....mechanism.motions import Driver, JointAngle, JointDisplacement, JointDriver, Motion
from .....studies.checks.check_joint import unit_vector
from .....trajectory import Array
from ...truth.motion import Motion as ClosedForm
from ...truth.motion import Truth as Known
from ...truth.motion import closed, follow_motion

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
        case: the case, or the refusal of its description, which is then the outcome for every
            engine.
        truth: computes the reference of the case; None if every answer is wrong.
        reasons: further correct kinds of refusal, besides singular poses and the end of the motion.
        excused: whether a refusal for these reasons is correct although solutions exist.
        tilt: contradiction of the geometry [rad], which an answer must report (`Known.violated`);
            None if there is none.
    """

    name: str
    case: Case | KincheckError
    truth: Callable[[Case], Known] | None = follow_motion
    tol: float = TOL
    reasons: frozenset[FailureKind] = frozenset()
    excused: bool = False
    tilt: float | None = None


@dataclass(frozen=True, eq=False)
class Family:
    """A family of specimens.

    Attributes:
        about: sentence on the situation and its sizes.
        specimen: makes a random specimen with a number of samples.
        samples: largest number of samples of a specimen, which limits the fineness of the sweep;
            coarse sweeps are as frequent as fine ones.
        several: whether several specimens share the samples; else one specimen has them all.
    """

    name: str
    about: str
    specimen: Callable[[Rng, int], Specimen]
    samples: int = 201
    several: bool = True


def family(
    about: str, *, samples: int = 201, several: bool = True
) -> Callable[[Callable[[Rng, int], Specimen]], Family]:
    """Make the family of the decorated function, which makes a specimen and gives the name."""
    return lambda make: Family(make.__name__, about, make, samples, several)


def as_case(
    mechanism: Mechanism,
    driver: str,
    values: Array,
    *,
    rate: float = 1.0,
    motions: dict[str, Motion] | None = None,
) -> Case:
    """Return the case of a mechanism with all coordinates of all its points as outputs."""
    sweep = Sweep(driver, np.asarray(values, dtype=np.float64), rate, motions=motions or {})
    return with_all_coordinates(
        Case(mechanism.name, "kincheck stress", Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    )


def swept(
    name: str,
    mechanism: Mechanism,
    motion: ClosedForm | None,
    first: float,
    last: float,
    samples: int,
    *,
    nearest: list[float] | None = None,
    rate: float = 1.0,
    motions: dict[str, Motion] | None = None,
) -> Specimen:
    """Return the specimen of a sweep of the first driver.

    Args:
        motion: closed form of the motion; if None, the reference is followed from the design.
        nearest: swept values at poses nearest to singular; see `closed`.
    """
    values = np.linspace(first, last, samples)
    case = as_case(mechanism, mechanism.drivers[0].name, values, rate=rate, motions=motions)
    truth = partial(closed, motion=motion, nearest=nearest or ()) if motion else follow_motion
    return Specimen(name, case, truth)


OWN_DRIVERS: Mapping[str, type[JointDriver]] = {
    "rotation": JointAngle,
    "translation": JointDisplacement,
}


def own_drivers(joint: Joint) -> list[Driver]:
    """Return the drivers of a joint's own coordinates."""
    driven = [each for each in joint.freedoms if each in OWN_DRIVERS]
    return [OWN_DRIVERS[each](f"{joint.name}_{each}", joint.name) for each in driven]


def direction(rng: Rng) -> Array:
    """Return a random unit vector."""
    return unit_vector(rng.normal(size=3))


def power(rng: Rng, low: float, high: float) -> float:
    """Return a number between 10^low and 10^high, uniform in its logarithm."""
    return float(10.0 ** rng.uniform(low, high))


def sign(rng: Rng) -> float:
    """Return -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def bodies(rng: Rng, most: int) -> int:
    """Return a random number of bodies, from 3 to the most. Half of the numbers are five or less,
    because the cost grows with the square of the number.
    """
    return int(3.0 * ((most + 1) / 3.0) ** (rng.random() ** 2))
