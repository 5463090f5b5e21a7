"""Reduction of a bad case that keeps its outcome: fewer samples, points, bodies and digits."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, cast

import numpy as np

from ...case.case import Case, Output
from ...errors import KincheckError
from ...joints import Joint, Kind
from ...kinematics import require_driven
from ...mechanism.mechanism import Mechanism

Bad = Callable[[Case], bool]
"""Function that returns whether a case still has the outcome; False if it cannot be judged."""

# Largest number of candidates: each takes 0.1 s to a few seconds, all take about a minute.
TRIES = 150


class _Budget:
    def __init__(self, bad: Bad) -> None:
        self.bad, self.left = bad, TRIES

    def __call__(self, case: Case) -> bool:
        if self.left <= 0:
            return False
        self.left -= 1
        try:
            return self.bad(case)
        except (KincheckError, ArithmeticError, ValueError):
            return False


def fewer_samples(case: Case, sample: int, bad: Bad) -> Case:
    """Return the case with the fewest samples that keep the outcome, from the design to the bad
    sample or over the whole sweep.
    """
    still, values = _Budget(bad), case.sweep.values
    stop = float(values[sample])
    ends = [(case.sweep.design, stop), (float(values[0]), float(values[-1]))]
    for start, end in (
        ends if case.sweep.driver in {d.name for d in case.mechanism.drivers} else ends[1:]
    ):
        if start == end:
            continue
        for count in (1, 2, 3, 4, 6, 9, 13, 19, 28, 41, 61):
            if count < len(values):
                fewer = replace(
                    case,
                    sweep=replace(
                        case.sweep, values=np.linspace(start if count > 1 else end, end, count)
                    ),
                )
                if still(fewer):
                    return fewer
    return case


def reduced(case: Case, bad: Bad) -> tuple[Case, list[str]]:
    """Return the smallest case found with the outcome, and the reductions as text."""
    still, words = _Budget(bad), list[str]()
    before = len(case.mechanism.bodies), len(case.mechanism.joints)
    going = True
    while going:
        going = False
        for smaller in _smaller(case):
            if still(smaller):
                case, going = smaller, True
                break
    if (after := (len(case.mechanism.bodies), len(case.mechanism.joints))) != before:
        words.append(f"bodies {before[0]} to {after[0]}, joints {before[1]} to {after[1]}")
    for digits in range(1, 12):
        rounder = rounded(case, digits)
        if rounder is not None and still(rounder):
            return rounder, [*words, f"numbers to {digits} digits"]
    return case, words


def _smaller(case: Case) -> Iterator[Case]:
    """Yield cases with one force element, point or body less and as many freedoms as drivers; the
    largest steps first.
    """
    mechanism = case.mechanism
    for force in mechanism.forces:
        others = [each for each in mechanism.forces if each is not force]
        yield _with(case, replace(mechanism, forces=others), set())
    if len(mechanism.points) > 1:
        driven = {getattr(driver, "point", "") for driver in mechanism.drivers}
        for point in mechanism.points:
            if point.name not in driven:
                yield _with(case, mechanism, {point.name})
    for body in mechanism.moving:
        yield from _driven(case, _without(mechanism, body.name, ()))
    for body, joint in product(mechanism.moving, mechanism.joints):
        yield from _driven(case, _without(mechanism, body.name, (joint.name,)))
    for body in mechanism.moving:
        fixed = [replace(each, fixed=each.fixed or each is body) for each in mechanism.bodies]
        held = [
            j
            for j in mechanism.joints
            if not all(mechanism.is_fixed(b) or b == body.name for b in j.bodies)
        ]
        for gone in ["", *(joint.name for joint in held)]:
            yield from _driven(
                case, _parts(mechanism, fixed, [joint for joint in held if joint.name != gone])
            )


def _without(mechanism: Mechanism, body: str, joints: Sequence[str]) -> Mechanism | None:
    bodies = [each for each in mechanism.bodies if each.name != body]
    return _parts(
        mechanism,
        bodies,
        [j for j in mechanism.joints if body not in j.bodies and j.name not in joints],
    )


def _parts(
    mechanism: Mechanism, bodies: Sequence[Any], joints: Sequence[Joint]
) -> Mechanism | None:
    """Return the mechanism of these bodies and joints; None if a driver or all
    points are missing.
    """
    names, known = {"ground", *(body.name for body in bodies)}, {joint.name for joint in joints}
    points = [point for point in mechanism.points if point.body in names]
    couplers = [coupler for coupler in mechanism.couplers if set(coupler.joints) <= known]
    forces = [
        force
        for force in mechanism.forces
        if set(force.bodies) <= names and getattr(force, "joint", None) in (None, *known)
    ]
    there = {point.name for point in points}
    if not points or any(
        getattr(d, "joint", None) not in (None, *known) for d in mechanism.drivers
    ):
        return None
    if any(getattr(d, "point", None) not in (None, *there) for d in mechanism.drivers):
        return None
    try:
        return replace(
            mechanism,
            bodies=bodies,
            joints=joints,
            grounded=(),
            points=points,
            couplers=couplers,
            forces=forces,
        )
    except KincheckError:
        return None


def _driven(case: Case, mechanism: Mechanism | None) -> Iterator[Case]:
    """Yield the case of a mechanism with as many freedoms as drivers."""
    if mechanism is None:
        return
    try:
        require_driven(mechanism)
    except (KincheckError, ValueError):
        return
    yield _with(case, mechanism, set())


def _with(case: Case, mechanism: Mechanism, hidden: set[str]) -> Case:
    shown = [point for point in mechanism.points if point.name not in hidden]
    names = {point.name for point in shown}
    members = (*mechanism.joints, *mechanism.drivers, *mechanism.forces)
    loaded = {each.name for each in members}
    outputs = tuple(
        each for each in case.outputs if set(each.points) <= names and set(each.forces) <= loaded
    )
    return replace(case, mechanism=replace(mechanism, points=shown), outputs=outputs)


def rounded(case: Case, digits: int) -> Case | None:
    """Return the case with its geometry rounded to some digits; None if the result is invalid."""

    def short(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(short, cast("tuple[Any, ...]", value)))
        return float(f"{value:.{digits - 1}e}")

    mechanism = case.mechanism
    try:
        joints = [
            replace(
                joint,
                **joint.mapped(dict.fromkeys((Kind.POSITION, Kind.DIRECTION, Kind.LENGTH), short)),
            )
            for joint in mechanism.joints
        ]
        points = [replace(point, position=short(point.position)) for point in mechanism.points]
        forces = [force.in_frame(short) for force in mechanism.forces]
        found = replace(mechanism, joints=joints, points=points, forces=forces)
        require_driven(found)
    except (KincheckError, ValueError):
        return None
    first, last = (float(short(case.sweep.values[k])) for k in (0, -1))
    sweep = replace(case.sweep, values=np.linspace(first, last, len(case.sweep.values)))
    outputs = tuple(each for each in case.outputs if isinstance(each, Output) or each.forces)
    return replace(case, mechanism=found, sweep=sweep, outputs=outputs)
