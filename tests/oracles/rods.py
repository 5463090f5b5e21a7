"""A wheel carrier on rods and a strut's line by equations of its own: lengths and lines, a rotation
matrix, Newton's method. Nothing is shared with kincheck.
"""

import numpy as np


def rotation(w):
    """The rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(w)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = w / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def solved(rows, right):
    """The solution of linear equations, of which some may follow from others."""
    return np.linalg.lstsq(np.array(rows), np.array(right), rcond=1e-12)[0]


class Carrier:
    """A carrier of a wheel.

    Args:
        wheel: centre of the wheel at design.
        rods: pairs of points at design, on the chassis and on the carrier.
        balls: points of the carrier that stay where they are.
        line: a point of the chassis, and a point of the carrier; the line through both at design
            stays on the carrier, and goes through the first.
    """

    def __init__(self, wheel, rods, line=None, balls=()):
        self.wheel = np.array(wheel)
        self.rods = [(np.array(p), np.array(q)) for p, q in rods]
        self.line = None if line is None else tuple(map(np.array, line))
        self.balls = [np.array(p) for p in balls]
        self.turn, self.shift = np.eye(3), np.zeros(3)

    def at(self, point):
        """A point of the carrier, given at design."""
        return self.wheel + self.shift + self.turn @ (np.array(point) - self.wheel)

    def direction(self, d):
        """A direction fixed in the carrier, given at design."""
        return self.turn @ np.array(d)

    def rows(self, moved):
        """Residuals of rods and line, and their rows over (shift, turn about the wheel's centre).

        Args:
            moved: displacement of the chassis end of a rod, by the rod's number.
        """
        center, phi, rows = self.at(self.wheel), [], []
        for k, (p, q) in enumerate(self.rods):
            now = self.at(q)
            d = now - p - np.array(moved.get(k, (0.0, 0.0, 0.0)))
            phi.append(d @ d - (q - p) @ (q - p))
            rows.append([*(2.0 * d), *(2.0 * np.cross(now - center, d))])
        for p in self.balls:
            x, y, z = self.at(p) - center
            phi += [*(self.at(p) - p)]
            skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
            rows += [[*e, *(-np.array(s))] for e, s in zip(np.eye(3), skew, strict=True)]
        if self.line is not None:
            top, foot = self.line
            along = (top - foot) / np.linalg.norm(top - foot)
            first = np.cross(along, (0.0, 1.0, 0.0))
            now = self.at(foot)
            for side in (first, np.cross(along, first)):
                e = self.direction(side)
                phi.append(e @ (top - now))
                rows.append([*-e, *(np.cross(e, top - now) - np.cross(now - center, e))])
        return phi, rows

    def go(self, travel, moved=None):
        """Move the wheel's centre up by the travel, in steps from where it is."""
        moved = moved or {}
        for _ in range(60):
            phi, rows = self.rows(moved)
            phi.append(self.shift[2] - travel)
            rows.append([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
            step = solved(rows, phi)
            self.shift = self.shift - step[:3]
            self.turn = rotation(-step[3:]) @ self.turn
            if np.abs(step).max() < 1e-15:
                break
        assert np.abs(phi).max() < 1e-14
        return self

    def twist(self, moved=None):
        """Velocities of the wheel's centre and of rotation per unit of its upward travel."""
        _, rows = self.rows(moved or {})
        rows.append([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        found = solved(rows, [0.0] * (len(rows) - 1) + [1.0])
        return found[:3], found[3:]

    def steering(self):
        """The screw that is left without the last rod, the height of the wheel's centre held: a
        point of its axis, and the direction, upwards.
        """
        _, rows = self.rows({})
        left = np.linalg.svd([*rows[:-1], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])[2][-1]
        v, w = left[:3], left[3:]
        return self.at(self.wheel) + np.cross(w, v) / (w @ w), w * np.sign(w[2])

    def velocity(self, now, moved=None):
        """Velocity of the carrier's point that is at a place now, per unit of travel."""
        v, w = self.twist(moved)
        return v + np.cross(w, np.array(now) - self.at(self.wheel))
