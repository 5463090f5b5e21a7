"""Interface of model writers, and the path from the design position to the start of a model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np

from ... import joints
from ...case.case import Case
from ...case.measures import JointAngle, JointDisplacement
from ...errors import SolveError
from ...kinematics import NativeSolver, start_of
from ...mechanism.mechanism import Mechanism, with_equivalents
from ...trajectory import Array, BodyMotion

# Largest constraint residual of a start, relative to the mechanism's size: a thousand times the
# round-off of its coordinates.
TOL = 1e-12

# Samples of the way. More samples follow if a body turns so far between two samples that the turns
# of joints cannot be counted.
SAMPLES = (33, 513, 8193)
LARGEST_TURN = math.pi / 3.0


Zeros: TypeAlias = Mapping[tuple[str, str], float]
"""Coordinates by joint and freedom [m or rad]."""
NO_ZEROS: Zeros = {}
Ranges: TypeAlias = Mapping[tuple[str, str], tuple[float, float]]
"""Limits by joint and freedom, from the same zeros [m or rad]."""
NO_RANGES: Ranges = {}


class Writer(Protocol):
    """Writes a mechanism in a simulator's own format."""

    def __call__(
        self,
        mechanism: Mechanism,
        way: Mapping[str, BodyMotion],
        start: Mapping[str, float],
        zeros: Zeros = NO_ZEROS,
        ranges: Ranges = NO_RANGES,
    ) -> Mapping[str, str]:
        """Return the texts of the files, by their endings.

        Args:
            way: poses of the moving bodies from the design position to the start of the model;
                between two samples no body turns by more than 60 degrees, so no joint turns by
                half a turn.
            start: values of the drivers at the end of the way, as information [m or rad].
            zeros: coordinates at design where they are not zero.
            ranges: limits of coordinates, counted from the zeros.

        Raises:
            KincheckError: the format cannot express a part; the message names the part.
        """
        ...


def written(case: Case, write: Writer, at: float | None = None) -> Mapping[str, str]:
    """Return a case's mechanism in a writer's format, starting at a value of its sweep, or at the
    design position.

    Args:
        at: value of the swept driver, or time, in the unit of the sweep [m, rad or s].

    Raises:
        KincheckError: the start cannot be reached, or the format cannot express a part.
    """
    # all writers know the built-in types
    built_in = {getattr(joints, name) for name in joints.__all__}
    case = replace(case, mechanism=with_equivalents(case.mechanism, built_in))
    stop = case.sweep.design if at is None else at
    start = replace(case.sweep, values=np.array([stop])).moved
    held = {driver.name: 0.0 for driver in case.mechanism.drivers}
    return write(
        case.mechanism,
        way_to(case, stop),
        held | {name: float(values[0]) for name, values in start.items()},
        {
            (output.joint, output.freedom): output.at_design
            for output in case.outputs
            if isinstance(output, JointAngle | JointDisplacement) and output.at_design
        },
        case.ranges,
    )


def way_to(case: Case, stop: float) -> Mapping[str, BodyMotion]:
    """Return the poses of the moving bodies from the design position to a value of the sweep; see
    `Writer`.

    Raises:
        SolveError: the value cannot be reached.
    """
    if not math.isfinite(stop):
        raise SolveError(
            f"case {case.name!r}: the start {stop} is not finite; give a value of"
            f" {case.sweep.driver!r}"
        )
    moving = case.mechanism.moving
    if not case.mechanism.drivers and stop == case.sweep.design:  # of a free motion
        return {
            body.name: BodyMotion(
                np.array([body.origin]), np.array([body.euler_parameters]), None, None
            )
            for body in moving
        }
    bodies, path = tuple(body.name for body in moving), case.sweep.path
    solver, begin = NativeSolver(order=0), start_of(case.mechanism, path)
    first = case.sweep.design + case.sweep.pace * begin.time
    for samples in (1,) if stop == first and begin.lead is None else SAMPLES:
        # the end at `stop` is exact, also for a single sample
        values: Array = np.linspace(stop, first, samples)[::-1]
        ways = [replace(case.sweep, values=values).path]
        if begin.lead:
            ways.insert(0, replace(begin.lead, times=np.linspace(0.0, 1.0, samples)))
        found = [solver.prepare(case.mechanism, way, bodies=bodies)(TOL) for way in ways]
        if not all(each.solved.all() for each in found):
            why = "; ".join(filter(None, [each.message for each in found]))
            raise SolveError(
                f"case {case.name!r}: there is no way from the design to {case.sweep.driver} ="
                f" {stop:.9g}: {why}"
            )
        whole = {name: _join_motions([each.bodies[name] for each in found]) for name in bodies}
        if max(map(_turn, whole.values())) <= LARGEST_TURN:
            return whole
    raise SolveError(
        f"case {case.name!r}: on the way to {case.sweep.driver} = {stop:.9g} a body turns by more"
        f" than 60 degrees between two of {SAMPLES[-1]} samples; give a start closer to the design"
    )


def _join_motions(parts: Sequence[BodyMotion]) -> BodyMotion:
    """Return motions one after the other."""
    return BodyMotion(
        np.concatenate([each.r for each in parts]),
        np.concatenate([each.p for each in parts]),
        None,
        None,
    )


def _turn(motion: BodyMotion) -> float:
    """Return the largest turn of a body between two samples [rad]."""
    cosines = np.abs((motion.p[:-1] * motion.p[1:]).sum(axis=1))
    return 2.0 * math.acos(min(1.0, float(cosines.min(initial=1.0))))
