"""Judgement of case files, and reduction of bad cases to small case files that keep their outcome:
fewer samples, points, bodies and digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, cast

import numpy as np
from msgspec.structs import replace as changed

from ....case.case import MARKER, Case, Output
from ....case.io.atomic_files import written
from ....case.io.case_file import case_text
from ....case.io.outputs import with_all_coordinates
from ....errors import KincheckError
from ....harness.engine import Engine
from ....harness.execution import Pair
from ....joints import Joint, Kind
from ....kinematics import require_driven
from ....mechanism.body import Body
from ....mechanism.mechanism import GROUND, Mechanism
from .families import Specimen
from .run import Example, Finding
from .verdicts import Judgement, Verdict, judge_answer, solve_all


def judge(case: Case, engine: Engine, tol: float) -> Judgement:
    """Judge a case of any origin with an engine, by the reference followed from the design.

    Raises:
        KincheckError: the reference cannot be computed.
    """
    forces = tuple(each for each in case.outputs if each.forces)
    moved = [name for name in case.points if not name.startswith(MARKER)]
    watched = with_all_coordinates(case, moved or None)
    watched = replace(watched, outputs=(*watched.outputs, *forces))
    return _judge_as(Specimen(case.name, watched, tol=tol), watched, engine)


def _judge_as(specimen: Specimen, case: Case, engine: Engine) -> Judgement:
    """Judge a case in place of a specimen's case, by the specimen's reference and excuses."""
    (answer,) = solve_all([Pair(case, engine, specimen.tol)])
    return judge_answer(specimen, case, specimen.truth(case) if specimen.truth else None, answer)


def save(example: Example, folder: Path, problems: list[str]) -> Finding:
    """Reduce an example and write it as a case file; return the finding with the name of the file.

    Args:
        problems: receives the reason if the file cannot be written.
    """
    specimen, engine, finding = example.specimen, example.engine, example.finding

    def bad(case: Case) -> bool:
        return bool(_judge_as(specimen, case, engine).counts[example.verdict])

    def bad_by_itself(case: Case) -> bool:
        return bool(judge(case, engine, specimen.tol).counts[example.verdict])

    case, words = fewer_samples(example.case, finding.sample, bad), list[str]()
    if len(case.sweep.values) < len(example.case.sweep.values):
        words.append(f"samples {len(example.case.sweep.values)} to {len(case.sweep.values)}")
    if example.verdict is Verdict.SILENTLY_WRONG or not specimen.excused:
        # a reduced case has no closed form: its reference is the followed motion
        try:
            known = bad_by_itself(case)
        except KincheckError:
            known = False
        if known:
            case, more = reduce_case(case, bad_by_itself)
            words += more
        else:
            words.append(
                "judged only by the truth of the family: following the motion does not lead there"
            )
    verdict = str(example.verdict).replace(",", "").replace(" ", "_")
    name = f"{finding.family}_{finding.engine}_{finding.mode}_{finding.number}_{verdict}.toml"
    comments = [
        (
            f"{finding.verdict} in {finding.engine} ({finding.mode}), tolerance {finding.tol!r}:"
            f" {finding.specimen}"
        ),
        (
            f"kincheck stress --replay {name} --engine {finding.engine} --mode {finding.mode} --tol"
            f" {finding.tol!r}"
        ),
        *words,
        *finding.message.splitlines(),
    ]
    problems += written(folder / name, case_text(case, comments).encode())
    return changed(finding, file=name, reduced=words)


Bad = Callable[[Case], bool]
"""Function that returns whether a case still has the outcome; False if it cannot be judged."""

GEOMETRY = (Kind.POSITION, Kind.DIRECTION, Kind.LENGTH)
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
    still, sweep = _Budget(bad), case.sweep
    values = sweep.values
    ends = [(float(values[0]), float(values[-1]))]
    if sweep.driver in {driver.name for driver in case.mechanism.drivers}:
        ends.insert(0, (sweep.design, float(values[sample])))
    for (start, end), count in product(ends, (1, 2, 3, 4, 6, 9, 13, 19, 28, 41, 61)):
        if start != end and count < len(values):
            few = np.linspace(start if count > 1 else end, end, count)
            fewer = replace(case, sweep=replace(sweep, values=few))
            if still(fewer):
                return fewer
    return case


def reduce_case(case: Case, bad: Bad) -> tuple[Case, list[str]]:
    """Return the smallest case found with the outcome, and the reductions as text."""
    still, words = _Budget(bad), list[str]()
    before = len(case.mechanism.bodies), len(case.mechanism.joints)
    while (smaller := next(filter(still, _smaller(case)), None)) is not None:
        case = smaller
    if (after := (len(case.mechanism.bodies), len(case.mechanism.joints))) != before:
        words.append(f"bodies {before[0]} to {after[0]}, joints {before[1]} to {after[1]}")
    for digits in range(1, 12):
        rounder = round_geometry(case, digits)
        if rounder is not None and still(rounder):
            return rounder, [*words, f"numbers to {digits} digits"]
    return case, words


def _smaller(case: Case) -> Iterator[Case]:
    """Yield cases with one force element, point or body less and as many freedoms as drivers; the
    largest steps first.
    """
    mechanism = case.mechanism
    moving, joints = mechanism.moving, mechanism.joints
    for force in mechanism.forces:
        forces = [each for each in mechanism.forces if each is not force]
        yield _with(case, replace(mechanism, forces=forces))
    if len(mechanism.points) > 1:
        driven = {getattr(driver, "point", "") for driver in mechanism.drivers}
        for point in mechanism.points:
            if point.name not in driven:
                yield _with(case, mechanism, point.name)
    for gone, body in (*product([None], moving), *((j, b) for b, j in product(moving, joints))):
        bodies = [each for each in mechanism.bodies if each is not body]
        free = [j for j in joints if body.name not in j.bodies and j is not gone]
        yield from _with_parts(case, bodies, free)
    for body in moving:
        bodies = [replace(each, fixed=each.fixed or each is body) for each in mechanism.bodies]
        ground = {each.name for each in bodies if each.fixed} | {GROUND}
        held = [joint for joint in joints if not ground.issuperset(joint.bodies)]
        for gone in (None, *held):
            yield from _with_parts(case, bodies, [joint for joint in held if joint is not gone])


def _with_parts(case: Case, bodies: Sequence[Body], joints: Sequence[Joint]) -> Iterator[Case]:
    """Yield the case of these bodies and joints, if it has a point, all drivers, and as many
    freedoms as drivers.
    """
    mechanism = case.mechanism
    names, known = {GROUND, *(body.name for body in bodies)}, {joint.name for joint in joints}
    points = [point for point in mechanism.points if point.body in names]
    forces = [
        force
        for force in mechanism.forces
        if set(force.bodies) <= names and getattr(force, "joint", None) in (None, *known)
    ]
    if not points:
        return
    try:
        found = replace(
            mechanism,
            bodies=bodies,
            joints=joints,
            grounded=(),
            points=points,
            couplers=[each for each in mechanism.couplers if set(each.joints) <= known],
            forces=forces,
        )
        require_driven(found)
    except (KincheckError, ValueError):
        return
    yield _with(case, found)


def _with(case: Case, mechanism: Mechanism, hidden: str = "") -> Case:
    shown = [point for point in mechanism.points if point.name != hidden]
    names = {point.name for point in shown}
    loaded = {each.name for each in (*mechanism.joints, *mechanism.drivers, *mechanism.forces)}
    outputs = tuple(
        each for each in case.outputs if set(each.points) <= names and set(each.forces) <= loaded
    )
    return replace(case, mechanism=replace(mechanism, points=shown), outputs=outputs)


def round_geometry(case: Case, digits: int) -> Case | None:
    """Return the case with its geometry rounded to some digits; None if the result is invalid."""

    def short(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(short, cast("tuple[Any, ...]", value)))
        return float(f"{value:.{digits - 1}e}")

    mechanism = case.mechanism
    try:
        joints = [
            replace(joint, **joint.mapped(dict.fromkeys(GEOMETRY, short)))
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
