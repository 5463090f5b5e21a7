"""Conditioning of the motion, sample by sample, the dependence of points on residuals, and of
redundant rows on hardpoints.

With J the solved rows and phi their residuals at a pose that closes, q the unknowns and g the
parameters of the geometry,

    dq = J^-1 d(residual)          shift of the pose by a solver's residuals
    dq = -J^-1 (d phi / dg) dg     shift of the pose by a moved hardpoint, drivers held

so both are one factorisation; d phi / dg is exact (see `slopes`). A redundant row, left
out of J, need not hold for the changed geometry: its residual is the contradiction in this
geometry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import Request
from ...kinematics.continuation.segments import choose_rows
from ...kinematics.continuation.sweep import sweep
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import Frames
from ...kinematics.formulation.formulation import position_of
from ...kinematics.formulation.parameters import placed, places
from ...kinematics.formulation.state_vectors import displaced, jacobian, standing_drives, state_of
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...primitives.base import GROUND_POSE, Drive
from ...trajectory import Array, Trajectory
from ..slopes.slopes import Slope, derivatives
from .rank import Screw, screws


@dataclass(frozen=True, eq=False)
class PoseConditioning:
    """Conditioning of the pose at a sample.

    Attributes:
        sample: among those of the sweep.
        value: of the swept driver or time, as the sweep has it.
        owners: joint or driver and primitive of each solved row: other rows than at design if those
            are needlessly ill-conditioned.
        smallest, largest: singular values of the solved rows, lengths in mechanism sizes.
        orientation: sign of their determinant, against that at design; of all rows if there are
            more, followed from pose to pose.
        direction: the motion least determined by the rows.
        points: position of each point, global [m], whose slopes are by the residuals of the solved
            rows [m or rad].
        contradicted: derivative of each redundant row's residual by the parameters of the geometry,
            shape (redundant rows, parameters).
    """

    sample: int
    value: float
    owners: Sequence[tuple[str, str]]
    smallest: float
    largest: float
    orientation: float
    direction: list[Screw]
    points: Mapping[str, Vec3]
    contradicted: Array

    @property
    def condition(self) -> float:
        """Largest over smallest singular value."""
        return self.largest / self.smallest if self.smallest else float("inf")


@dataclass(frozen=True, eq=False)
class Conditioning:
    """A sweep, sample by sample.

    Attributes:
        trajectory: of the whole sweep, with its message if it cannot be followed.
        poses: at the examined samples, without those not reached.
    """

    trajectory: Trajectory
    poses: Sequence[PoseConditioning]


def conditioning(
    mechanism: Mechanism,
    path: Path,
    values: Array,
    points: Sequence[str],
    moves: Mapping[str, Array],
    samples: int,
    tol: float,
) -> Conditioning:
    """Examine a number of samples of a path, with both ends and the one nearest to design.

    Args:
        values: reported value of the sweep at each sample.
        points: names of the observed points.
        moves: derivatives of the numbers of each place of the geometry that depends on parameters,
            see `places`, shape (numbers, parameters).

    Raises:
        SolveError: the mechanism cannot be solved as described.
    """
    drivers, bodies = tuple(path.motions), tuple(body.name for body in mechanism.moving)
    model = compile_model(mechanism, Request(drivers, (), bodies, order=0))
    found = sweep(model, path, tol)
    frame = model.frame
    drive = path.drive(drivers, path.times)[0]
    reached = np.flatnonzero(found.solved)
    at = {
        int(k) for k in np.linspace(0, len(path.times) - 1, min(samples, len(path.times))).round()
    }
    at |= {int(np.abs(path.times).argmin()), *(reached[[0, -1]].tolist() if len(reached) else [])}
    known, parameters = places(mechanism), sum(each.shape[1] for each in [*moves.values()][:1])
    elsewhere = placed(
        mechanism, {place: tuple(map(Slope, known[place], each)) for place, each in moves.items()}
    )
    looked, matrices = list[PoseConditioning](), list[Array]()
    seen = sorted(at & set(reached.tolist()))
    for k in seen:
        change = dict(zip(drivers, drive[:, k].tolist(), strict=True))
        drives = standing_drives(mechanism, frame.unit, change)
        formulation = Cartesian.of(mechanism, frame, drives)
        pose = displaced(
            mechanism,
            frame,
            {name: (found.bodies[name].r[k], found.bodies[name].p[k]) for name in bodies},
        )
        state = state_of(formulation, mechanism, frame, pose, change)
        configuration = formulation.configuration(
            {name: tuple(map(float, vector)) for name, vector in state.items()}
        )
        matrix = jacobian(formulation, configuration)
        matrices.append(matrix)
        kept = list(
            choose_rows(
                matrix, [model.selection.chosen], len(mechanism.drivers), formulation.conditions
            )
        )
        dropped = [row for row in range(len(matrix)) if row not in kept]
        solved, rest = matrix[kept], matrix[dropped]
        U, sizes, V = np.linalg.svd(solved)
        inverse = (V.T / sizes) @ U.T
        metres = inverse / np.where(_is_length(formulation, solved), frame.unit, 1.0)
        phi = Cartesian.of(elsewhere, frame, _held(mechanism, elsewhere, drives, frame)).phi(
            configuration
        )
        by_geometry = np.array([np.broadcast_to(derivatives(x), parameters) for x in phi])
        shift = -inverse @ by_geometry[kept]
        steps = [Slope(0.0, row) for row in metres]
        poses = formulation.configuration(formulation.retract(configuration, steps)).poses
        looked.append(
            PoseConditioning(
                k,
                float(values[k]),
                [formulation.owners[row] for row in kept],
                float(sizes[-1]),
                float(sizes[0]),
                1.0,
                screws(formulation, configuration, frame, V[-1]),
                {
                    each.name: position_of(
                        each.position,
                        frame.arm(each.body, each.position),
                        frame.unit,
                        poses.get(each.body, GROUND_POSE),
                    )
                    for each in map(mechanism.point, points)
                },
                by_geometry[dropped] + rest @ shift,
            )
        )
    still = Cartesian.of(mechanism, frame)
    nearest = int(np.abs(path.times[seen]).argmin()) if seen else 0
    turned = _orientations(matrices, jacobian(still), nearest)
    return Conditioning(
        found,
        [replace(pose, orientation=x) for pose, x in zip(looked, turned, strict=True)],
    )


def _held(
    mechanism: Mechanism, elsewhere: Mechanism, drives: Mapping[str, Drive], frame: Frames
) -> dict[str, Drive]:
    """Return drives that hold the drivers' values in another geometry. Drives count from the
    design, so an absolute driver's drive changes by the move of its design value.
    """
    shift = {
        name: (elsewhere.design_value(name) - mechanism.design_value(name)) * (1.0 / frame.unit)
        for name in drives
    }
    return {name: replace(drive, c=drive.c - shift[name]) for name, drive in drives.items()}


def _orientations(matrices: Sequence[Array], design: Array, nearest: int) -> list[float]:
    """Return the signs of determinants against the sign at design, from pose to pose, beginning at
    the pose nearest to design.

    A tall matrix has none, but the product A^T B of two neighbours has one: the sum over all
    choices of rows of the products of their determinants; for square matrices the product itself.
    """
    found, n = np.ones(len(matrices)), len(matrices)
    for way in (range(nearest, n), range(nearest, -1, -1)) if n else ():
        before, sign = design, 1.0
        for k in way:
            sign *= float(np.linalg.slogdet(before.T @ matrices[k])[0])
            before, found[k] = matrices[k], sign
    return found.tolist()


def _is_length(formulation: Cartesian, rows: Array) -> NDArray[np.bool_]:
    """Return the mask of the rows of lengths: a shift changes them."""
    first = formulation.columns.values()
    slides = [k for name, k in formulation.coordinates.items() if name.endswith(".translation")]
    shifts = [k + axis for k in first for axis in range(3)] + slides
    return np.abs(rows[:, shifts]).max(axis=1) > 0.0
