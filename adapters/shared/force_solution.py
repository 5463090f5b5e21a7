"""Forces of a solved motion by a simulator's own inverse dynamics: J^T lambda = M a + h - Q.

J has the rows of the projection, for joints, relations and drivers. Messages name forces that
redundant rows leave undetermined by joint and direction, as in the native engine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ...core.case.case import Case
from ...core.forces import Forces, Multipliers, Reaction, in_wrenches
from ...core.mechanism.loads import Bushing, Torque, TorsionSpringDamper
from ...core.trajectory import Array
from .pose_solver import Sample
from .projection_model import ProjectionModel


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Forces of a simulator at a sample, in kg, s and the model's unit of length.

    Attributes:
        demand: M a + h - Q for the unknowns, shape (unknowns,).
        reactions: by joint, the wrench on its second body about the joint's point, force over
            moment: the part without multipliers, shape (6,), and the derivative by the multipliers,
            of the rows left out last, shape (6, rows).
        elements: the force of each force element.
        left_out: derivative by dx of the rows left out within digits, shape (rows, unknowns).
    """

    demand: Array
    reactions: Mapping[str, tuple[Array, Array]]
    elements: Mapping[str, float]
    left_out: Array


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
class _Given:
    """The rows at a sample, those left out last, the drivers' columns, and the dynamics."""

    rows: Array
    columns: Array
    dynamics: Dynamics


def reacting(case: Case) -> list[str]:
    """Return the names of the joints whose reactions are needed: of outputs, or of all where rows
    are left out within digits; see `in_wrenches`.
    """
    mechanism, wanted = case.mechanism, set(case.forces)
    return [j.name for j in mechanism.given_joints if mechanism.reduced or j.name in wanted]


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
    joints = reacting(case)
    scales = np.array([torque if each.turns else force for each in mechanism.drivers])
    turning = {
        f.name
        for f in mechanism.forces
        if isinstance(f, TorsionSpringDamper | Torque) or (isinstance(f, Bushing) and f.turns_only)
    }
    efforts, power, largest = np.full((n, len(names)), np.nan), *np.full((2, n), np.nan)
    amounts = {each.name: np.full(n, np.nan) for each in mechanism.forces if each.name in wanted}
    solved = sorted(samples)
    given = [_given(model, samples[k]) for k in solved]
    found = _multipliers(given)
    wrenches = {name: np.full((n, 6), np.nan) for name in joints}
    free = {name: np.full((n, 6, found.free.shape[2]), np.nan) for name in joints}
    known = np.full(n, np.nan)
    known[solved] = found.known
    for k, each, multipliers, basis, singular in zip(
        solved, given, found.values, found.free, found.singular, strict=True
    ):
        dynamics = each.dynamics
        for name, values in amounts.items():
            values[k] = dynamics.elements[name] * (torque if name in turning else force)
        if singular:
            continue
        efforts[k] = scales * (each.columns.T @ multipliers[: len(each.columns)])
        rates = path.drive(names, path.times[[k]])[1][:, 0] if names else np.zeros(0)
        powers = np.concatenate([efforts[k] * rates, -torque * dynamics.demand * samples[k].v])
        power[k], largest[k] = powers.sum(), np.abs(powers).max(initial=0.0)
        undetermined = dict[str, Array]()
        for name in joints:
            alone, by_multiplier = dynamics.reactions[name]
            wrenches[name][k] = alone + by_multiplier @ multipliers
            undetermined[name] = (by_multiplier @ basis)[None]
        if mechanism.reduced:
            undetermined = in_wrenches(undetermined, known[[k]])
        for name, (each_free,) in undetermined.items():
            free[name][k] = each_free
    return Forces(
        {
            name: Reaction(
                force * wrenches[name][:, :3], torque * wrenches[name][:, 3:], free[name], known
            )
            for name in joints
            if name in wanted
        },
        {name: efforts[:, k] for k, name in enumerate(names) if name in wanted},
        amounts,
        power,
        largest,
        found.message(path.times[solved]),
    )


def _given(model: ForceModel, at: Sample) -> _Given:
    model.restore(at.saved)
    model.residual(at.c)
    J, columns = np.array(model.jacobian()), np.array(model.driver_columns())
    dynamics = model.dynamics(at.v, at.a)
    return _Given(np.vstack([J, dynamics.left_out]), columns, dynamics)


def _multipliers(given: Sequence[_Given]) -> Multipliers:
    if not given:
        return Multipliers(np.zeros((0, 0)), np.zeros((0, 0, 0)), *np.zeros((4, 0)))
    return Multipliers.of(
        np.array([each.rows for each in given]),
        np.array([each.dynamics.demand for each in given]),
        np.flatnonzero(given[0].columns.any(axis=1)).tolist(),
        len(given[0].dynamics.left_out),
    )
