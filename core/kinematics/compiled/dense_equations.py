"""Equations of a mechanism at arbitrary poses: residuals, Jacobian and right-hand sides.

For all that is outside one program with an elimination of its own: poses near singular ones, curves
beyond limits of travel, mechanisms too large for such a program. Many poses at once are lanes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar
from ...mechanism.motions import Path
from ...primitives.base import Twist
from ...program import NumpyExecutor, Plan, Program, program
from ...program.executor import Bind, Executor
from ...trajectory import Array
from ..formulation.formulation import Configuration
from ..formulation.state_vectors import samples
from .compiled_model import Model
from .programs import Tracer
from .request import FROM, RATE, RATE_T, TIME, kept_forces, kept_motions

GEOMETRY = "geometry"
"""The vector of numbers of the geometry."""


@dataclass(frozen=True, eq=False)
class Equations:
    """The kept rows at m poses, in the order of `System.owners`.

    Attributes:
        phi: residuals, shape (m, n).
        jacobian: by the unknowns, shape (m, n, n).
        nu: right-hand sides of the velocity equations: minus the rate of the residuals at rest,
            shape (m, n).
        redundant: Jacobian of the rows left out, shape (m, dropped, n).
        left_out: their residuals, shape (m, dropped).
    """

    phi: Array
    jacobian: Array
    nu: Array
    redundant: Array
    left_out: Array

    @property
    def closure(self) -> Array:
        """Return the largest residual of each pose, shape (m,); infinite instead of NaN."""
        largest = np.abs(self.phi).max(axis=1)
        return np.where(np.isnan(largest), np.inf, largest)

    @property
    def leftover(self) -> Array:
        """Return the largest residual of the rows left out of each pose, shape (m,)."""
        return np.abs(self.left_out).max(axis=1, initial=0.0)


def system_of(model: Model) -> System:
    """Return the equations of a model; kept with it, because tracing takes longer than the use."""
    return model.thread_cache(
        "system",
        lambda: System(
            Tracer(
                model.mechanism, replace(model.request, compiled=False), selection=model.selection
            )
        ),
    )


class System:
    """The equations of a mechanism with constant geometry.

    A state is one column of numbers [units, rad, -]. Values of the drivers come from a sample, see
    `Model.samples`.

    Attributes:
        conditions: see `Cartesian`.
        unknowns: n.
        names: by vector of the state, its numbers in a state.
        rows, columns: of the entries of the Jacobian.
        sizes: operations and flops of each program.
        geometry: values of the vector `GEOMETRY` of programs that read numbers of the geometry.
        after: before the names of the vectors of a state after a step.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    sizes: dict[str, dict[str, int]]
    geometry: Array = np.empty((0, 1))
    after = ""

    def __init__(self, tracer: Tracer) -> None:
        self.tracer = tracer
        formulation, vector = tracer.formulation, tracer.layout.vector
        self.unknowns, self.conditions = tracer.unknowns, formulation.conditions
        names = {name: vector(name, len(value)) for name, value in formulation.design.items()}
        ends = [*accumulate(map(len, names.values()), initial=0)]
        self.names = {name: slice(*ends) for name, ends in zip(names, pairwise(ends), strict=True)}
        self.sampled = [
            tracer.layout.scalar(TIME),
            *(k for name in tracer.request.drivers for k in vector(f"drive {name}", 5)),
        ]
        outputs, self._executors = tracer.outputs_of_rates(), dict[int, Executor]()
        self._plan, self._bind = self.ready(outputs)
        self.sizes[outputs.name] = outputs.size
        self._vectors = {name: _run(slots) for name, slots in tracer.layout.vectors.items()}
        self._state, self._after = (
            _run([slot for name in names for slot in vector(f"{label}{name}", 1)])
            for label in ("", self.after)
        )

    def ready(self, outputs: Program) -> tuple[Plan, Bind]:
        """Return the plan of all programs, the last one given, ready to be bound; set `rows`,
        `columns`, `sizes` and `geometry`.
        """
        programs = self._trace_programs()
        self.sizes = {each.name: each.size for each in programs}
        plan = Plan({each.name: each for each in (*programs, outputs)}, self.tracer.layout.slots)
        return plan, partial(NumpyExecutor, plan)

    def _trace_programs(self) -> list[Program]:
        """Return the programs of all rows, of gamma and of a step."""
        tracer, vector = self.tracer, self.tracer.layout.vector
        formulation, at = tracer.formulation, tracer.at
        every, phi, nu = formulation.rows(at), formulation.phi(at), formulation.nu(at)
        self.rows, self.columns = (
            np.array([(i, j) for i, row in enumerate(every) for j in row], np.intp).reshape(-1, 2).T
        )
        gamma = formulation.gamma(at, [tracer.tape.input(k) for k in vector(RATE, self.unknowns)])
        after = formulation.retract(
            at, [tracer.tape.input(k) for k in vector("step", self.unknowns)]
        )
        wanted: dict[str, dict[str, list[Scalar]]] = {
            "rows": {"phi": phi, "nu": nu, "entries": [x for row in every for x in row.values()]},
            "gamma": {"gamma": gamma},
            "retract": {name: [*after[name]] for name in self.names},
        }
        return [
            program(
                name,
                tracer.tape,
                {
                    slot: x
                    for label, values in each.items()
                    for slot, x in zip(vector(label, len(values)), values, strict=True)
                },
            )
            for name, each in wanted.items()
        ]

    @property
    def owners(self) -> list[str]:
        """Joint or driver of every kept row."""
        return [self.tracer.formulation.owners[k][0] for k in self.tracer.selection.chosen]

    @property
    def driven(self) -> NDArray[np.bool_]:
        """Which kept rows are drivers', shape (n,)."""
        joints = len(self.tracer.formulation.owners) - len(self.tracer.mechanism.drivers)
        return np.array(self.tracer.selection.chosen) >= joints

    @property
    def design(self) -> Array:
        """The state at the design position, shape (numbers, 1)."""
        return np.concatenate([*self.tracer.formulation.design.values()])[:, None]

    def samples(self, path: Path, times: Array) -> Array:
        """Return samples at times of a path, shape (sampled, n); see `Model.samples`."""
        tracer = self.tracer
        return samples(tracer.mechanism, tracer.request.drivers, tracer.frame.unit, path, times)

    def state(self, lanes: Array, ahead: str = FROM) -> Array:
        """Return the states of lanes of the model, by default those they are predicted from, shape
        (numbers, lanes).
        """
        return np.concatenate([lanes[self._vectors[f"{ahead}{name}"]] for name in self.names])

    def evaluate(self, state: Array, sample: Array) -> tuple[Array, Array, Array]:
        """Return phi, nu and the entries of the Jacobian of all rows, shape (numbers, m) each.

        Args:
            state, sample: shape (numbers, m) and (sampled, m).
        """
        executor = self._at(state, sample)
        executor.run("rows")
        phi, nu, entries = (executor.get(self._vectors[k]) for k in ("phi", "nu", "entries"))
        return phi, nu, entries

    def jacobian(self, entries: Array) -> Array:
        """Return the Jacobian of all rows by its entries, shape (m, rows, n)."""
        matrix = np.zeros((entries.shape[1], len(self.tracer.formulation.owners), self.unknowns))
        matrix[:, self.rows, self.columns] = entries.T
        return matrix

    def equations(self, state: Array, sample: Array) -> Equations:
        """Return the kept rows at states and samples, see `evaluate`."""
        phi, nu, entries = self.evaluate(state, sample)
        selection, matrix = self.tracer.selection, self.jacobian(entries)
        chosen, dropped = [*selection.chosen], [*selection.dropped]
        return Equations(
            phi[chosen].T, matrix[:, chosen], nu[chosen].T, matrix[:, dropped], phi[dropped].T
        )

    def gamma(self, state: Array, sample: Array, rate: Array) -> Array:
        """Return the right-hand sides of the acceleration equations of all rows at rates of the
        unknowns, shape (unknowns, m); shape (rows, m).
        """
        executor = self._at(state, sample)
        executor.put(self._vectors[RATE], rate)
        executor.run("gamma")
        return executor.get(self._vectors["gamma"])

    def stepped(self, state: Array, step: Array) -> Array:
        """Return states after steps of the unknowns, shape (unknowns, m)."""
        executor = self._executor(state.shape[1])
        executor.put(self._state, state)
        executor.put(self._vectors["step"], step)
        executor.run("retract")
        return executor.get(self._after)

    def outputs(self, state: Array, sample: Array, rate: Array, rate_t: Array) -> dict[str, Array]:
        """Return the wanted motions by name, shape (components, m) each, and the test "branch", by
        rates and accelerations of the unknowns, shape (unknowns, m).
        """
        executor = self._at(state, sample)
        executor.put(self._vectors[RATE], rate)
        executor.put(self._vectors[RATE_T], rate_t)
        executor.run("outputs")
        request = self.tracer.request
        names = [
            *kept_motions(request, ()),
            *(kept_forces(self._vectors) if request.forces else ()),
        ]
        found = {name: executor.get(self._vectors[name]) for name in names}
        return found | {"branch": executor.get([self._plan.slots["branch"]])}

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
        return self.tracer.formulation.twists(self._configuration(state), rate.tolist())

    def _configuration(self, state: Array) -> Configuration:
        named = {name: state[at].tolist() for name, at in self.names.items()}
        return self.tracer.formulation.configuration(named)

    def _executor(self, lanes: int) -> Executor:
        if lanes not in self._executors:  # kept: binding costs more than running
            executor = self._executors[lanes] = self._bind(lanes)
            if len(self.geometry):
                executor.put(self._vectors[GEOMETRY], self.geometry)
        return self._executors[lanes]

    def _at(self, state: Array, sample: Array) -> Executor:
        executor = self._executor(state.shape[1])
        executor.put(self._state, state)
        executor.put(self.sampled, sample)
        return executor


def _run(slots: Sequence[int]) -> Sequence[int]:
    """Return slots one after the other as a range: executors copy those at once."""
    run = range(slots[0], slots[0] + len(slots)) if slots else range(0)
    return run if [*run] == [*slots] else slots
