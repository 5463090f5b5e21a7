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

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...algebra import Vec3
from ...jet import Jet
from ...mechanism.mechanism import GROUND, Vector
from ...trajectory import Array
from .suspension import Side, Vehicle
from .suspension.base import Attitude
from .suspension.wheel import Camber, Caster, Toe
from .templates import KNUCKLE, TIEROD_INNER, WHEEL_CENTER, Template

Held = tuple[str, Array, Mapping[str, float]]
"""Role of a place of the carrier, the direction held there, and roles whose shims move it."""
_AXES = np.eye(3)


def shims(
    template: Template, at: Mapping[str, Vector], wheel: Vehicle
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return by role what the position of a joint does; nothing for a carrier that is held
    otherwise.

    First the derivatives of toe, camber and, where two points make the steering axis, caster
    [rad/m] by x, y and z of each joint that a shim moves, shape (2 or 3, 3). Then, for each end of
    the tie rod, by how much it leaves no bump steer at design if it is moved alone in the table
    along x, y or z [m], shape (3,); infinite where that has no effect.

    Args:
        at: positions by role of a left wheel [m].
        wheel: of the roles, with its angles at design if no point states its axis.
    """
    places = {role: np.array(place) for role, place in at.items()}
    center = places[WHEEL_CENTER]
    # the height of the wheel's centre is held too
    held: list[Held] = [*_joints(template, places), (WHEEL_CENTER, _AXES[2], {})]
    if len(held) != 6:
        return {}, {}
    angles = np.sin(wheel.static_toe), np.cos(wheel.static_toe), -np.tan(wheel.static_camber)
    places.setdefault(wheel.spin_marker, center + angles)
    arms = [places[role] - center for role, _, _ in held]
    rows = np.array([np.r_[n, np.cross(r, n)] for (_, n, _), r in zip(held, arms, strict=True)])
    of_points = [end for end in template.kingpin or () if isinstance(end, str)]
    toe, *others = (
        each("", replace(wheel, side=Side.LEFT), 0.0, 0.0, "")
        for each in (Toe, Camber, Caster)[: 3 if of_points else 2]
    )

    def rate(angle: Attitude, twist: Array, shimmed: str = "") -> Array:
        """Return the rates of an angle by motions of the carrier, shape (6, motions), and of a
        joint along each axis.
        """
        v, w = twist.reshape(2, 3, -1)

        def moving(name: str) -> Vec3:
            own = _AXES if name == shimmed else 0.0
            on_body = any(role == name and movers.get(name, 0.0) > 0.0 for role, _, movers in held)
            turned = v + np.cross(w.T, places[name] - center).T
            found = np.zeros_like(v) + own + (0.0 if on_body else turned)
            return Vec3(*map(Jet, places[name], found, 0.0 * found))

        now = {name: moving(name) for name in angle.points}
        return angle.of(now, now).v

    found = dict[str, Array]()
    for role in dict.fromkeys(role for *_, movers in held for role in movers):
        right = np.array([movers.get(role, 0.0) * n for _, n, movers in held])
        twist = np.asarray(np.linalg.solve(rows, right), float)  # by x, y and z of the joint
        found[role] = np.array([rate(each, twist, role) for each in (toe, *others)])
    rods = [k for k, (*_, movers) in enumerate(held) if TIEROD_INNER in movers]
    if not rods:
        return found, {}
    outer = held[rods[0]][0]
    along = places[outer] - places[TIEROD_INNER]
    # the wheel's rate of toe in place of the tie rod, and a rate of one of the height, the last row
    rows[rods[0]] = rate(toe, np.eye(6))
    with np.errstate(divide="ignore", invalid="ignore"):
        try:
            solved = np.asarray(np.linalg.solve(rows, np.eye(6)[5]), float)
        except np.linalg.LinAlgError:  # the tie rod does not steer
            return found, {}
        v, w = solved.reshape(2, 3)
        end = v + np.cross(w, places[outer] - center)
        off = float(along @ end)
        return found, {TIEROD_INNER: off / end, outer: -off / (end + np.cross(along, w))}


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
