"""Assembly from estimates: poses that close, from poses that do not, many estimates at once.

The mixed rows are used, because their only zero is the intended one of every joint: simplified rows lead from any misalignment
back to it, where exact rows end on spurious branches (formulation sections 3 and 4). They do not choose between the legitimate
assemblies of a loop; the estimate does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..algebra import ZERO, Quat, vec
from ..drivers import JointAngle
from ..joints import AxialJoint
from ..joints.base import unit
from ..mechanism import Mechanism
from ..primitives.base import GROUND_POSE, Pose
from ..program import NumpyExecutor, Plan
from ..trajectory import Array, BodyMotion
from .equations import Style
from .programs import Request, Tracer

# Longer steps than this [rad] leave the range in which rows computed at one pose say anything of another.
LONGEST_TURN = 0.3
MAX_ITERATIONS = 100


@dataclass(frozen=True, eq=False)
class Assembled:
    """What became of n estimates.

    Attributes:
        bodies: poses of the moving bodies; those that did not converge are NaN.
        converged: whether each estimate ended in an assembly, on the intended branch of every joint, shape (n,).
        residual: largest constraint residual, relative to the mechanism's size, shape (n,).
        iterations: shape (n,).
    """

    bodies: Mapping[str, BodyMotion]
    converged: NDArray[np.bool_]
    residual: Array
    iterations: NDArray[np.int64]


def assemble(
    mechanism: Mechanism,
    estimates: Mapping[str, tuple[Array, Array]],
    values: Mapping[str, float] | None = None,
    *,
    tol: float = 1e-12,
    style: str = "mixed",
) -> Assembled:
    """Close a mechanism from estimated poses.

    Args:
        estimates: by body, origin r [m], shape (n, 3), and Euler parameters p [-], shape (n, 4); bodies left out start at design.
        values: of the drivers, from their design values [m or rad]; those left out hold theirs.
        tol: largest accepted residual, relative to the mechanism's size.
        style: how the rows are written; "mixed" leads to the intended branch from farthest.

    Raises:
        SolveError: drivers and degrees of freedom do not match.
    """
    moving = tuple(body.name for body in mechanism.moving)
    request = Request(tuple(values or {}), (), moving, order=0, style=Style(style))
    tracer = Tracer(mechanism, request)
    programs = {each.name: each for each in (tracer.newton(longest_turn=LONGEST_TURN), tracer.outputs())}
    slots, vectors = tracer.layout.slots, tracer.layout.vectors
    n = len(next(iter(estimates.values()))[0])
    executor = NumpyExecutor(Plan(programs, slots), n)
    for name, value in _state(tracer, estimates, values or {}).items():
        executor.put(vectors[name], value)
    for name, value in (values or {}).items():
        angle = mechanism.driver(name).type == "joint_angle"
        c = value if angle else value / tracer.frame.unit
        drive = np.array([[c], [0.0], [0.0], [np.cos(0.5 * value)], [np.sin(0.5 * value)]])
        executor.put(vectors[f"drive {name}"], drive)
    iterations, done = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    for _ in range(MAX_ITERATIONS):
        executor.run("newton")
        iterations += ~done
        (residual,) = executor.get([slots["residual"]])
        done |= residual < tol
        if (done | ~np.isfinite(residual)).all():
            break
    executor.run("outputs")
    block = executor.get(range(len(slots)))
    converged = done & (block[slots["closure"]] <= tol) & (block[slots["branch"]] > 0.0)
    found = np.where(converged, block, np.nan)
    bodies = {name: BodyMotion(found[vectors[f"r {name}"]].T, found[vectors[f"p {name}"]].T, None, None) for name in moving}
    return Assembled(bodies, converged, block[slots["closure"]].copy(), iterations)


def _state(tracer: Tracer, estimates: Mapping[str, tuple[Array, Array]], values: Mapping[str, float]) -> dict[str, Array]:
    """The state that the estimates mean, joint coordinates included, each of shape (components, n)."""
    poses: dict[str, Pose] = {}
    state = {name: np.array(value)[:, None] for name, value in tracer.formulation.design.items()}
    for name, (r, p) in estimates.items():
        body = tracer.mechanism.body(name)
        e0, *e = p.T
        d0, *d = body.euler_parameters
        q = Quat(e0, vec(e)) * Quat(d0, vec(d)).conjugate()
        arm = tracer.frame.arm(name, body.origin)
        turned = Pose.of(ZERO, q)
        shift = (np.asarray(r) - np.array(body.origin)).T / tracer.frame.unit
        u = vec([*shift]) - turned.swing(arm)
        poses[name] = Pose.of(u, q)
        state[f"u {name}"], state[f"q {name}"] = np.array([*u]), np.array([*q])
    angles = (driver for driver in tracer.mechanism.drivers if isinstance(driver, JointAngle))
    driven = {driver.joint: values.get(driver.name, 0.0) for driver in angles}
    for joint in tracer.mechanism.joints:
        if not isinstance(joint, AxialJoint):
            continue
        i, j = (poses.get(body, GROUND_POSE) for body in joint.bodies)
        h = unit(joint.axis)
        relative = i.q.conjugate() * j.q
        s_i, s_j = (tracer.frame.arm(body, joint.point) for body in joint.bodies)
        apart = (j.u - i.u) + (j.swing(s_j) - i.swing(s_i))
        angle: Array = 2.0 * np.arctan2(h @ relative.e, relative.e0)
        # Euler parameters know an angle up to two turns: the one nearest to what the joint is driven to
        angle = angle + 4.0 * np.pi * np.round((driven.get(joint.name, 0.0) - angle) / (4.0 * np.pi))
        for freedom, value in (("rotation", angle), ("translation", i.turn(h) @ apart)):
            if f"x {joint.name}.{freedom}" in state:
                state[f"x {joint.name}.{freedom}"] = np.atleast_2d(value)
    return state
