"""A wheel carrier on five rods, from raw distances by scipy's least squares: its velocities by
differences. Nothing is shared with kincheck, and nothing but a quaternion with other oracles.
"""

import numpy as np
from scipy.optimize import least_squares

# Differences of the fourth order: rounding 1e-16 / STEP, truncation STEP^4 times fifth derivatives.
STEP = 1e-3


def turn(w):
    """The rotation matrix of a quaternion of which the vector is given."""
    x, y, z = w
    s = np.sqrt(1.0 - np.dot(w, w))
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * s * k + 2.0 * k @ k


class Carrier:
    """A carrier.

    Args:
        wheel: the wheel's centre at design.
        rods: pairs of points at design, on the chassis and on the carrier; the last is the tie rod.
    """

    def __init__(self, wheel, rods):
        self.wheel, self.rods = np.array(wheel), [(np.array(p), np.array(q)) for p, q in rods]

    def at(self, pose, point):
        """A point of the carrier, given at design."""
        return self.wheel + pose[:3] + turn(pose[3:]) @ (np.array(point) - self.wheel)

    def pose(self, travel, rack, start=None):
        """Shift of the wheel's centre and vector of the quaternion, at a travel and the rack's."""

        def gaps(pose):
            found = [pose[2] - travel]
            for k, (p, q) in enumerate(self.rods):
                inner = p + (0.0, rack if k == len(self.rods) - 1 else 0.0, 0.0)
                d = self.at(pose, q) - inner
                found.append(d @ d - (q - p) @ (q - p))
            return found

        start = np.array([0.0, 0.0, travel, 0.0, 0.0, 0.0]) if start is None else start
        found = least_squares(gaps, start, xtol=3e-16, ftol=3e-16, gtol=3e-16)
        assert np.abs(found.fun).max() < 1e-13
        return found.x

    def velocities(self, pose, travel, rack, *places):
        """Velocities of the carrier's points that are at places now, per unit of travel."""
        near = [self.pose(travel + k * STEP, rack, pose) for k in (-2, -1, 1, 2)]
        back = turn(pose[3:]).T
        for place in places:
            fixed = self.wheel + back @ (np.array(place) - self.wheel - pose[:3])
            a, b, c, d = (self.at(each, fixed) for each in near)
            yield (a - 8.0 * b + 8.0 * c - d) / (12.0 * STEP)
