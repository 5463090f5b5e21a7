"""A mechanism of varied geometry made ready for a path, to solve many designs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import WantedOutput
from ...kinematics.compiled.routes import Route
from ...kinematics.forces.wanted import WantedForces
from ...kinematics.native_solver import NativeSolver
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array
from .design_batch import Variants, solve_variants
from .design_forces import ForcesOfDesigns, forces_of_designs


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


@dataclass(frozen=True, eq=False)
class PreparedDesigns:
    """A mechanism of varied geometry, made ready for a path.

    Attributes:
        route: the path made ready for the compiled model.
        wanted: the wanted forces; None without any.
    """

    route: Route
    wanted: WantedForces | None = None

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

    def forces(self, found: Variants, geometry: Array, tol: float) -> ForcesOfDesigns | None:
        """Return the forces of solved designs; None where none are wanted.

        Args:
            found: the result of `solve` for the geometry.
        """
        if self.wanted is None:
            return None
        return forces_of_designs(self.route, self.wanted, found, geometry, tol)
