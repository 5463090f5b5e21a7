"""Outputs as traced operations, beside the motion of the points that they read, and their slopes by
the geometry.

An output is an `Equation`: plain vector algebra over jets, whose numbers are any scalars. Slopes
are exact. With Phi the solved rows, q the unknowns and g the geometry, a motion dg of the geometry
at held drivers moves the pose, its rates v and accelerations a by

    Phi_q dq = -Phi_g dg
    Phi_q dv = -d(Phi_q v - nu)       the derivative by pose and geometry, v held
    Phi_q da = -d(Phi_q a - gamma)    likewise, by v too

with one factorisation for all, and outputs by the chain rule over their own operations. So the
multipliers l of the rows and the demand d of the bodies:

    Phi_q^T dl = -d(Phi_q^T l - d)    likewise, l held
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ...algebra import Scalar, Vec3
from ...jet import Jet
from ...primitives.base import Drive
from ...program import Program, Traced, changes, program
from ...trajectory import QUANTITIES
from ..formulation.cartesian import Cartesian
from ..formulation.formulation import Rows, motion_of_point
from .request import (
    CARRIED,
    EFFORT,
    ELEMENT,
    OUTPUT,
    RATE,
    RATE_T,
    REACTION,
    RESTING,
    SLOPE_OF,
    TOWARDS,
    WantedOutput,
)

if TYPE_CHECKING:
    from .programs import Moving, Tracer


class TracedOutputs:
    """The wanted outputs of a tracer.

    Attributes:
        resting: by output that has no value at rest, the vector of its two speeds.
    """

    def __init__(self, tracer: Tracer) -> None:
        self._tracer = tracer
        self._wanted: Sequence[WantedOutput] = tracer.request.outputs
        self.resting: dict[str, str] = {}

    def store(self, out: dict[int, Scalar], v: Sequence[Scalar], a: Sequence[Scalar]) -> None:
        """Add all outputs at rates of the unknowns, the rates by drivers that move alone, and the
        speeds below which an output has no value.
        """
        tracer, speeds = self._tracer, dict[tuple[int, ...], str]()
        for alone in _groups(self._wanted):
            rates = (v, a)
            if alone:
                rates = self._solve_alone(alone)
                if tracer.request.slopes:
                    self._store_rates(out, alone, rates)
            for each, terms, resting in self._evaluate(self._wanted, alone, *rates):
                name = each.equation.name
                for label, order in zip(QUANTITIES[: each.derivative + 1], "xva", strict=False):
                    values = [getattr(term, order) for term in terms]
                    tracer.store(out, f"{OUTPUT}{label} {name}", values)
                if resting is not None:
                    numbers = tuple(map(tracer.tape.number, resting))
                    self.resting[name] = speeds.setdefault(numbers, f"{RESTING}{len(speeds)}")
                    tracer.store(out, self.resting[name], resting)

    def slopes(self) -> Program:
        """Return the program of the slopes of all outputs by one motion of the geometry, after the
        program `outputs` has left the rates of the unknowns in the lanes.
        """
        tracer, out = self._tracer, dict[int, Scalar]()
        formulation = tracer.formulation
        moved: dict[Traced, dict[int, Scalar]] = {}

        def follow(values: Sequence[Scalar]) -> list[Scalar]:
            found = changes(tracer.tape, values, moved, smooth=True)
            return [gradient.get(0, 0.0) for gradient in found]

        def add(inputs: Sequence[Scalar], derivatives: Sequence[Scalar]) -> None:
            moved.update(zip(inputs, ({0: x} for x in derivatives), strict=True))

        def solve(residuals: Sequence[Scalar]) -> list[Scalar]:
            return [-x for x in tracer.factor.solve(follow(tracer.chosen(residuals)))]

        for place, numbers in tracer.geometry.items():
            count = len(numbers)
            add(tracer.vector(place, count), tracer.vector(TOWARDS + place, count))
        carried = formulation.flow(tracer.at, solve(formulation.phi(tracer.at)))
        for name, derivatives in carried.items():
            add(tracer.vector(name, len(derivatives)), list(derivatives))
        rows = formulation.rows(tracer.at)
        wanted, forces = [each for each in self._wanted if each.slopes], tracer.request.forces
        carried_too: list[tuple[str, ...]] = [()] if forces and forces.slopes else []
        for alone in dict.fromkeys([*_groups(wanted), *carried_too]):
            own = self._formulation(alone) if alone else formulation
            v, a = self._read_rates(alone)
            if alone or tracer.request.order > 0:
                add(v, solve(_residuals(rows, v, own.nu(tracer.at))))
            if alone or tracer.request.order > 1:
                add(a, solve(_residuals(rows, a, own.gamma(tracer.at, v))))
            for each, terms, _ in self._evaluate(wanted, alone, v, a):
                for label, order in zip(QUANTITIES[: each.slopes], "xva", strict=False):
                    values = follow([getattr(term, order) for term in terms])
                    tracer.store(out, f"{SLOPE_OF}{OUTPUT}{label} {each.equation.name}", values)
        if forces and forces.slopes:
            v, a = self._read_rates(())
            count = len(tracer.layout.vectors[CARRIED])
            carrying = tracer.forces(v, a, tracer.vector(CARRIED, count))
            add(carrying.multipliers, carrying.moved(follow))
            for name, values in carrying.vectors(forces):
                if name.startswith((REACTION, EFFORT, ELEMENT)):
                    # without what redundant rows leave free
                    tracer.store(out, f"{SLOPE_OF}{name}", follow(values[:6]))
        return program("slopes", tracer.tape, out, tracer.prepared)

    def _evaluate(
        self,
        wanted: Sequence[WantedOutput],
        alone: tuple[str, ...],
        v: Sequence[Scalar],
        a: Sequence[Scalar],
    ) -> Iterator[tuple[WantedOutput, Sequence[Jet], tuple[Scalar, Scalar] | None]]:
        """Yield the outputs of a group, with their terms and the speeds at which they rest."""
        tracer, moving = self._tracer, self._tracer.moving(v, a)

        @cache
        def at(name: str) -> Vec3:
            return _jets(tracer, name, moving)

        @cache
        def design(name: str) -> Vec3:
            position = tracer.mechanism.point(name).position
            x, y, z = (Jet(_number(each), _number(0.0), _number(0.0)) for each in position)
            return Vec3(x, y, z)

        with np.errstate(all="ignore"):  # of points that stand still
            for each in wanted:
                if each.alone == alone:
                    equation = each.equation
                    now = {name: at(name) for name in equation.points}
                    then = {name: design(name) for name in equation.points}
                    yield each, equation.terms(now, then), equation.resting(now)

    def _formulation(self, alone: tuple[str, ...]) -> Cartesian:
        """Return the equations with these drivers at a rate of one, and all others at rest."""
        tracer = self._tracer
        drives = {name: replace(each, c_t=0.0, c_tt=0.0) for name, each in tracer.drives.items()}
        for name in alone:
            rate = 1.0 if tracer.mechanism.driver(name).turns else 1.0 / tracer.frame.unit
            drives[name] = replace(drives.get(name, Drive()), c_t=rate)
        return tracer.formulate(tracer.mechanism, tracer.frame, drives)

    def _solve_alone(self, alone: tuple[str, ...]) -> tuple[list[Scalar], list[Scalar]]:
        tracer, own = self._tracer, self._formulation(alone)
        v = tracer.factor.solve(tracer.chosen(own.nu(tracer.at)))
        return v, tracer.factor.solve(tracer.chosen(own.gamma(tracer.at, v)))

    def _names_of_rates(self, alone: tuple[str, ...]) -> tuple[str, str]:
        by = "".join(f" {name}" for name in alone)
        return f"{RATE}{by}", f"{RATE_T}{by}"

    def _store_rates(
        self, out: dict[int, Scalar], alone: tuple[str, ...], rates: tuple[list[Scalar], ...]
    ) -> None:
        for name, values in zip(self._names_of_rates(alone), rates, strict=True):
            self._tracer.store(out, name, values)

    def _read_rates(self, alone: tuple[str, ...]) -> Sequence[list[Scalar]]:
        tracer = self._tracer
        return [tracer.vector(name, tracer.unknowns) for name in self._names_of_rates(alone)]


def _groups(wanted: Sequence[WantedOutput]) -> list[tuple[str, ...]]:
    """Return the drivers that move alone for some outputs, each set once; none for outputs of the
    motion itself.
    """
    return [*dict.fromkeys(each.alone for each in wanted)]


def _residuals(rows: Rows, x: Sequence[Scalar], right: Sequence[Scalar]) -> list[Scalar]:
    """Return the residuals of linear equations."""
    return [
        sum((entry * x[k] for k, entry in row.items()), 0.0) - value
        for row, value in zip(rows, right, strict=True)
    ]


def _jets(tracer: Tracer, name: str, moving: Moving) -> Vec3:
    """Return the position of a point as jets [m]."""
    point = tracer.mechanism.point(name)
    position, arm = tracer.frame.end(point.body, point.position)
    found = motion_of_point(position, arm, tracer.frame.unit, *moving(point.body))
    x, y, z = (Jet(*each) for each in zip(*found, strict=True))
    return Vec3(x, y, z)


def _number(x: Scalar) -> Scalar:
    """Return a scalar by which division is defined, as lanes do it."""
    return x if isinstance(x, Traced) else np.float64(x)
