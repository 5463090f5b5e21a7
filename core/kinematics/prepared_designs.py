"""Many designs of one mechanism along one path: geometry is an input of its programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..mechanism.motions import Path
from ..program import ITERATIONS
from ..trajectory import QUANTITIES, Array
from .compiled.motion_start import Start
from .compiled.samples import Route
from .design_batch import RECYCLED, Variants, solve_variants
from .program_size import ProgramSize
from .solver_selection import start_notes

if TYPE_CHECKING:
    from .design_forces import DesignForces, ForcesOfDesigns

# Designs solved at once at least: with fewer, the calls around them would be felt.
LEAST = 8


@dataclass(frozen=True, eq=False)
class PreparedDesigns:
    """A mechanism of varied geometry, made ready for a path.

    Attributes:
        route: the path made ready for the compiled model.
        loads: computes the forces that are wanted; None without any.
    """

    route: Route
    loads: DesignForces | None = None

    def along(self, path: Path) -> PreparedDesigns:
        """Return the same programs on another path of the same drivers."""
        route = Route(self.route.model, path)
        return PreparedDesigns(route, self.loads and self.loads.along(route))

    @property
    def start(self) -> Start:
        """The start of the nominal design."""
        return self.route.begin

    @property
    def size(self) -> ProgramSize:
        """The size of the programs."""
        return ProgramSize.of(self.route.model)

    def at_once(self, most: int) -> int:
        """Return the number of designs to solve together, at most the given one: the table of their
        motions fits in recycled memory.
        """
        of_a_design = 8 * self.route.model.kept * len(self.route.path.times)
        return max(LEAST, min(most, RECYCLED // of_a_design))

    def solve(self, geometry: Array, tol: float) -> Variants:
        """Solve designs at all samples.

        Args:
            geometry: numbers of the varied places in their order, shape (numbers, V).
            tol: as for `solve`.
        """
        return solve_variants(self.route, geometry, tol)

    def motion(self, found: Variants, point: str) -> Sequence[Array]:
        """Return position [m], velocity and acceleration of a point, as far as they were asked for,
        each of shape (3, n, V).
        """
        rows, orders = self.route.model.rows, self.route.model.orders
        return [found.kept[rows[f"{label} {point}"]] for label in QUANTITIES[:orders]]

    def pose(self, found: Variants, body: str) -> Array:
        """Return origin [m] and Euler parameters of a body that was asked for, shape (7, n, V)."""
        rows = self.route.model.rows
        return np.concatenate([found.kept[rows[f"{each} {body}"]] for each in "rp"])

    def forces(self, found: Variants, geometry: Array, tol: float) -> ForcesOfDesigns | None:
        """Return the forces of solved designs; None where none are wanted.

        Args:
            found: what `solve` returns for the geometry.
        """
        return self.loads and self.loads.of(found, geometry, tol)

    def iterations(self, found: Variants) -> Array:
        """Return Newton's iterations of each sample, shape (n, V)."""
        return found.kept[self.route.model.rows[ITERATIONS].start]

    def start_notes(self, tol: float) -> list[str]:
        """Return notes on the assumed start of the nominal design; none if it is certain."""
        model = self.route.model
        return start_notes(model.mechanism, model.request, self.route.path, tol)
