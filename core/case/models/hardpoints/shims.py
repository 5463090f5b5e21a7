"""Shims: toe and camber when a joint is moved and the links keep their lengths.

A row of a table that moves makes other links; a shim under a joint moves the wheel instead. The
wheel carrier has six velocities, of the wheel's centre and of rotation. Its links leave one, the
height, which is held:  n . (v + w x r) = n . u,  n being the direction that a joint holds, r its
place from the wheel's centre, and u the velocity by the shim.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ....mechanism.mechanism import GROUND, Vector
from ....trajectory import Array
from .templates import KNUCKLE, WHEEL_AXIS, WHEEL_CENTER, Template

Held = tuple[str, Array, Mapping[str, float]]
"""Role of a place of the carrier, the direction held there, and roles whose shims move it."""
_AXES = np.eye(3)


def shims(
    template: Template, at: Mapping[str, Vector], toe: float, camber: float
) -> dict[str, Array]:
    """Return the derivatives of toe and camber [rad/m] by the position of each joint, by role and
    then by x, y and z, shape (2, 3); nothing for a carrier that is held otherwise.

    Args:
        at: positions by role of a left wheel [m].
        toe, camber: at design, if no point states the wheel's axis [rad].
    """
    places = {role: np.array(place) for role, place in at.items()}
    held: list[Held] = [*_held(template, places), (WHEEL_CENTER, _AXES[2], {})]
    if len(held) != 6:
        return {}
    spin = np.array([np.sin(toe), np.cos(toe), -np.tan(camber)])
    if WHEEL_AXIS in places:
        spin = places[WHEEL_AXIS] - places[WHEEL_CENTER]
    x, y, z = spin / np.linalg.norm(spin)
    arms = [places[role] - places[WHEEL_CENTER] for role, _, _ in held]
    rows = [np.r_[n, np.cross(r, n)] for (_, n, _), r in zip(held, arms, strict=True)]
    moved = dict.fromkeys(role for *_, movers in held for role in movers)
    found: dict[str, Array] = {}
    for role in moved:
        right = np.array([movers.get(role, 0.0) * n for _, n, movers in held])
        turns = np.linalg.solve(np.array(rows), right)[3:]  # by x, y and z of the joint
        dx, dy, dz = np.cross(turns.T, (x, y, z)).T
        found[role] = np.array([(y * dx - x * dy) / (x * x + y * y), -dz / np.hypot(x, y)])
    return found


def _held(template: Template, at: Mapping[str, Array]) -> Iterator[Held]:
    joints = template.joint_rows.values()
    balls = {i: role for kind, i, j, role, *_ in joints if (kind, j) == ("spherical", KNUCKLE)}
    struts = {j: roles for kind, i, j, *roles in joints if (kind, i) == ("translational", KNUCKLE)}
    for kind, i, j, *roles in joints:
        if i != GROUND or not {*roles} <= at.keys():
            continue
        if kind == "distance" and j == KNUCKLE:
            yield _rod(roles[0], roles[1], at)
        elif kind == "revolute" and j in balls:
            yield from (_rod(end, balls[j], at) for end in roles)
        elif kind == "spherical" and j in struts:
            lower, upper = struts[j]
            yield from ((upper, n, {upper: 1.0}) for n in _across(at[upper] - at[lower]))
        elif j == KNUCKLE:
            first, *second = roles
            yield from ((first, n, {first: 1.0}) for n in _AXES)
            for role in second:
                yield from ((role, n, {role: 1.0}) for n in _across(at[role] - at[first]))


def _rod(inner: str, outer: str, at: Mapping[str, Array]) -> Held:
    along = at[outer] - at[inner]
    return outer, along / np.linalg.norm(along), {inner: 1.0, outer: -1.0}


def _across(axis: Array) -> Array:
    """Return two unit vectors across an axis, shape (2, 3)."""
    return np.linalg.svd(axis[None])[2][1:]
