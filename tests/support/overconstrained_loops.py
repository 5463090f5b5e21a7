"""Closed chains of hinges with more rows than freedoms, by families: their hinges with the digits
of a file, and poses of their links by least squares over the closure of the whole loop.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Loop:
    """Hinges between the ground and a first link, that and the next, and so on, global at design.

    Attributes:
        points, axes: of shape (hinges, 3).
    """

    name: str
    points: np.ndarray
    axes: np.ndarray

    @property
    def size(self):
        return float(np.ptp(self.points, axis=0).max())

    def rounded(self, digits):
        """Return the loop with so many decimals; its size is near one."""
        return Loop(self.name, np.round(self.points, digits), np.round(self.axes, digits))

    def links(self, angles):
        """Return rotations and shifts of all links since design, and of the ground at the end."""
        R, r, found = np.eye(3), np.zeros(3), []
        for point, axis, angle in zip(self.points, self.axes, angles, strict=True):
            turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
            r = r + R @ (point - turn @ point)
            R = R @ turn
            found.append((R, r))
        return found

    def gap(self, angles):
        """Return how far the ground at the end is from itself, six numbers."""
        R, r = self.links(angles)[-1]
        center = self.points.mean(axis=0)
        return np.concatenate([r + R @ center - center, Rotation.from_matrix(R).as_rotvec()])

    def solved(self, first, start=None):
        """Return the angles nearest to a closed loop, at an angle of the first hinge."""
        start = np.zeros(len(self.points) - 1) if start is None else start
        found = least_squares(
            lambda rest: self.gap([first, *rest]), start, xtol=3e-16, ftol=3e-16, gtol=3e-16
        )
        return found.x, float(np.abs(found.fun).max())

    def followed(self, values):
        """Return the angles of all hinges at values of the first, and the largest gap."""
        angles, rest, gap, at = [], None, 0.0, 0.0
        for value in values:
            for between in np.linspace(at, value, 2 + int(abs(value - at) / 0.05))[1:]:
                rest, left = self.solved(between, rest)
            at, gap = value, max(gap, left)
            angles.append([value, *rest])
        return np.array(angles), gap


def _screws(name, transforms):
    """Return the loop of Denavit-Hartenberg transforms: hinges about the z axis of each frame."""
    frame, points, axes = np.eye(4), [], []
    for each in transforms:
        points.append(frame[:3, 3])
        axes.append(frame[:3, 2])
        frame = frame @ each
    assert np.allclose(frame, np.eye(4), atol=1e-9), name
    return Loop(name, np.array(points), np.array(axes))


def _dh(theta, d, a, alpha):
    (c, s), (ca, sa) = ((np.cos(x), np.sin(x)) for x in (theta, alpha))
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


def _placed(loop, rng):
    """Return the loop somewhere else, of about a unit's size, with points along its axes, and axes
    of other lengths, so that digits tilt parallel ones.
    """
    R = Rotation.random(random_state=np.random.RandomState(rng.integers(1 << 31))).as_matrix()
    points = loop.points / loop.size
    points = points + rng.uniform(-0.2, 0.2, size=(len(points), 1)) * loop.axes
    axes = rng.uniform(0.6, 1.4, size=(len(points), 1)) * loop.axes
    return Loop(loop.name, points @ R.T + rng.uniform(-0.5, 0.5, size=3), axes @ R.T)


def planar_four_bar(rng):
    """Four parallel hinges, of a Grashof linkage."""
    turn = rng.uniform(0.6, 1.2)
    points = np.array(
        [[0, 0, 0], 0.3 * np.array([np.cos(turn), np.sin(turn), 0]), [0.8, 0.7, 0], [0.9, 0, 0]]
    )
    points[2:, :2] += rng.uniform(-0.05, 0.05, size=(2, 2))
    return Loop("planar four-bar", points, np.tile([0.0, 0.0, 1.0], (4, 1)))


def bennett(rng):
    """Links a, b of twists with sin(alpha) / a = sin(beta) / b, opposite ones alike."""
    a, alpha, beta = 1.0, rng.uniform(0.4, 0.8), rng.uniform(1.1, 1.5)
    b = a * np.sin(beta) / np.sin(alpha)
    theta = rng.uniform(1.2, 1.8)
    # tan(theta1 / 2) tan(theta2 / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2)
    ratio = np.sin(0.5 * (beta + alpha)) / np.sin(0.5 * (beta - alpha))
    other = 2.0 * np.arctan(ratio / np.tan(0.5 * theta))
    angles = (theta, other, -theta, -other)
    links = ((a, alpha), (b, beta), (a, alpha), (b, beta))
    return _screws("Bennett", [_dh(t, 0.0, *x) for t, x in zip(angles, links, strict=True)])


def bricard_trihedral(rng):
    """Bricard's orthogonal linkage: a1^2 + a3^2 + a5^2 = a2^2 + a4^2 + a6^2, twists of 90 and 270
    degrees. The start is found by least squares over the closure.
    """
    a = np.array([0.9, 0.6, 0.9, 0.7, 0.8, 0.0]) + np.append(rng.uniform(-0.05, 0.05, 5), 0.0)
    a[5] = np.sqrt(a[0] ** 2 + a[2] ** 2 + a[4] ** 2 - a[1] ** 2 - a[3] ** 2)
    twists = [0.5 * np.pi, 1.5 * np.pi] * 3
    links = [(0.0, *pair) for pair in zip(a, twists, strict=True)]
    return _closed("Bricard trihedral", links, rng)


def bricard_line_symmetric(rng):
    """Opposite links and offsets alike: a half of the loop is a half turn about the line."""
    half = [(rng.uniform(-0.3, 0.3), rng.uniform(0.3, 0.9), rng.uniform(0.5, 2.2)) for _ in "abc"]
    return _closed("Bricard line-symmetric", [*half, *half], rng)


def bricard_plane_symmetric(rng):
    """Links mirrored in the plane through hinges 1 and 4."""
    a, alpha = rng.uniform(0.3, 0.9, size=3), rng.uniform(0.5, 1.3, size=3)
    d = rng.uniform(-0.3, 0.3, size=2)
    half = [(0.0, a[0], alpha[0]), (d[0], a[1], alpha[1]), (d[1], a[2], alpha[2])]
    mirrored = [
        (0.0, a[2], 2.0 * np.pi - alpha[2]),
        (-d[1], a[1], 2.0 * np.pi - alpha[1]),
        (-d[0], a[0], 2.0 * np.pi - alpha[0]),
    ]
    return _closed("Bricard plane-symmetric", [*half, *mirrored], rng)


def _closed(name, links, rng):
    """Return the loop of links (d, a, alpha) at angles that close it, if some are found."""

    def gap(angles):
        frame = np.eye(4)
        for theta, link in zip(angles, links, strict=True):
            frame = frame @ _dh(theta, *link)
        return (frame - np.eye(4))[:3].ravel()

    found = least_squares(gap, rng.uniform(-np.pi, np.pi, 6), xtol=3e-16, ftol=3e-16, gtol=3e-16)
    if np.abs(found.fun).max() > 1e-12:
        return None
    return _screws(name, [_dh(t, *link) for t, link in zip(found.x, links, strict=True)])


def sarrus(rng):
    """Two groups of three parallel hinges each: the platform between them goes straight."""
    turn, lean = rng.uniform(0.5, 0.9), rng.uniform(0.9, 1.4)
    across = np.array([np.cos(lean), np.sin(lean), 0.0])
    points, axes = [], []
    for out, axis in (
        (np.array([1.0, 0, 0]), [0.0, 1, 0]),
        (across, np.cross([0, 0, 1.0], across)),
    ):
        knee = out * (0.4 + 0.5 * np.cos(turn)) + np.array([0, 0, 0.5 * np.sin(turn)])
        group = [0.4 * out, knee, 0.4 * out + np.array([0, 0, np.sin(turn)])]
        points.append(group)
        axes.append([axis] * 3)
    order = [*points[0], *points[1][::-1]]
    return Loop("Sarrus", np.array(order), np.array([*axes[0], *axes[1]], dtype=np.float64))


def _rotor(point, axis, cot):
    """Return the dual quaternion h of hinge and speed: t - h is its motion, eight numbers."""
    axis = axis / np.linalg.norm(axis)
    return np.concatenate([[cot], axis, [0.0], np.cross(point, axis)])


def _times(p, q):
    def ham(a, b):
        return np.concatenate(
            [[a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]
        )

    return np.concatenate([ham(p[:4], q[:4]), ham(p[:4], q[4:]) + ham(p[4:], q[:4])])


_SIGNS = np.array([1.0, -1, -1, -1, 1, -1, -1, -1])


def _inverse(p):
    norm = _times(p, _SIGNS * p)
    a, b = norm[0], norm[4]
    return _times(_SIGNS * p, np.array([1.0 / a, 0, 0, 0, -b / a**2, 0, 0, 0]))


def _flipped(h, g):
    """Return k, l with (t - h)(t - g) = (t - k)(t - l), the norms of the factors exchanged: four
    hinges of a Bennett linkage.
    """
    apart = _SIGNS * h - g
    right = _times(_inverse(apart), _times(h, g) - _times(h, _SIGNS * h))
    right = -right
    return h + g - right, right


def _line(h):
    size = np.linalg.norm(h[1:4])
    axis = h[1:4] / size
    return np.cross(axis, h[5:8] / size), axis


def _random_rotor(rng):
    return _rotor(rng.uniform(-0.5, 0.5, 3), rng.normal(size=3), rng.uniform(-1.0, 1.0))


def factorized(rng):
    """Two factorizations of one cubic motion: six hinges in general places (Hegedus, Schicho,
    Schroecker).
    """
    a, b, c = (_random_rotor(rng) for _ in "abc")
    a[0], b[0], c[0] = rng.uniform(-1.0, -0.4), rng.uniform(-0.2, 0.2), rng.uniform(0.4, 1.0)
    b2, a2 = _flipped(a, b)
    c2, a3 = _flipped(a2, c)
    c3, b3 = _flipped(b2, c2)
    hinges = [a, b, c, a3, b3, c3]
    return Loop("factorized", *map(np.array, zip(*map(_line, hinges), strict=True)))


def goldberg(rng):
    """Two Bennett linkages that share a link and a hinge: five hinges."""
    a, b = _random_rotor(rng), _random_rotor(rng)
    c, d = _flipped(a, b)  # (t - a)(t - b) = (t - c)(t - d)
    m = b.copy()  # about the hinge of b, at another speed
    m[0] = b[0] + rng.uniform(0.4, 1.2)
    p, q = _flipped(d, m)  # (t - d)(t - m) = (t - p)(t - q)
    return Loop("Goldberg", *map(np.array, zip(*map(_line, [a, b, q, p, c]), strict=True)))


FOLLOWED = np.linspace(0.0, 0.6, 13)
"""Angles of the first hinge [rad]."""


def is_regular(loop):
    """Whether it closes with one freedom, at poses far from singular ones."""
    size = loop.size
    if not 0.2 < size < 5.0:
        return False
    unit = Loop(loop.name, loop.points / size, loop.axes)
    for angles in unit.followed(FOLLOWED)[0]:
        found, R, r = [], np.eye(3), np.zeros(3)
        for (turn, shift), point, axis in zip(
            unit.links(angles), unit.points, unit.axes, strict=True
        ):
            axis = axis / np.linalg.norm(axis)
            found.append(np.concatenate([R @ axis, np.cross(R @ point + r, R @ axis)]))
            R, r = turn, shift
        sizes = np.linalg.svd(np.array(found[1:]), compute_uv=False)
        rank = 3 if "planar" in loop.name else len(loop.points) - 1
        if np.abs(unit.gap(angles)).max() > 1e-10 or sizes[rank - 1] < 0.05:
            return False
    return True


FAMILIES = {
    "planar": planar_four_bar,
    "bennett": bennett,
    "goldberg": goldberg,
    "sarrus": sarrus,
    "trihedral": bricard_trihedral,
    "line": bricard_line_symmetric,
    "plane": bricard_plane_symmetric,
    "factorized": factorized,
}


@cache
def random_loop(family, seed):
    """Return a loop of a family, somewhere in space; a seed makes the same one anywhere."""
    rng = np.random.default_rng([seed, [*FAMILIES].index(family)])
    while True:
        loop = FAMILIES[family](rng)
        if loop is not None and is_regular(loop := _placed(loop, rng)):
            return loop
