"""Forces as traced operations: reactions, efforts and the balance of power, beside accelerations.

The rows are factored already: the multipliers of a sample are one transposed solve. Redundant rows
may carry any multipliers, balanced by the others. Each gives an undetermined direction of the
multipliers, by one more transposed solve. Without their parts along these directions the
multipliers are the shortest, as by singular values: they do not depend on the choice of rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

from ...algebra import Scalar, root
from ...joints import AxialJoint
from ...mechanism.loads import TorsionSpringDamper
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Drive
from ...program import Elimination, absolute, maximum
from ..forces.equations import BodyStates, ForceEquations, powers
from ..forces.wanted import WantedForces
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import Frames
from ..formulation.formulation import Configuration
from ..structure.degrees_of_freedom import Selection, select_rows
from .request import EFFORT, ELEMENT, FORCE_SIGMA, POWER, REACTION


def can_trace(mechanism: Mechanism) -> bool:
    """Return whether programs can compute the forces: they follow the angles of torsional springs,
    and no row is left out within digits, where singular values decide.
    """
    return not mechanism.reduced and all(
        isinstance(mechanism.joint(each.joint), AxialJoint)
        for each in mechanism.forces
        if isinstance(each, TorsionSpringDamper)
    )


def angles(mechanism: Mechanism) -> list[str]:
    """Return the joint coordinates of torsional springs."""
    return [
        f"{each.joint}.rotation"
        for each in mechanism.forces
        if isinstance(each, TorsionSpringDamper)
    ]


@dataclass(frozen=True, eq=False)
class Rows:
    """Native rows, the solved ones among them, and their factors.

    Attributes:
        own: whether the motion is solved by other rows.
    """

    formulation: Cartesian
    selection: Selection
    factor: Elimination
    own: bool = False


def native_rows(
    mechanism: Mechanism, frame: Frames, drives: Mapping[str, Drive], at: Configuration
) -> Rows:
    """Return the native rows of a mechanism whose motion is solved in another style."""
    formulation = Cartesian.of(mechanism, frame, drives, named=angles(mechanism))
    selection = select_rows(mechanism, frame, formulation)
    rows = formulation.rows(at)
    factor = Elimination([rows[k] for k in selection.chosen])
    return Rows(formulation, selection, factor, own=True)


class TracedForces:
    """The forces of a traced mechanism.

    Args:
        states: motion of its bodies.
        at: configuration, with the coordinates of `angles`.
        drives: of the moving drivers.
        multipliers: of the solved rows; none if they are to be solved. Given ones are taken as they
            are, with no direction undetermined.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        rows: Rows,
        states: BodyStates,
        at: Configuration,
        drives: Mapping[str, Drive],
        multipliers: Sequence[Scalar] = (),
    ) -> None:
        self._mechanism, self._rows, self._states, self._drives = mechanism, rows, states, drives
        self._equations = ForceEquations.with_angles(mechanism, rows.formulation, at, states)
        self._left_out = () if multipliers else rows.selection.dropped
        self.multipliers = multipliers or rows.factor.solve_transposed(self._equations.demand)

    def moved(self, follow: Callable[[Sequence[Scalar]], Sequence[Scalar]]) -> list[Scalar]:
        """Return the derivatives of the multipliers by a motion.

        Args:
            follow: returns the derivatives of numbers by the motion, multipliers held.
        """
        rows = self._equations.rows
        left = [-x for x in self._equations.demand]
        for k, value in zip(self._rows.selection.chosen, self.multipliers, strict=True):
            for column, entry in rows[k].items():
                left[column] = left[column] + entry * value
        return [-x for x in self._rows.factor.solve_transposed(follow(left))]

    @cached_property
    def _multipliers(self) -> list[Scalar]:
        """Multipliers of all rows; zero of those left out."""
        return self._of_rows(self.multipliers)

    @cached_property
    def _undetermined(self) -> list[list[Scalar]]:
        """Return orthonormal balanced multipliers of all rows, one for each row left out.

        Each has a row that those before lack, so none is short, and one projection is enough.
        """
        found = list[list[Scalar]]()
        for left_out in self._left_out:
            row = self._equations.rows[left_out]
            right = [-row.get(k, 0.0) for k in range(self._equations.formulation.unknowns)]
            multipliers = self._of_rows(self._rows.factor.solve_transposed(right))
            multipliers[left_out] = 1.0
            multipliers = _without(multipliers, found)
            scale = 1.0 / root(_product(multipliers, multipliers))
            found.append([scale * x for x in multipliers])
        return found

    def _of_rows(self, chosen: Sequence[Scalar]) -> list[Scalar]:
        found: list[Scalar] = [0.0] * len(self._equations.rows)
        for k, value in zip(self._rows.selection.chosen, chosen, strict=True):
            found[k] = value
        return found

    def vectors(self, wanted: WantedForces) -> Iterator[tuple[str, list[Scalar]]]:
        """Yield the vectors of all wanted forces by name."""
        mechanism, equations = self._mechanism, self._equations
        every = [_without(self._multipliers, self._undetermined), *self._undetermined]
        efforts = {
            driver.name: equations.effort(driver, self._multipliers) for driver in mechanism.drivers
        }
        for name in wanted.joints:
            joint, values = mechanism.joint(name), list[Scalar]()
            for k, each in enumerate(every):
                force, moment = equations.reaction(joint, each)
                force = force if k else (1.0 / self._states.frame.unit) * force
                values += [*force, *moment]
            yield f"{REACTION}{name}", values
        for name, effort in efforts.items():
            yield f"{EFFORT}{name}", [effort]
        for name in wanted.elements:
            yield f"{ELEMENT}{name}", [equations.applied[name].amount]
        found = powers(
            mechanism,
            self._states,
            equations.applied,
            efforts,
            {driver.name: self._rate(driver.name) for driver in mechanism.drivers},
        )
        sizes = (absolute(each) for each in found)
        yield POWER, [sum(found, 0.0), reduce(maximum, sizes, 0.0)]
        if self._rows.own:
            yield FORCE_SIGMA, [self._rows.factor.sigma]

    def _rate(self, driver: str) -> Scalar:
        """The rate of a driver [SI]."""
        rate = self._drives.get(driver, Drive()).c_t
        turns = self._mechanism.driver(driver).turns
        return rate if turns else self._states.frame.unit * rate


def _without(a: Sequence[Scalar], basis: Sequence[Sequence[Scalar]]) -> list[Scalar]:
    """Return a vector without its parts along orthonormal ones."""
    found = [*a]
    for each in basis:
        part = _product(each, found)
        found = [x - part * y for x, y in zip(found, each, strict=True)]
    return found


def _product(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    return sum((x * y for x, y in zip(a, b, strict=True)), 0.0)
