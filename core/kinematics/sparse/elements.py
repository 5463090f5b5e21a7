"""The constraints of a large mechanism as elements: constraints of one kind share one small
program, its lanes are the constraints.

Constraints are of one kind if their primitives have the same type, the same of their bodies move
and the same vectors are zero (the arm of a joint at a body's origin). Values common to all of a
kind are constants of its program. All others are inputs: geometry once, poses and drives at every
evaluation, rates for the accelerations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...program import Executor, NumpyExecutor
from ...program.llvm.compiler import available
from ...program.llvm.executor import LlvmExecutor
from ...program.llvm.jit import LlvmCode
from ...trajectory import Array
from ..formulation.constraints import Constraint, Relation
from ..structure.sparse_lu import Indices
from .element_types import HOW, QUANTITIES, WHERE, ElementType, Member, Numbering


class Elements:
    """All constraints at several poses. Their values are in arrays overwritten by the next
    evaluation.

    Attributes:
        poses: how many are evaluated at once.
        numbering: of states and rates.
        owners: for every row its joint or driver, and its primitive.
        phi, nu, gamma: shape (rows, poses), in the order of the constraints.
        branch: all branch tests, shape (tests, poses).
        entries: of the Jacobian, shape (entries, poses); each place occurs once.
        rows, columns: of the entries, shape (entries,).
        results, parts: all of these, one after the other, and the place of each.
        drivers: their number.
        kinds, starts: see `ElementType`, and the start of each quantity among the results.
        compiled: whether they are evaluated by machine code.
    """

    def __init__(
        self,
        constraints: Sequence[Constraint | Relation],
        bodies: Sequence[str],
        drivers: int,
        poses: int,
        *,
        compiled: bool,
    ) -> None:
        members, self.poses, self.drivers = list[Member](), poses, drivers
        self.compiled = compiled and available()
        self.owners: list[tuple[str, str]] = []
        for k, c in enumerate(constraints, drivers - len(constraints)):  # the drivers come last
            members.append(Member(c, len(self.owners), k if k >= 0 else None))
            self.owners += [(c.owner, members[-1].what)] * (
                1 if isinstance(c, Relation) else c.primitive.n
            )
        coordinates = dict.fromkeys(name for member in members for name in member.coordinates)
        self.numbering = Numbering(
            *({name: k for k, name in enumerate(names)} for names in (bodies, coordinates))
        )
        kinds: dict[Any, list[Member]] = {}
        for member in members:
            kinds.setdefault(member.kind(self.numbering.bodies), []).append(member)
        self.kinds = [ElementType(each, self.numbering) for each in kinds.values()]
        self.rows, self.columns = (
            np.concatenate([getattr(kind, name).ravel() for kind in self.kinds])
            for name in ("rows", "columns")
        )
        sizes = dict.fromkeys(QUANTITIES, len(self.owners))
        sizes |= {
            name: sum(kind.size(name) for kind in self.kinds) for name in ("branch", "entries")
        }
        ends = np.cumsum(list(sizes.values()))
        # one array, so that each kind writes once
        self.results = np.zeros((ends[-1], poses))
        self.phi, self.nu, self.gamma, self.branch, self.entries = np.split(self.results, ends[:-1])
        starts: dict[str, int] = dict(zip(QUANTITIES, [0, *ends[:-1].tolist()], strict=True))
        self.parts = {
            name: slice(starts[name], starts[name] + size) for name, size in sizes.items()
        }
        self.starts: list[Mapping[str, int]] = []
        self._bound: list[_Bound] = []
        for kind in self.kinds:
            self.starts.append(dict(starts))
            self._bound.append(_Bound(kind, self.results, starts, compiled=self.compiled))
            for name in ("branch", "entries"):
                starts[name] += kind.size(name)

    @property
    def sizes(self) -> dict[str, dict[str, int]]:
        """Operations and flops of the programs of all kinds, for one constraint each."""
        return {name: size for kind in self.kinds for name, size in kind.sizes.items()}

    def evaluate(self, state: Array, drives: Array) -> None:
        """Update phi, nu, branch and entries.

        Args:
            state: see `Numbering`, shape (numbers, poses).
            drives: c, c_t, c_tt, cos c/2 and sin c/2 of every driver, shape (drivers * 5, poses).
        """
        given = np.concatenate([state, drives]).ravel()
        for kind in self._bound:
            kind.run(WHERE, given)

    def accelerate(self, rates: Array) -> None:
        """Update gamma at the rates, shape (unknowns, poses), for the last evaluated poses."""
        given = np.ascontiguousarray(rates).ravel()
        for kind in self._bound:
            kind.run(HOW, given)


class _Bound:
    """The constraints of a kind as lanes, at several poses."""

    def __init__(
        self, kind: ElementType, results: Array, starts: Mapping[str, int], *, compiled: bool
    ) -> None:
        """Write the constants into an array with a start for every quantity, and prepare to write
        the rest.
        """
        poses: int = results.shape[1]
        self._results, lanes = results.reshape(-1), kind.lanes * poses
        self._executor: Executor = (
            LlvmExecutor(LlvmCode(kind.plan), lanes)
            if compiled
            else NumpyExecutor(kind.plan, lanes)
        )
        for rows, value in kind.constants(starts):
            results[rows] = value

        def bound(slots: range, places: Indices) -> tuple[Array, Indices]:
            """Return slots of all lanes in memory, and the place of each in a table of poses."""
            at = (poses * places[..., None] + np.arange(poses)).reshape(-1, lanes)
            return self._executor.window(slots), self._executor.arranged(at).copy()

        # gathered and scattered by one call each: of some hundred bodies it is the calls that take
        # the time
        self._taken = {name: bound(kind.inputs[name], read) for name, read in kind.read.items()}
        self._written = {
            name: bound(kind.outputs[name], rows) for name, rows in kind.places(starts).items()
        }
        if kind.geometry:
            slots = range(kind.geometry_at, kind.geometry_at + len(kind.geometry))
            self._executor.put(slots, np.repeat(np.array(kind.geometry), poses, axis=1))

    def run(self, name: str, given: Array) -> None:
        """Run a program over numbers of the whole mechanism, and write its results."""
        window, places = self._taken[name]
        window[:] = given[places]
        if name in self._written:
            window, places = self._written[name]
            self._executor.run(name)
            self._results[places] = window
