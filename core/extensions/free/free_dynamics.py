"""Free motion of a mechanism: no driver acts, and loads and the start alone move it.

`free_equations` has the equations. DOP853 integrates them (Hairer, Norsett, Wanner: Solving
Ordinary Differential Equations I, II.5), or Radau where loads are stiff. Poses and velocities are
projected onto the rows at every sample and between. All steps are then halved twice: the last run
is the result, and its difference from the one before is its error.

It makes truth for time steppers, for smooth loads: no contact, no friction, no events.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SolveError
from ...forces import Forces
from ...kinematics.forces.reactions import forces_of
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array, Trajectory
from .free_equations import VANISHING, FreeEquations, start_velocities

# The error of a step: of what the step adds, and of the largest number. The first is the smallest
# that scipy takes; the second is near round-off, because errors of many steps add up.
RTOL, ATOL = 2.3e-14, 1e-15
# Radau solves its stages by iteration, which ends at round-off. Steps are controlled above it.
LOOSER = 100.0
# A minimum between steps is looked for where the value at a step is below this part of the largest.
NEAR = 0.1
# DOP853 is stable for steps up to 6 over the fastest rate. Accuracy asks for a twentieth of that
# where this rate shows in the motion; longer steps say that it has died out, and limits them only
# by stability. Looked at once in so many steps.
STABLE, OFTEN = 3.0, 250
# After so many steps what they add is taken into the large part of the state.
PART = 5


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """A free motion at given times, n samples, and at all steps between them.

    Attributes:
        times: of the samples [s], shape (n,).
        steps: of all states, the samples among them [s], shape (m,).
        samples: indices of the samples among the steps, shape (n,).
        motion: of the points and moving bodies over the steps.
        forces: returns the forces of named joints and force elements over the steps.
        error: largest change of a point of a joint or of a named point when all steps are halved
            [m].
        turning_error: largest such change of a body's Euler parameters, doubled [rad].
        energy: kinetic and potential energy, less the work of loads that have none [J], shape (n,).
            The work of all loads is integrated, so this is the kinetic energy less that work.
        gap: largest residual of the rows at the samples, relative to the mechanism's size.
        freedoms: number of degrees of freedom.
        redundant: number of redundant rows.
        evaluations: of the equations.
        method: of the integration.
        message: empty, or why it ends early.
    """

    times: Array
    steps: Array
    samples: NDArray[np.intp]
    motion: Trajectory
    forces: Callable[[Collection[str]], Forces]
    error: float
    turning_error: float
    energy: Array
    gap: float
    freedoms: int
    redundant: int
    evaluations: int
    method: str
    message: str = ""

    @property
    def energy_error(self) -> float:
        """Largest change of the energy since the start [J]."""
        return float(np.abs(self.energy - self.energy[0]).max())


def free_motion(
    mechanism: Mechanism, times: Array, rates: Mapping[str, float] | None = None
) -> FreeMotion:
    """Return the free motion of a mechanism from its design position.

    A rate of a driver or joint that is not named is zero where the named ones leave it free. What
    is then still open starts as an impulse at the named coordinates moves it.

    Args:
        mechanism: mechanism with masses; its drivers are left out.
        times: of the samples [s], from zero, increasing, shape (n,).
        rates: at the start, by driver, joint with one freedom, or JOINT.rotation and
            JOINT.translation [m/s or rad/s]; at rest without.

    Raises:
        SolveError: nothing has mass or nothing can move, the rates contradict each other, the start
            is open or singular, or a load acts on a freedom without inertia.
    """
    equations = FreeEquations(mechanism)
    start = equations.start(start_velocities(mechanism, equations, rates or {}))
    free = _Run(equations, times, start, {})
    reached = times[: len(free.samples)]
    first = _Run(equations, reached, start, free.counts, stiff=free.stiff)
    second = _Run(equations, reached, start, first.counts, stiff=free.stiff)
    count = len(second.samples)
    both = [np.array(run.states)[run.samples[:count]] for run in (first, second)]
    places, turns = equations.differences(*both)
    found = np.array(second.states)
    sampled, steps = found[second.samples], np.array(second.times)
    motion, freedoms = equations.trajectory(found), equations.unknowns - equations.rank

    def forces(names: Collection[str]) -> Forces:
        path = Path({}, steps)
        return forces_of(equations.mechanism, path, motion, names, freedoms=freedoms)

    return FreeMotion(
        times[:count],
        steps,
        np.array(second.samples),
        motion,
        forces,
        places,
        turns,
        np.array([equations.energy(each) for each in sampled]),
        max(equations.gap(each) for each in sampled),
        freedoms,
        equations.count - equations.rank,
        equations.evaluations,
        "Radau" if second.stiff else "DOP853",
        second.message or first.message or free.message,
    )


class _ChangePointError(SolveError):
    """The motion is at a singular pose."""


class _Run:
    """One integration over the samples, with all its steps.

    Args:
        counts: steps of an earlier run by interval; the steps of this run are half as long.
    """

    def __init__(
        self,
        equations: FreeEquations,
        times: Array,
        start: Array,
        counts: Mapping[int, int],
        *,
        stiff: bool = False,
    ) -> None:
        self._equations = equations
        self.times, self.states, self.samples = [float(times[0])], [start], [0]
        self.counts, self.message, self.stiff = dict[int, int](), "", stiff
        # States are sums of two doubles, and a step adds to a small part: rounding the large one at
        # each step would lose some ten digits of units in the last place.
        self._low = np.zeros_like(start)
        self._step, self._span = np.inf, float(times[-1] - times[0])
        self._regular = [equations.regular(start)]
        self._largest = self._regular[0]
        self._pieces = list[Any]()
        if self._regular[0] < VANISHING:
            raise SolveError(self._words(0.0))
        for k, (begin, end) in enumerate(pairwise(times.tolist())):
            most = (end - begin) / (2 * counts[k]) if k in counts else np.inf
            try:
                self.counts[k] = self._advance(begin, end, most)
            except _ChangePointError as error:
                self.message = str(error)
                del self.times[self.samples[-1] + 1 :], self.states[self.samples[-1] + 1 :]
                return
            self.samples.append(len(self.times) - 1)

    def _add(self, change: Array) -> None:
        """Add to the last state."""
        last, small = self.states[-1], self._low + change
        total = last + small
        self.states[-1], self._low = total, small - (total - last)

    def _advance(self, begin: float, end: float, most: float) -> int:
        """Integrate between two samples; return the number of steps."""
        count, longest = 0, 0.0
        while begin < end:
            solver, high, low = self._solver(begin, end, most), self.states[-1], self._low
            first = len(self.times)
            while solver.status == "running" and (self.stiff or len(self.times) < first + PART):
                if problem := solver.step():
                    raise SolveError(
                        f"mechanism {self._equations.mechanism.name!r}: the integration ends at"
                        f" {solver.t:.9g} s ({problem}); its loads may be too stiff or not smooth"
                    )
                count += 1
                self.times.append(float(solver.t))
                self.states.append(high)
                self._low = low
                self._add(solver.y)
                self._find_change_point(high, solver.dense_output())
                longest = max(longest, solver.t - solver.t_old)
                if most == np.inf and not self.stiff and len(self.times) % OFTEN == 0:
                    self.stiff = longest * self._equations.fastest(self.states[-1]) > STABLE
                    longest = 0.0
                    if self.stiff:
                        break
            begin, self._step = float(solver.t), float(solver.h_abs)
            self._add(self._equations.projection(self.states[-1]))
        return count

    def _solver(self, begin: float, end: float, most: float) -> Any:
        methods: Any = importlib.import_module("scipy.integrate")
        high, low = self.states[-1], self._low

        def rate(t: float, change: Array) -> Array:
            return self._equations.rate(t, high + (low + change))

        looser = LOOSER if self.stiff else 1.0
        step = most if most < np.inf else self._step
        first = {"first_step": min(step, end - begin)} if step < np.inf else {}
        return (methods.Radau if self.stiff else methods.DOP853)(
            rate,
            begin,
            np.zeros_like(high),
            end,
            rtol=looser * RTOL,
            atol=looser * self._error_allowed(high),
            max_step=min(most, end - begin),
            **first,
        )

    def _error_allowed(self, high: Array) -> Array:
        """Return the error allowed in a step: of the largest number of poses, rates and work, and
        at least of a motion of the mechanism's size in the whole time.
        """
        poses, inertia = len(self._equations.design), self._equations.scale.min() ** -2
        least = (1.0, 1.0 / self._span, inertia / self._span**2)
        allowed = np.empty_like(high)
        for first, last, low in zip((0, poses, -1), (poses, -1, None), least, strict=True):
            part = slice(first, last)
            allowed[part] = ATOL * max(float(np.abs(high[part]).max()), low)
        return allowed

    def _find_change_point(self, high: Array, change: Any) -> None:
        """Raise if a change point is in the last step or in the one before."""
        equations = self._equations
        self._regular.append(equations.regular(self.states[-1]))
        self._pieces = [*self._pieces[-1:], (high, change)]
        self._largest = max(self._largest, self._regular[-1])
        last = self._regular[-3:]
        if last[-1] < VANISHING:
            (before, after), slope = self.times[-2:], last[-1] - last[-2]
            ahead = last[-1] * (after - before) / -slope if slope < 0.0 else 0.0
            raise _ChangePointError(self._words(after + ahead))
        if len(last) < 3 or not last[1] <= min(last[0], last[2]):
            return
        if last[1] > NEAR * self._largest:
            return
        optimize: Any = importlib.import_module("scipy.optimize")
        for base, piece in self._pieces:

            def regular(t: float, base: Array = base, piece: Any = piece) -> float:
                return equations.regular(base + piece(t))

            span = piece.t_min, piece.t_max
            options = {"xatol": 1e-10 * (span[1] - span[0])}
            found = optimize.minimize_scalar(
                regular, bounds=span, method="bounded", options=options
            )
            if found.fun < VANISHING:
                raise _ChangePointError(self._words(float(found.x)))

    def _words(self, time: float) -> str:
        return (
            f"mechanism {self._equations.mechanism.name!r} is at a change point at {time:.9g} s:"
            " its joints allow several motions from there, and no law of rigid bodies chooses;"
            " the free motion ends before"
        )
