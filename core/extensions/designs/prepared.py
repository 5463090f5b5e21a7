"""A mechanism of varied geometry made ready for a path, to solve many designs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import OUTPUT, RESTING, WantedOutput
from ...kinematics.compiled.routes import Route, Start
from ...kinematics.forces.wanted import WantedForces
from ...kinematics.native_solver import NativeSolver, ProgramSize
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import ITERATIONS
from ...trajectory import QUANTITIES, Array
from .design_batch import RECYCLED, Variants, slopes_of, solve_variants, start_notes

if TYPE_CHECKING:
    from .design_forces import ForcesOfDesigns


def prepare_designs(
    solver: NativeSolver,
    mechanism: Mechanism,
    path: Path,
    varied: Sequence[str],
    points: Sequence[str] = (),
    forces: Collection[str] = (),
    bodies: Sequence[str] = (),
    outputs: Sequence[WantedOutput] = (),
    *,
    force_slopes: bool = False,
) -> PreparedDesigns:
    """Return the mechanism made ready for many designs, as one program.

    Args:
        solver: settings.
        mechanism: the nominal design.
        path: as for `prepare`.
        varied: varied places, see `places` and `load_places`; all others are constants in the
            programs.
        points: names of the points whose motion is wanted.
        forces: names of joints, drivers and force elements whose forces are wanted; they take
            order 2.
        bodies: names of the bodies whose poses are wanted.
        outputs: wanted outputs, part of the programs.
        force_slopes: whether the slopes of the forces by the varied places are wanted.

    Raises:
        SolveError: as `prepare`.
    """
    request = solver.request(mechanism, path, points, bodies, forces, varied)
    request = replace(request, outputs=tuple(outputs))
    wanted = request.forces
    if wanted is not None:
        from ...kinematics.compiled.traced_forces import can_trace  # most studies are without

        traced = replace(wanted, slopes=force_slopes) if can_trace(mechanism) else None
        request = replace(request, order=2, forces=traced)
    return PreparedDesigns(Route(compile_model(mechanism, request), path), wanted)


# Designs solved at once at least: with fewer, the calls around them would be felt.
FEWEST = 8


@dataclass(frozen=True, eq=False)
class PreparedDesigns:
    """A mechanism of varied geometry, made ready for a path.

    Attributes:
        route: the path made ready for the compiled model.
        wanted: the wanted forces; None without any.
    """

    route: Route
    wanted: WantedForces | None = None

    def on_path(self, path: Path) -> PreparedDesigns:
        """Return the same programs on another path of the same drivers."""
        return replace(self, route=Route(self.route.model, path))

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
        return max(FEWEST, min(most, RECYCLED // of_a_design))

    def solve(self, geometry: Array, tol: float, *, alone: bool = True) -> Variants:
        """Solve designs at all samples.

        Args:
            geometry: numbers of the varied places in their order, shape (numbers, V).
            tol, alone: as for `solve_variants`.
        """
        return solve_variants(self.route, geometry, tol, alone=alone)

    def motion(self, found: Variants, point: str) -> Sequence[Array]:
        """Return position [m], velocity and acceleration of a point, as far as they were asked for,
        each of shape (3, n, V).
        """
        rows, orders = self.route.model.rows, self.route.model.orders
        return [found.kept[rows[f"{label} {point}"]] for label in QUANTITIES[:orders]]

    def pose(self, found: Variants, body: str) -> Array:
        """Return origin [m] and Euler parameters of a requested body, shape (7, n, V)."""
        rows = self.route.model.rows
        return np.concatenate([found.kept[rows[f"{each} {body}"]] for each in "rp"])

    def output(self, found: Variants, name: str, derivative: int = 0) -> Array:
        """Return the terms of an output, or a time derivative of theirs, shape (terms, n, V)."""
        return found.kept[self.route.model.rows[f"{OUTPUT}{QUANTITIES[derivative]} {name}"]]

    def resting(self, found: Variants, name: str) -> tuple[Array, Array] | None:
        """Return squares of the speeds of an output without a value at rest, shape (n, V); None for
        any other output.
        """
        rows = self.route.model.rows.get(f"{RESTING}{name}")
        return None if rows is None else (found.kept[rows][0], found.kept[rows][1])

    def slopes(self, found: Variants, geometry: Array, towards: Array) -> Mapping[str, Array]:
        """Return the derivatives of the vectors of outputs and forces whose slopes are wanted, by
        motions of the geometry, drivers held, shape (motions, numbers, n, V); NaN at samples not
        reached.

        Args:
            found: result of `solve` for the geometry.
            towards: motions of the varied numbers, shape (numbers, motions).
        """
        wanted = self.route.model.request.slopes  # of forces that cannot be traced there are none
        return slopes_of(self.route, found, geometry, towards) if wanted else {}

    def forces(self, found: Variants, geometry: Array, tol: float) -> ForcesOfDesigns | None:
        """Return the forces of solved designs; None where none are wanted.

        Args:
            found: the result of `solve` for the geometry.
        """
        if self.wanted is None:
            return None
        from .design_forces import forces_of_designs  # most studies are without

        return forces_of_designs(self.route, self.wanted, found, geometry, tol)

    def moved_forces(self, found: Variants, moved: Mapping[str, Array]) -> ForcesOfDesigns:
        """Return the derivatives of forces in the place of forces; see `design_forces`.

        Args:
            moved: vectors of `slopes` by one of its motions.
        """
        from .design_forces import moved_forces

        return moved_forces(self.route, found, moved)

    def iterations(self, found: Variants) -> Array:
        """Return Newton's iterations of each sample, shape (n, V)."""
        return found.kept[self.route.model.rows[ITERATIONS].start]

    def start_notes(self, tol: float) -> list[str]:
        """Return notes on the assumed start of the nominal design; none if it is certain."""
        model = self.route.model
        return start_notes(model.mechanism, model.request, self.route.path, tol)
