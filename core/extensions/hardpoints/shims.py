"""Shims: toe, camber and caster when a joint is moved and the links keep their lengths; and the
places of the tie rod that leave no bump steer.

A row of a table that moves makes other links; a shim under a joint moves the wheel instead. The
wheel carrier has six velocities, of the wheel's centre and of rotation. Its links leave one, the
height, which is held:  n . (v + w x r) = n . u,  n being the direction that a joint holds, r its
place from the wheel's centre, and u the velocity by the shim.

A tie rod l from a to b holds  l . (v + w x r_b) = 0  while the wheel moves up. Without it, and with
a toe rate of zero in its place, the carrier has the velocities v*, w*, and b has  v_b* = v* + w* x
r_b,  wherever the ends of the rod are. So there is no bump steer where  l . v_b* = 0.  An end that
moves alone in the table along e by m changes this, a by  -m e . v_b*,  and b by  m e . (v_b* + l x
w*),  exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...mechanism.mechanism import GROUND, Vector
from ...trajectory import Array
from .templates import KNUCKLE, TIEROD_INNER, WHEEL_AXIS, WHEEL_CENTER, Template

Held = tuple[str, Array, Mapping[str, float]]
"""Role of a place of the carrier, the direction held there, and roles whose shims move it."""
_AXES = np.eye(3)


def shims(
    template: Template, at: Mapping[str, Vector], toe: float, camber: float
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return by role what the position of a joint does; nothing for a carrier that is held
    otherwise.

    First the derivatives of toe, camber and, where two points make the steering axis, caster
    [rad/m] by x, y and z of each joint that a shim moves, shape (2 or 3, 3). Then, for each end of
    the tie rod, by how much it leaves no bump steer at design if it is moved alone in the table
    along x, y or z [m], shape (3,); infinite where that has no effect.

    Args:
        at: positions by role of a left wheel [m].
        toe, camber: at design, if no point states the wheel's axis [rad].
    """
    places = {role: np.array(place) for role, place in at.items()}
    # the height of the wheel's centre is held too
    held: list[Held] = [*_joints(template, places), (WHEEL_CENTER, _AXES[2], {})]
    if len(held) != 6:
        return {}, {}
    spin = np.array([np.sin(toe), np.cos(toe), -np.tan(camber)])
    if WHEEL_AXIS in places:
        spin = places[WHEEL_AXIS] - places[WHEEL_CENTER]
    spin = spin / np.linalg.norm(spin)
    x, y, _ = spin
    arms = [places[role] - places[WHEEL_CENTER] for role, _, _ in held]
    rows = np.array([np.r_[n, np.cross(r, n)] for (_, n, _), r in zip(held, arms, strict=True)])
    found = dict[str, Array]()
    for role in dict.fromkeys(role for *_, movers in held for role in movers):
        right = np.array([movers.get(role, 0.0) * n for _, n, movers in held])
        solved = np.asarray(np.linalg.solve(rows, right), float)
        v, turns = solved.reshape(2, 3, 3)  # by x, y and z of the joint
        dx, dy, dz = np.cross(turns.T, spin).T
        angles = [(y * dx - x * dy) / (x * x + y * y), -dz / np.hypot(x, y)]
        if ends := [end for end in template.kingpin or () if isinstance(end, str)]:
            low, high = (_end_velocity(end, role, held, places, v, turns) for end in ends)
            x_of, _, z_of = places[ends[1]] - places[ends[0]]
            turned = x_of * (high - low)[2] - z_of * (high - low)[0]
            angles += [turned / (x_of * x_of + z_of * z_of)]
        found[role] = np.array(angles)
    rods = [k for k, (*_, movers) in enumerate(held) if TIEROD_INNER in movers]
    if not rods:
        return found, {}
    outer = held[rods[0]][0]
    along = places[outer] - places[TIEROD_INNER]
    # the wheel's rate of toe in place of the tie rod, and a rate of one of the height, the last row
    rows[rods[0]] = np.r_[0.0, 0.0, 0.0, x * spin[2], y * spin[2], -x * x - y * y]
    with np.errstate(divide="ignore", invalid="ignore"):
        try:
            solved = np.asarray(np.linalg.solve(rows, np.eye(6)[5]), float)
        except np.linalg.LinAlgError:  # the tie rod does not steer
            return found, {}
        v, w = solved.reshape(2, 3)
        end = v + np.cross(w, places[outer] - places[WHEEL_CENTER])
        off = float(along @ end)
        return found, {TIEROD_INNER: off / end, outer: -off / (end + np.cross(along, w))}


def _end_velocity(
    end: str,
    shimmed: str,
    held: Sequence[Held],
    places: Mapping[str, Array],
    v: Array,
    turns: Array,
) -> Array:
    """Return the velocity of an end of the steering axis by x, y and z of the shimmed joint."""
    sign = next(movers.get(end, 0.0) for role, _, movers in held if role == end)
    own = _AXES * (end == shimmed)
    if sign > 0.0:  # on the chassis
        return own
    return v + np.cross(turns.T, places[end] - places[WHEEL_CENTER]).T + own


def _joints(template: Template, at: Mapping[str, Array]) -> Iterator[Held]:
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
