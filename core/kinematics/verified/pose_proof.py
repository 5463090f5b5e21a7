"""The proof of one pose that is known approximately, from the caller's own state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from ...algebra import Vec3
from ...mechanism.mechanism import Mechanism
from ...program.ball_executor import flint, precision
from ...trajectory import Array
from ..continuation.row_exchange import chosen_at
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import frames
from ..structure.degrees_of_freedom import select_rows
from .exact import as_double, exact_mechanism
from .exact_equations import equations
from .krawczyk import Enclosure, enclose


@dataclass(frozen=True)
class PoseState:
    """The scalars that fix a pose of a mechanism.

    Attributes:
        names: of the vectors in their order: "u BODY" (displacement of its origin), "q BODY" (Euler
            parameters) and "x JOINT.rotation" or "x JOINT.translation" (a coordinate).
        unit: of lengths [m].
        origins: of the moving bodies at the design position [units].
    """

    names: Sequence[str]
    unit: float
    origins: Mapping[str, Vec3]

    @staticmethod
    def of(mechanism: Mechanism) -> PoseState:
        """Return the state of a mechanism."""
        frame = frames(mechanism)
        names = [*Cartesian.of(mechanism, frame).design]
        return PoseState(names, frame.unit, frame.origins)


def prove_pose(
    mechanism: Mechanism,
    points: Sequence[str],
    pose: Array,
    drives: Mapping[str, Sequence[Fraction]],
    bits: int,
) -> Enclosure:
    """Prove one pose of a mechanism, its numbers read as doubles.

    Args:
        mechanism: the mechanism.
        points: names of the output points.
        pose: the approximate state, as `PoseState` orders it.
        drives: value from the design, velocity and acceleration of the moving drivers [SI].
        bits: working precision.

    Raises:
        UnprovedError: the pose is singular, or too far from a solution.
        KincheckError: python-flint is not installed, or the rows cannot be selected.
    """
    frame = frames(mechanism)
    change = {name: float(value) for name, (value, *_) in drives.items()}
    selected = select_rows(mechanism, frame, Cartesian.of(mechanism, frame)).chosen
    kept = chosen_at(mechanism, change, pose, selected)
    with precision(bits):
        traced = equations(exact_mechanism(mechanism, as_double), tuple(drives), points, kept)
        unit = Fraction(traced.frame.unit)
        driven = [
            [
                flint().arb(flint().fmpq(x.numerator, x.denominator))
                for x in (y if mechanism.driver(name).turns else y / unit for y in drive)
            ]
            for name, drive in drives.items()
        ]
        return enclose(traced, points, pose, driven, bits)
