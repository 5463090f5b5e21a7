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

from ...forces import Forces
from ...kinematics.compiled.compiled_model import Model, compile_model
from ...kinematics.compiled.request import FORCE_SIGMA, SIGMA
from ...kinematics.compiled.routes import Route
from ...kinematics.followed import follower
from ...kinematics.forces.reactions import forces_of
from ...kinematics.forces.wanted import WantedForces
from ...kinematics.motion_solver import ONE_PROGRAM
from ...kinematics.one_design import motion_only, prepare
from ...trajectory import Array, BodyMotion, Motions, Trajectory
from .design_batch import Variants, solve_variants, variant_of


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


def forces_of_designs(
    route: Route, wanted: WantedForces, found: Variants, geometry: Array, tol: float
) -> ForcesOfDesigns:
    """Return the forces of solved designs.

    Args:
        route: the path made ready for their model, which has the forces if they can be traced.
        wanted: the forces wanted.
        found: what `solve_variants` returns for the geometry.
        geometry: as for `solve_variants`.
    """
    model, traced = route.model, route.model.forces
    # the program decides where all samples are far from singular poses
    decided, together = np.asarray(_regular(model, found).all(axis=0)), None
    if traced is not None and decided.any():
        kept = found.kept if decided.all() else found.kept[:, :, decided]
        together = traced.of(kept.reshape(len(kept), -1).T)
    others = np.flatnonzero(~decided & found.solved.any(axis=0))
    alone = _alone(route, wanted, geometry[:, others], tol) if len(others) else ()
    by_number = dict(zip(others.tolist(), alone, strict=True))
    return ForcesOfDesigns(found.solved, together, decided, by_number)


def moved_forces(route: Route, found: Variants, moved: Mapping[str, Array]) -> ForcesOfDesigns:
    """Return the derivatives of forces in the place of forces; none near singular poses, nor of
    forces that cannot be traced.

    Args:
        moved: derivatives of the vectors of forces, shape (numbers, n, V).
    """
    model, traced = route.model, route.model.forces
    every = np.ones(found.solved.shape[1], np.bool_)
    if traced is None:
        return ForcesOfDesigns(found.solved, None, every, {})
    kept = found.kept.copy()
    for name, values in moved.items():
        first = model.rows[name].start
        kept[first : first + len(values)] = values
    table = kept.reshape(len(kept), -1).T
    return ForcesOfDesigns(_regular(model, found), traced.of(table), every, {})


def _regular(model: Model, found: Variants) -> NDArray[np.bool_]:
    """Return the samples at which the program decides on forces, shape (n, V)."""
    if model.forces is None:
        return np.zeros_like(found.solved)
    # NaN where a sample is missing
    sigmas = [found.kept[model.rows[x].start] for x in (SIGMA, FORCE_SIGMA) if x in model.rows]
    return np.logical_and.reduce([each > model.forces.least for each in sigmas])


def _alone(route: Route, wanted: WantedForces, geometry: Array, tol: float) -> Sequence[Forces]:
    model, path = route.model, route.path
    names = {*wanted.joints, *wanted.drivers, *wanted.elements}
    request = replace(model.request, forces=wanted, outputs=())
    each = [variant_of(model, numbers) for numbers in geometry.T]
    if len(model.frame.moving) > ONE_PROGRAM:  # as their motion, by themselves
        plain = replace(request, varied=())
        return [_require_forces(prepare(mechanism, plain, path)(tol).forces) for mechanism in each]
    motion = motion_only(model.mechanism, replace(request, points=()))
    bodies = route.thread_cache(
        ("bodies of", wanted), lambda: Route(compile_model(model.mechanism, motion), path)
    )
    found = solve_variants(bodies, geometry, tol)
    return [
        forces_of(
            mechanism,
            path,
            _motion(bodies.model, found, k),
            names,
            follower(mechanism, path, found.solved[:, k]),
        )
        for k, mechanism in enumerate(each)
    ]


def _motion(model: Model, found: Variants, k: int) -> Trajectory:
    solved = found.solved[:, k]
    none: Mapping[str, Any] = {}
    bodies = Motions(BodyMotion, found.kept[:, :, k].T, model.motions[1])
    return Trajectory(none, solved, np.zeros(len(solved), np.int64), 0.0, bodies=bodies)


def _require_forces(forces: Forces | None) -> Forces:
    assert forces is not None  # the request wants them
    return forces
