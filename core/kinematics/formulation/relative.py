"""The relative formulation: joint coordinates of a spanning tree as unknowns, cut joints as rows.

Formulation section 5. The rows are those of the Cartesian formulation for the cut joints and the
drivers, times the velocity transformation B of the tree. With b = Bdot y_t, the accelerations at
constant rates:

    position      (Phi_Pi B) dy   = -Phi
    velocity      (Phi_Pi B) y_t  = nu
    acceleration  (Phi_Pi B) y_tt = gamma - Phi_Pi b

Tree joints hold by construction and have no rows; the system is small and dense, the Cartesian one
large and sparse.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from ...algebra import Scalar, Vec3, cross
from ...mechanism.mechanism import Mechanism
from ...primitives.base import Twist
from . import spanning_tree
from .cartesian import COLUMNS, Cartesian
from .constraints import Constraint, Frames, Relation
from .formulation import Acceleration, Condition, Configuration, Rows, State


@dataclass(frozen=True, eq=False)
class Relative:
    """A tree and the constraints that close it; implements `Formulation`.

    Attributes:
        closed: the other constraints, in Cartesian form; its named coordinates are those of the
            tree, then its own.
    """

    chains: Sequence[spanning_tree.Chain]
    closed: Cartesian
    origins: Mapping[str, Vec3]

    @staticmethod
    def of(mechanism: Mechanism, frame: Frames, found: Sequence[Constraint | Relation]) -> Relative:
        """Return the formulation of a mechanism from its constraints in the mixed style.

        The constraints of tree joints are dropped.
        """
        chains, used = spanning_tree.chains(mechanism, frame)
        left = [c for c in found if isinstance(c, Relation) or c.owner not in used]
        names = tuple(
            step.name.removeprefix("x ")
            for chain in chains
            for step in chain.steps
            if step.axis is not None
        )
        return Relative(chains, Cartesian(left, frame.moving, names), frame.origins)

    @cached_property
    def _tree_columns(self) -> Mapping[str, int]:
        """First unknown of every step of the tree, by the name of its state vector."""
        found, count = dict[str, int](), 0
        for step in (step for chain in self.chains for step in chain.steps):
            found[step.name] = count
            count += step.unknowns
        return found

    @cached_property
    def _tree_unknowns(self) -> int:
        return sum(step.unknowns for chain in self.chains for step in chain.steps)

    @cached_property
    def _own(self) -> Mapping[str, int]:
        """Unknowns of coordinates of joints outside the tree; they come last."""
        names = [name for name in self.closed.coordinates if f"x {name}" not in self._tree_columns]
        return {name: self._tree_unknowns + k for k, name in enumerate(names)}

    @property
    def unknowns(self) -> int:
        return self._tree_unknowns + len(self._own)

    @property
    def design(self) -> Mapping[str, Sequence[float]]:
        steps = (step for chain in self.chains for step in chain.steps)
        state: dict[str, Sequence[float]] = {
            s.name: (1.0, 0.0, 0.0, 0.0) if s.axis is None else (0.0,) for s in steps
        }
        return state | {f"x {name}": (0.0,) for name in self._own}

    @property
    def owners(self) -> Sequence[tuple[str, str]]:
        return self.closed.owners

    @property
    def conditions(self) -> Sequence[Condition]:
        # no joint in these rows carries another loop
        return [replace(each, remote=0) for each in self.closed.conditions]

    def configuration(self, state: State) -> Configuration:
        found = spanning_tree.posed(self.chains, state)
        return TreeConfiguration(state, found.poses, found)

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        after = spanning_tree.retracted(self.chains, at.state, step)
        return after | {
            f"x {name}": (at.state[f"x {name}"][0] + step[k],) for name, k in self._own.items()
        }

    def phi(self, at: Configuration) -> list[Scalar]:
        return self.closed.phi(at)

    def branch(self, at: Configuration) -> list[Scalar]:
        return self.closed.branch(at)

    def rows(self, at: Configuration) -> Rows:
        return [self._transformed(row, _posed(at)) for row in self.closed.rows(at)]

    def nu(self, at: Configuration) -> list[Scalar]:
        return self.closed.nu(at)

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        moved = spanning_tree.accelerating(
            self.chains, _posed(at).tree, at.state, v, [0.0] * len(v)
        )
        rates, bias = [0.0] * self.closed.unknowns, [0.0] * self.closed.unknowns
        for name, k in self.closed.columns.items():
            twist, acceleration = moved[name]
            rates[k : k + COLUMNS] = [*twist.v, *twist.w]
            bias[k : k + COLUMNS] = [*acceleration.v_t, *acceleration.w_t]
        for name, k in self.closed.coordinates.items():
            rates[k] = v[self._column(name)]
        rows = self.closed.rows(at)
        return [
            value - sum((entry * bias[k] for k, entry in row.items()), 0.0)
            for value, row in zip(self.closed.gamma(at, rates), rows, strict=True)
        ]

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        return spanning_tree.moving(self.chains, _posed(at).tree, at.state, v)

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        found = spanning_tree.accelerating(self.chains, _posed(at).tree, at.state, v, a)
        return {name: acceleration for name, (_, acceleration) in found.items()}

    def _column(self, coordinate: str) -> int:
        name = f"x {coordinate}"
        return self._tree_columns[name] if name in self._tree_columns else self._own[coordinate]

    def _transformed(self, row: Mapping[int, Scalar], at: TreeConfiguration) -> dict[int, Scalar]:
        """Return a Cartesian row times B, over the unknowns that move a body of the row."""
        entries: dict[int, Scalar] = {}
        for name, first in self.closed.columns.items():
            r = Vec3(*(row.get(first + k, 0.0) for k in range(3)))
            p = Vec3(*(row.get(first + k, 0.0) for k in range(3, COLUMNS)))
            if all(isinstance(x, float) and x == 0.0 for x in (*r, *p)):
                continue
            for k in at.tree.ancestors[name]:
                column = at.tree.columns[k]
                value = r @ column.axis
                # turning about P moves the body's origin by axis x (origin - P)
                if not column.slides:
                    value = (p + cross(at.arm(name, column, self.origins), r)) @ column.axis
                entries[k] = entries.get(k, 0.0) + value
        for name, k in self.closed.coordinates.items():
            if k in row:
                entries[self._column(name)] = entries.get(self._column(name), 0.0) + row[k]
        return {
            k: value
            for k, value in entries.items()
            if not (isinstance(value, float) and value == 0.0)
        }


@dataclass(frozen=True, eq=False)
class TreeConfiguration(Configuration):
    """A configuration with the tree it was computed from."""

    tree: spanning_tree.Posed

    def arm(self, name: str, column: spanning_tree.Column, origins: Mapping[str, Vec3]) -> Vec3:
        """Return the vector from a column's point P to a body's origin, current global axes
        [units].
        """
        return (origins[name] - column.P_design) + (self.poses[name].u - column.P)


def _posed(at: Configuration) -> TreeConfiguration:
    assert isinstance(at, TreeConfiguration)
    return at
