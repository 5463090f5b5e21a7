"""Simbody in simulate mode: Simbody's assembler, through OpenSim's `AssemblySolver`.

At every sample the assembler starts from the pose of the previous sample. It minimizes the weighted
squares of the constraint violations and of the driven coordinates' distances from their values;
with as many drivers as degrees of freedom both become zero. It has no velocities.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.errors import SolveError
from ...core.trajectory import Array
from ..simulate.simulation import (
    Leg,
    SimulatedPose,
    Simulation,
    SimulationEndedError,
    start_of,
    with_joints_alone,
)
from .simbody import Simbody, SimbodyModel, opensim

# Weight of constraints; a driven coordinate has weight 1. With OpenSim's default, an infinite
# weight, the optimizer refuses mechanisms with redundant rows.
WEIGHT = 1e3


@dataclass(frozen=True)
class Assembly(Simulation):
    """Simbody's assembler, pose after pose.

    Attributes:
        accuracy: accuracy of the assembler.
    """

    accuracy: float = 1e-12
    name = "simbody"
    projection = Simbody
    loop = "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Solver, accuracy and weights."""
        return {
            "solver": "AssemblySolver, from the pose of the sample before",
            "accuracy": self.accuracy,
            "weights": f"constraints {WEIGHT:g}, driven coordinates 1",
            "rods": "bodies between a cross and a ball",
        }

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint or driver that is not supported here, or None."""
        for coupler in case.mechanism.couplers:
            if coupler.curve or len(coupler.joints) > 2:
                return (
                    f"{coupler}: this adapter gives OpenSim's assembler relations of two"
                    " coordinates by a factor alone"
                )
        return Simbody().unsupported(case)

    def efforts(self) -> Mapping[str, Assembly]:
        """Return the efforts by the accuracy."""
        return {f"accuracy {x:g}": replace(self, accuracy=x) for x in (1e-3, 1e-6, 1e-9, 1e-12)}

    def build(self, case: Case) -> _Assembled:
        """Return OpenSim's model and its start."""
        case = replace(case, mechanism=with_joints_alone(case.mechanism))
        return _Assembled(opensim(), case, self.accuracy)


class _Assembled(SimbodyModel):
    """The constrained tree with driven coordinates."""

    def __init__(self, o: Any, case: Case, accuracy: float) -> None:
        super().__init__(o, case)
        self.accuracy, self.start = accuracy, start_of(self, case)
        if len(self.conditions) > len(self.driven) + (self.state.getNQErr() > 0):
            raise SolveError(
                f"case {case.name!r}: a joint closes a loop of one body with itself, which"
                " Simbody's assembler does not support; use the projection mode"
            )
        self.held = [(self.moves[at - 1].get_coordinates(0), sign) for at, sign in self.driven]

    def run(self, leg: Leg) -> Iterator[SimulatedPose]:
        """Yield the poses of a leg."""
        self.restore(self.start.configuration)
        self.place()
        for values in leg.drive(leg.times)[0].T:
            yield self.assemble(values)

    def assemble(self, values: Array) -> SimulatedPose:
        """Return the pose at values of the drivers."""
        o, state = self.o, self.state
        references = o.SimTKArrayCoordinateReference()
        for (coordinate, sign), value in zip(self.held, values.tolist(), strict=True):
            reference = o.CoordinateReference(coordinate.getName(), o.Constant(sign * value))
            reference.setWeight(1.0)
            references.push_back(reference)
            coordinate.setValue(state, sign * value, False)
        solver = o.AssemblySolver(self.model, references)
        solver.setAccuracy(self.accuracy)
        solver.setConstraintWeight(WEIGHT)
        try:
            solver.assemble(state)
        except RuntimeError as error:
            first = str(error).strip().splitlines()[0]
            raise SimulationEndedError(f"Simbody's assembler fails: {first}") from error
        self.model.realizePosition(state)
        gaps = [
            coordinate.getValue(state) - sign * value
            for (coordinate, sign), value in zip(self.held, values.tolist(), strict=True)
        ]
        points = np.full((3, len(self.wanted), 3), np.nan)
        for k, frame in enumerate(self.wanted):
            points[0, k] = frame.position if frame.handle is None else self.position(frame.handle)
        violated = np.abs([*state.getQErr().to_numpy(), *gaps]).max(initial=0.0)
        return SimulatedPose(points, float(violated), 1)
