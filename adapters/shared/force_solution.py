"""Forces of a solved motion by a simulator's own inverse dynamics: J^T lambda = M a + h - Q.

J has the rows of the projection, for joints, relations and drivers. Messages name forces that
redundant rows leave undetermined by joint and direction, as in the native engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ...core.case.case import Case
from ...core.forces import DETERMINED, Forces, Reaction, no_forces_at
from ...core.mechanism.loads import Torque, TorsionSpringDamper
from ...core.trajectory import Array
from .pose_solver import RANK_TOLERANCE, Sample
from .projection_model import ProjectionModel


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Forces of a simulator at a sample, in kg, s and the model's unit of length.

    Attributes:
        demand: M a + h - Q for the unknowns, shape (unknowns,).
        reactions: by joint, the wrench on its second body about the joint's point, force over
            moment: the part without multipliers, shape (6,), and the derivative by the multipliers,
            shape (6, rows).
        elements: the force of each force element.
    """

    demand: Array
    reactions: Mapping[str, tuple[Array, Array]]
    elements: Mapping[str, float]


@runtime_checkable
class ForceModel(ProjectionModel, Protocol):
    """A simulator's model with forces.

    Attributes:
        computed_by: for the record, the forces that the simulator computes, with its calls.
    """

    @property
    def computed_by(self) -> Mapping[str, str]: ...

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        """Return the simulator's forces at velocities and accelerations, at the current
        configuration, after calls of `residual` and `jacobian`.
        """
        ...


@dataclass(frozen=True, eq=False)
class _Solved:
    """Multipliers of the rows, shape (rows,), and a basis of their undetermined combinations."""

    multipliers: Array
    null: Array
    singular: bool


def solved_forces(
    model: ForceModel, case: Case, samples: Mapping[int, Sample], unit: float
) -> Forces:
    """Return the forces that the outputs of the case use, at solved samples.

    Args:
        samples: solved samples by their index in the sweep.
        unit: unit of length in the model [m].
    """
    mechanism, path = case.mechanism, case.sweep.path
    n, wanted = len(path.times), set(case.forces)
    force, torque = unit, unit**2  # kg unit/s^2 in N, kg unit^2/s^2 in N m
    names = [each.name for each in mechanism.drivers]
    joints = [each.name for each in mechanism.joints if each.name in wanted]
    scales = np.array([torque if each.turns else force for each in mechanism.drivers])
    turning = {f.name for f in mechanism.forces if isinstance(f, TorsionSpringDamper | Torque)}
    efforts, power, largest = np.full((n, len(names)), np.nan), *np.full((2, n), np.nan)
    amounts = {each.name: np.full(n, np.nan) for each in mechanism.forces if each.name in wanted}
    wrenches = {name: np.full((n, 6), np.nan) for name in joints}
    free = {name: np.full((n, 6, 0), np.nan) for name in joints}
    singular: list[int] = []
    for k in sorted(samples):
        at = samples[k]
        model.restore(at.saved)
        model.residual(at.c)
        J, columns = np.array(model.jacobian()), model.driver_columns()
        given = model.dynamics(at.v, at.a)
        for name, values in amounts.items():
            values[k] = given.elements[name] * (torque if name in turning else force)
        found = _solve(J, given.demand)
        if found.singular:
            singular.append(k)
            continue
        loose = np.abs(columns.T @ found.null).max(axis=1, initial=0.0)
        effort = scales * (columns.T @ found.multipliers)
        efforts[k] = np.where(loose <= DETERMINED, effort, np.nan)
        rates = path.drive(names, path.times[[k]])[1][:, 0] if names else np.zeros(0)
        powers = np.concatenate([effort * rates, -torque * given.demand * at.v])
        power[k], largest[k] = powers.sum(), np.abs(powers).max(initial=0.0)
        for name in joints:
            alone, by_multiplier = given.reactions[name]
            wrenches[name][k] = alone + by_multiplier @ found.multipliers
            if not free[name].shape[2]:
                free[name] = np.full((n, 6, found.null.shape[1]), np.nan)
            free[name][k] = by_multiplier @ found.null
    return Forces(
        {
            name: Reaction(
                force * wrenches[name][:, :3], torque * wrenches[name][:, 3:], free[name]
            )
            for name in joints
        },
        {name: efforts[:, k] for k, name in enumerate(names) if name in wanted},
        amounts,
        power,
        largest,
        no_forces_at(path.times[singular]),
    )


def _solve(J: Array, demand: Array) -> _Solved:
    """Return the multipliers of least norm for the demand."""
    rows, unknowns = J.shape
    u, sizes, vh = np.linalg.svd(J, full_matrices=True)
    if rows < unknowns or sizes[-1] <= RANK_TOLERANCE * sizes[0]:
        return _Solved(np.full((rows,), np.nan), np.zeros((rows, 0)), True)
    multipliers: Array = np.einsum("ru,u->r", u[:, :unknowns], (vh @ demand) / sizes)
    return _Solved(multipliers, u[:, unknowns:], False)
