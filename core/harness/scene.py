"""Scenes: the mechanism of each case for drawing, at a few samples of its sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from ..case.case import MARKER, Case
from ..case.io.sections import sections
from ..case.measures import DriverEffort, JointForce
from ..errors import KincheckError
from ..joints import Kind
from ..joints.base import unit
from ..kinematics import NativeSolver
from ..mechanism.loads import SpringDamper
from ..mechanism.mechanism import Vector
from ..mechanism.motions import PointCoordinate
from ..trajectory import Array, BodyMotion
from .engine import STANDARD
from .record import Results
from .scene_record import (
    Scene,
    SceneBody,
    SceneForce,
    SceneJoint,
    ScenePoint,
    SceneSpring,
)

FRAMES = 61  # a few seconds of animation, and a few kilobytes a body
POSES = 3000  # frames times bodies, at most: a quarter of a megabyte of results
LARGEST = 200  # moving bodies; a picture with more is unreadable
DIGITS = 6  # relative to the mechanism's size: a thousandth of a pixel

# Looser than for a comparison, since poses are only drawn: a thousandth of the last digit kept.
TOL = 1e-9


def with_scenes(results: Results, cases: Sequence[Case]) -> Results:
    """Return the results with a scene of every case of at most `LARGEST` moving bodies.

    Poses over the sweep are solved here only if the results hold an answer of the native engine,
    possibly from a separate process: such a case can neither hang nor end this process.
    """
    answered = {each.case for each in results.records if each.engine == STANDARD and each.solved}
    requested = any(record.engine == STANDARD for record in results.records)
    shown = [case for case in cases if len(case.mechanism.moving) <= LARGEST]
    return msgspec.structs.replace(
        results,
        scenes={
            case.name: scene(case, poses=case.name in answered, requested=requested)
            for case in shown
        },
    )


def scene(case: Case, *, poses: bool = True, requested: bool = True) -> Scene:
    """Return the scene of a case.

    Args:
        poses: solve for the bodies' poses over the sweep; otherwise the scene is the design
            position.
        requested: if `poses` is false, whether the native engine was run and had no answer.
    """
    mechanism = case.mechanism
    stated = {place for row in case.hardpoints for place in row.moves}
    frames, motions = list[int](), dict[str, BodyMotion]()
    message = (
        f"the native engine {'has no answer' if requested else 'was not run'} in this run: this is"
        " the design position"
    )
    if poses:
        try:
            frames, motions, message = _poses(case)
        except KincheckError as error:
            message = f"no poses, this is the design position: {error}"
    size = _size(
        [body.origin for body in mechanism.bodies]
        + [point for joint in mechanism.joints for point in joint.points_on()]
    )
    return Scene(
        bodies=[
            SceneBody(
                name=body.name,
                fixed=body.fixed,
                origin=list(body.origin),
                euler_parameters=list(body.euler_parameters),
                r=_round_numbers(motions[body.name].r, size) if body.name in motions else [],
                p=_round_numbers(motions[body.name].p, 1.0) if body.name in motions else [],
            )
            for body in mechanism.bodies
        ],
        joints=[
            SceneJoint(
                name=joint.name,
                type=joint.type,
                bodies=list(joint.bodies),
                points=[list(point) for point in joint.points_on()],
                axes=(axes := [list(v) for _, kind, v in joint.parts() if kind is Kind.DIRECTION]),
                # rows of a table at both ends of an axis: their difference is the axis
                far=[a + b for a, b in zip(joint.points_on()[0], axes[0], strict=True)]
                if f"joints.{joint.name}.axis" in stated
                else [],
            )
            for joint in mechanism.joints
        ],
        points=[
            ScenePoint(
                name=point.name,
                body=point.body,
                position=list(point.position),
                output=point.name in case.points,
            )
            for point in mechanism.points
            if not point.name.startswith(MARKER)
        ],
        wheels=[wheel for each in sections() for wheel in each.wheels(case).values()],
        springs=_springs(case),
        forces=_forces(case),
        frames=frames,
        message=message,
    )


def _springs(case: Case) -> list[SceneSpring]:
    """Return the springs and dampers among the force elements, and those of outputs."""

    def named(spring: object, damper: object) -> str:
        return "both" if spring and damper else "damper" if damper else "spring"

    found = {
        each.points: (named(each.stiffness or each.curve, each.damping), each.bodies)
        for each in case.mechanism.forces
        if isinstance(each, SpringDamper)
    }
    for section in sections():
        for points, bodies, damper in section.springs(case):
            found.setdefault(points, (named(not damper, damper), bodies))
    return [
        SceneSpring(kind=kind, bodies=[*bodies], points=[[*point] for point in points])
        for points, (kind, bodies) in found.items()
    ]


def _forces(case: Case) -> list[SceneForce]:
    """Return the force outputs at a point along a fixed direction."""
    found: list[SceneForce] = []
    for output in case.outputs:
        if isinstance(output, JointForce):
            direction = output.unit_direction
        elif isinstance(output, DriverEffort) and isinstance(
            driver := case.mechanism.driver(output.driver), PointCoordinate
        ):
            direction = unit(driver.direction)
        else:
            continue
        body, position = output.place(case.mechanism)
        found.append(
            SceneForce(
                output=output.name,
                name=output.read,
                body=body,
                position=list(position),
                direction=[float(x) for x in direction],
            )
        )
    return found


def _poses(case: Case) -> tuple[list[int], dict[str, BodyMotion], str]:
    """Return the samples reached among `FRAMES` evenly spaced ones, and the moving bodies there."""
    path, count = case.sweep.path, len(case.sweep.values)
    bodies = tuple(body.name for body in case.mechanism.moving)
    frames = min(FRAMES, count, POSES // max(1, len(bodies)))
    taken = np.unique(np.linspace(0, count - 1, frames).round().astype(int))
    # interpreted by numpy: for so few samples, compilation takes longer
    solver = NativeSolver(order=0, compiled=False)
    found = solver.prepare(case.mechanism, replace(path, times=path.times[taken]), bodies=bodies)(
        TOL
    )
    reached = {
        name: replace(motion, r=motion.r[found.solved], p=motion.p[found.solved])
        for name, motion in found.bodies.items()
    }
    return taken[found.solved].tolist(), reached if found.solved.any() else {}, found.message


def _size(points: Sequence[Vector]) -> float:
    """Return the largest extent of the design position [m]; 1 if there is none."""
    return float(np.ptp(np.array(points), axis=0).max()) or 1.0 if points else 1.0


def _round_numbers(values: Array, size: float) -> list[list[float]]:
    return np.round(values, DIGITS - math.floor(math.log10(size))).tolist()
