"""Equations of a model at arbitrary poses: residuals, Jacobian and right-hand sides as matrices.

For rare tasks outside the walk: poses near singular ones, curves beyond limits of travel. Many
poses at once are lanes, run by numpy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar
from ...primitives.base import Twist
from ...program import NumpyExecutor, Plan, program
from ...trajectory import Array
from ..formulation.formulation import Configuration
from .compiled_model import Model
from .programs import Tracer
from .request import FROM, RATE, RATE_T, TIME


@dataclass(frozen=True, eq=False)
class Equations:
    """The kept rows at m poses, in the order of `System.owners`.

    Attributes:
        phi: residuals, shape (m, n).
        jacobian: by the unknowns, shape (m, n, n).
        nu: right-hand sides of the velocity equations: minus the rate of the residuals at rest,
            shape (m, n).
        redundant: Jacobian of the rows left out, shape (m, dropped, n).
    """

    phi: Array
    jacobian: Array
    nu: Array
    redundant: Array

    @property
    def closure(self) -> Array:
        """Return the largest residual of each pose, shape (m,); infinite instead of NaN."""
        largest = np.abs(self.phi).max(axis=1)
        return np.where(np.isnan(largest), np.inf, largest)


def system_of(model: Model) -> System:
    """Return the equations of a model; kept with it, because tracing takes longer than the use."""
    return model.bound("system", lambda: System(model))


class System:
    """The equations of a model with constant geometry.

    A state is one column of numbers [units, rad, -]. Values of the drivers come from a sample, see
    `Model.samples`.

    Attributes:
        owners: joint or driver of every kept row.
        conditions: see `Formulation`.
        driven: which kept rows are drivers', shape (n,).
        unknowns: n.
    """

    def __init__(self, model: Model) -> None:
        self.model, self._tracer = (
            model,
            Tracer(model.mechanism, replace(model.request, compiled=False)),
        )
        tracer, kept = self._tracer, self._tracer.selection.chosen
        formulation, at, vector = tracer.formulation, tracer.at, tracer.layout.vector
        self.unknowns = tracer.unknowns
        self.conditions = formulation.conditions
        self.owners = [formulation.owners[k][0] for k in kept]
        joint_rows = len(formulation.owners) - len(model.mechanism.drivers)
        self.driven: NDArray[np.bool_] = np.array(kept) >= joint_rows
        self._names = {name: vector(name, len(value)) for name, value in formulation.design.items()}
        self._state = [slot for slots in self._names.values() for slot in slots]
        self._phi, self._nu, self._gamma, self._step = (
            vector(name, self.unknowns) for name in ("phi", "nu", "gamma", "step")
        )
        every, phi, nu = formulation.rows(at), formulation.phi(at), formulation.nu(at)
        rows = [every[k] for k in (*kept, *tracer.selection.dropped)]
        self._rows = len(rows)
        self._entries = np.array([(i, j) for i, row in enumerate(rows) for j in row])
        self._values = [tracer.layout.scalar(f"entry {i} {j}") for i, j in self._entries.tolist()]
        gamma = formulation.gamma(at, [tracer.tape.input(k) for k in vector(RATE, self.unknowns)])
        after = formulation.retract(at, [tracer.tape.input(k) for k in self._step])
        wanted: dict[str, tuple[Sequence[int], list[Scalar]]] = {
            "rows": (
                [*self._phi, *self._nu, *self._values],
                [
                    *(phi[k] for k in kept),
                    *(nu[k] for k in kept),
                    *(x for row in rows for x in row.values()),
                ],
            ),
            "gamma": (self._gamma, [gamma[k] for k in kept]),
            "retract": (self._state, [x for name in self._names for x in after[name]]),
        }
        programs = [
            program(name, tracer.tape, dict(zip(*each, strict=True)))
            for name, each in wanted.items()
        ]
        self._vectors, slots = tracer.layout.vectors, tracer.layout.slots
        self._plan = Plan(
            {each.name: each for each in [*programs, tracer.outputs_of_rates()]}, slots
        )
        self._sampled = [
            tracer.layout.scalar(TIME),
            *(k for name in model.request.drivers for k in self._vectors[f"drive {name}"]),
        ]
        self._executors: dict[int, NumpyExecutor] = {}

    def state(self, lanes: Array, ahead: str = FROM) -> Array:
        """Return the states of lanes of the model, by default those they are predicted from, shape
        (numbers, lanes).
        """
        return np.concatenate([lanes[self.model.vectors[f"{ahead}{name}"]] for name in self._names])

    def equations(self, state: Array, sample: Array) -> Equations:
        """The kept rows at states, shape (numbers, m), and samples, shape (sampled, m)."""
        executor = self._at(state, sample)
        executor.run("rows")
        m = state.shape[1]
        rows = np.zeros((m, self._rows, self.unknowns))
        rows[:, self._entries[:, 0], self._entries[:, 1]] = executor.get(self._values).T
        jacobian, redundant = rows[:, : self.unknowns], rows[:, self.unknowns :]
        return Equations(executor.get(self._phi).T, jacobian, executor.get(self._nu).T, redundant)

    def gamma(self, state: Array, sample: Array, rate: Array) -> Array:
        """Right-hand sides of the acceleration equations at rates of the unknowns, shape (m, n)."""
        executor = self._at(state, sample)
        executor.put(self._vectors[RATE], rate.T)
        executor.run("gamma")
        return executor.get(self._gamma).T

    def stepped(self, state: Array, step: Array) -> Array:
        """States after steps of the unknowns, shape (m, n)."""
        executor = self._executor(state.shape[1])
        executor.put(self._state, state)
        executor.put(self._step, step.T)
        executor.run("retract")
        return executor.get(self._state)

    def outputs(self, state: Array, sample: Array, rate: Array, rate_t: Array) -> dict[str, Array]:
        """The wanted motions by name, shape (components, m) each, and the tests "closure",
        "leftover" and "branch".
        """
        executor = self._at(state, sample)
        executor.put(self._vectors[RATE], rate.T)
        executor.put(self._vectors[RATE_T], rate_t.T)
        executor.run("outputs")
        slots = {name: self._vectors[name] for name in self.model.rows if name in self._vectors}
        slots |= {name: [self._plan.slots[name]] for name in ("closure", "leftover", "branch")}
        return {name: executor.get(each) for name, each in slots.items()}

    def poses(self, state: Array) -> Array:
        """Return the poses of all bodies in one state, shape (numbers, 1): displacements [units]
        and Euler parameters, (bodies, 7).

        Two states with angles that differ by whole turns have the same poses.
        """
        found = self._configuration(state[:, 0]).poses.values()
        return np.array([[*pose.u, *pose.q] for pose in found], dtype=np.float64)

    def twists(self, state: Array, rate: Array) -> Mapping[str, Twist]:
        """How the bodies move in one state, shape (numbers,), at rates of the unknowns, shape
        (n,).
        """
        return self._tracer.formulation.twists(self._configuration(state), rate.tolist())

    def _configuration(self, state: Array) -> Configuration:
        numbers = iter(state.tolist())
        named = {name: [next(numbers) for _ in slots] for name, slots in self._names.items()}
        return self._tracer.formulation.configuration(named)

    def _executor(self, lanes: int) -> NumpyExecutor:
        if lanes not in self._executors:  # kept: binding costs more than running
            self._executors[lanes] = NumpyExecutor(self._plan, lanes)
        return self._executors[lanes]

    def _at(self, state: Array, sample: Array) -> NumpyExecutor:
        executor = self._executor(state.shape[1])
        executor.put(self._state, state)
        executor.put(self._sampled, sample)
        return executor
