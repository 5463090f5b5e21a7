"""Forces of many designs: by their program, or one by one from the motion of all bodies.

The program of many designs computes forces beside the motion. Singular values decide on forces near
singular poses and where samples are missing, as for one design: such designs are solved again with
the motion of all bodies, by one more program, and their forces follow one by one. So are those of a
mechanism whose forces cannot be traced.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..forces import Forces
from ..mechanism.mechanism import Mechanism
from ..trajectory import Array, BodyMotion, Motions, Trajectory
from .compiled.compiled_model import Model, compile_model
from .compiled.request import FORCE_SIGMA, SIGMA, Request
from .compiled.routes import Route
from .compiled.traced_forces import can_trace
from .design_batch import Variants, solve_variants, variant_of
from .forces.reactions import forces_of
from .forces.wanted import WantedForces
from .one_design import ONE_PROGRAM, follower, motion_only, prepare


@dataclass(frozen=True, eq=False)
class ForcesOfDesigns:
    """The forces of V designs over n samples.

    Attributes:
        solved: whether each sample of each design was reached, shape (n, V).
        together: of the designs that the program decides, as lanes of samples and designs; None
            where there are none.
        decided: which those are, shape (V,).
        alone: of each other design with samples, by its number.
    """

    solved: NDArray[np.bool_]
    together: Forces | None
    decided: NDArray[np.bool_]
    alone: Mapping[int, Forces]

    def read(self, measure: Callable[[Forces], Array]) -> Array:
        """Return a measure of forces, shape (n, V); NaN where it is missing or undetermined."""
        found = np.full(self.solved.shape, np.nan)
        if self.together is not None:
            found[:, self.decided] = measure(self.together).reshape(len(found), -1)
        for k, forces in self.alone.items():
            found[:, k] = measure(forces)
        return np.where(self.solved, found, np.nan)


def compile_with_forces(mechanism: Mechanism, request: Request) -> Model:
    """Return the programs of a request, with the forces that it wants if they can be traced.

    Raises:
        SolveError: as `compile_model`.
    """
    if request.forces is None or can_trace(mechanism):
        return compile_model(mechanism, request)
    return compile_model(mechanism, replace(request, forces=None))


class DesignForces:
    """Computes the forces of designs that a model has solved.

    Args:
        route: the path made ready for the model.
        wanted: the forces wanted; the model has them if they can be traced.
    """

    def __init__(self, route: Route, wanted: WantedForces) -> None:
        self._route, self._wanted = route, wanted
        self._bodies: Route | None = None

    def along(self, route: Route) -> DesignForces:
        """Return the same forces on another path of the same drivers."""
        return DesignForces(route, self._wanted)

    def of(self, found: Variants, geometry: Array, tol: float) -> ForcesOfDesigns:
        """Return the forces of solved designs.

        Args:
            found: what `solve_variants` returns for the geometry.
            geometry: as for `solve_variants`.
        """
        decided = self._decided(found)
        together = self._together(found, decided)
        others = np.flatnonzero(~decided & found.solved.any(axis=0))
        alone = dict(zip(others.tolist(), self._alone(geometry[:, others], tol), strict=True))
        return ForcesOfDesigns(found.solved, together, decided, alone)

    def _decided(self, found: Variants) -> NDArray[np.bool_]:
        """Return which designs the program decides: all samples are far from singular poses."""
        model, count = self._route.model, int(found.solved.shape[1])
        forces = model.forces
        decided = np.full(count, fill_value=forces is not None, dtype=np.bool_)
        for name in (SIGMA, FORCE_SIGMA):
            if forces is not None and name in model.rows:
                # NaN where a sample is missing
                decided &= (found.kept[model.rows[name].start] > forces.least).all(axis=0)
        return decided

    def _together(self, found: Variants, decided: NDArray[np.bool_]) -> Forces | None:
        forces = self._route.model.forces
        if forces is None or not decided.any():
            return None
        kept = found.kept if decided.all() else found.kept[:, :, decided]
        return forces.of(kept.reshape(len(kept), -1).T)

    def _alone(self, geometry: Array, tol: float) -> Sequence[Forces]:
        count = geometry.shape[1]
        if not count:
            return ()
        model, path = self._route.model, self._route.path
        names = {*self._wanted.joints, *self._wanted.drivers, *self._wanted.elements}
        request = replace(model.request, forces=self._wanted)
        each = [variant_of(model, numbers) for numbers in geometry.T]
        if len(model.frame.moving) > ONE_PROGRAM:  # as their motion, by themselves
            plain = replace(request, varied=())
            return [_known(prepare(mechanism, plain, path)(tol).forces) for mechanism in each]
        if self._bodies is None:
            motion = motion_only(model.mechanism, replace(request, points=()))
            self._bodies = Route(compile_model(model.mechanism, motion), path)
        route = self._bodies
        found = solve_variants(route, geometry, tol)
        return [
            forces_of(
                mechanism,
                path,
                _motion(route.model, found, k),
                names,
                follower(mechanism, path, found.solved[:, k]),
            )
            for k, mechanism in enumerate(each)
        ]


def _motion(model: Model, found: Variants, k: int) -> Trajectory:
    solved = found.solved[:, k]
    none: Mapping[str, Any] = {}
    bodies = Motions(BodyMotion, found.kept[:, :, k].T, model.of_bodies)
    return Trajectory(none, solved, np.zeros(len(solved), np.int64), 0.0, bodies=bodies)


def _known(forces: Forces | None) -> Forces:
    assert forces is not None  # the request wants them
    return forces
