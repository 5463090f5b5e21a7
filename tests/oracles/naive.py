"""The paper's equations as they stand: slow, obvious, unsimplified, in the paper's own variables.

A body is its position r and its Euler parameters p; vectors s, f, g, h are fixed in a body and
given in its own axes (primes dropped). Nothing is expanded, shared or simplified, and nothing here
comes from the code under test. Every function takes complex numbers too, so that derivatives can be
taken along a path.

Equation numbers are those of SAE 943745 as read in the formulation notes. The truth of the stress
study (the laboratory's truth) states the joints a second time: its rows and rates are derived by
hand, those here follow from residuals alone, so that neither repeats a slip of the other.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Body:
    """Position r, global [m], and Euler parameters p = [e0, e] of the rotation body -> global
    [-].
    """

    r: np.ndarray
    p: np.ndarray

    @property
    def A(self):
        return A(self.p)


GROUND = Body(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


def tilde(a):
    """The matrix of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def A(p):
    """(1)  A = (2 e0^2 - 1) I + 2 e e^T + 2 e0 e~."""
    e0, e = p[0], p[1:]
    return (2.0 * e0 * e0 - 1.0) * np.eye(3) + 2.0 * np.outer(e, e) + 2.0 * e0 * tilde(e)


def G(p):
    """G = [-e, -e~ + e0 I], shape (3, 4): omega' = 2 G pdot."""
    return np.column_stack([-p[1:], -tilde(p[1:]) + p[0] * np.eye(3)])


def p_rate(p, omega):
    """pdot of the angular velocity omega' in body axes."""
    return 0.5 * G(p).T @ omega


def p_acceleration(p, omega, omega_t):
    """pddot of omega' and its derivative, body axes (Gdot pdot = 0)."""
    return 0.5 * G(p).T @ omega_t - 0.25 * (omega @ omega) * p


# Primitives


def line(i, j, s_i, s_j):
    """d, from P_i to P_j, global."""
    return (j.r + j.A @ s_j) - (i.r + i.A @ s_i)


def dot10(i, j, a, b):
    """(8)  a^T A_i^T A_j b."""
    return a @ i.A.T @ j.A @ b


def dot11(i, j, axes_i, axes_j):
    """(13)  [g_i . h_j, f_i . h_j]."""
    (f, g, _), (_, _, h) = axes_i, axes_j
    return np.array([dot10(i, j, g, h), dot10(i, j, f, h)])


def dot12(i, j, axes_i, axes_j):
    """(17)  B_i [g_i . h_j, h_i . f_j, f_i . g_j]."""
    (f_i, g_i, h_i), (f_j, g_j, h_j) = axes_i, axes_j
    return np.column_stack(axes_i) @ [
        dot10(i, j, g_i, h_j),
        dot10(i, j, h_i, f_j),
        dot10(i, j, f_i, g_j),
    ]


def dot20(i, j, a, s_i, s_j):
    """(22)  a^T A_i^T d."""
    return a @ i.A.T @ line(i, j, s_i, s_j)


def dot21(i, j, axes_i, s_i, s_j):
    """(23)  [f_i . d, g_i . d]."""
    return np.array([dot20(i, j, a, s_i, s_j) for a in axes_i[:2]])


def spherical(i, j, s_i, s_j):
    """(24)  d."""
    return line(i, j, s_i, s_j)


def distance(i, j, s_i, s_j, L):
    """|d| - L."""
    d = line(i, j, s_i, s_j)
    return np.array([np.sqrt(d @ d) - L])


# Joints: from points and axes, global at design, to residuals at any pose


def triad(axis):
    """f, g, h: any right-handed orthonormal axes with h along the axis."""
    h = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    f = np.cross(h, np.eye(3)[np.abs(h).argmin()])
    f /= np.linalg.norm(f)
    return f, np.cross(h, f), h


def to_body(body, *vectors):
    """Global vectors at design in body axes."""
    return [body.A.T @ np.asarray(a, dtype=float) for a in vectors]


def arm(body, point):
    """s: a point, global at design, in body axes from the body's origin."""
    return body.A.T @ (np.asarray(point, dtype=float) - body.r)


class Pair:
    """A joint's bodies at design and now, its points as arms and its axes as triads in both."""

    def __init__(self, joint, i0, j0, i, j):
        self.joint, self.i, self.j, self._i0, self._j0 = joint, i, j, i0, j0
        points = getattr(joint, "points", (getattr(joint, "point", None),) * 2)
        P_i, P_j = (j0.r if point is None else np.asarray(point, dtype=float) for point in points)
        self.d0 = P_j - P_i
        self.s_i, self.s_j = arm(i0, P_i), arm(j0, P_j)
        self.axes_i, self.axes_j = self.in_both(triad(getattr(joint, "axis", (0.0, 0.0, 1.0))))

    def in_both(self, axes):
        """Global vectors at design, fixed in body i and fixed in body j."""
        return to_body(self._i0, *axes), to_body(self._j0, *axes)

    def spherical(self):
        return spherical(self.i, self.j, self.s_i, self.s_j)

    def parallel(self):
        return dot11(self.i, self.j, self.axes_i, self.axes_j)

    def lock(self):
        return dot12(self.i, self.j, self.axes_i, self.axes_j)

    def line(self):
        return dot21(self.i, self.j, self.axes_i, self.s_i, self.s_j)

    def plane(self):
        """h_i . d, with its design value taken off."""
        h = self.axes_i[2]
        return [dot20(self.i, self.j, h, self.s_i, self.s_j) - self._i0.A @ h @ self.d0]

    def angle(self):
        """The cosine of the angle between the first axis, on i, and the second, on j, with its
        design value taken off.
        """
        a, b = (np.asarray(axis) / np.linalg.norm(axis) for axis in self.joint.axes)
        return [dot10(self.i, self.j, self._i0.A.T @ a, self._j0.A.T @ b) - a @ b]

    def distance(self):
        length = getattr(self.joint, "length", None)
        return distance(
            self.i,
            self.j,
            self.s_i,
            self.s_j,
            np.linalg.norm(self.d0) if length is None else length,
        )

    def twist(self):
        """f_i . g_j - g_i . f_j: constant velocity; shaft j's axes are shaft i's carried over by
        the shortest rotation.
        """
        h, k = (np.asarray(axis) / np.linalg.norm(axis) for axis in self.joint.axes)
        f, g, _ = triad(h)
        N = tilde(np.cross(h, k))
        carry = np.eye(3) + N + N @ N / (1.0 + h @ k)
        (f_i, g_i), (f_j, g_j) = to_body(self._i0, f, g), to_body(self._j0, carry @ f, carry @ g)
        return [dot10(self.i, self.j, f_i, g_j) - dot10(self.i, self.j, g_i, f_j)]

    def thread(self):
        """d = lead theta / 2 pi, as the sine of the difference of the two turns: smooth, and good
        for any number of turns.
        """
        radius = self.joint.lead / (2.0 * np.pi)
        turn = self.plane()[0] / radius
        (f_i, g_i, _), (f_j, _, _) = self.axes_i, self.axes_j
        cosine, sine = dot10(self.i, self.j, f_i, f_j), dot10(self.i, self.j, g_i, f_j)
        return [radius * (np.sin(turn) * cosine - np.cos(turn) * sine)]


JOINTS = {
    "revolute": (Pair.spherical, Pair.parallel),
    "spherical": (Pair.spherical,),
    "universal": (Pair.spherical, Pair.angle),
    "translational": (Pair.lock, Pair.line),
    "fixed": (Pair.spherical, Pair.lock),
    "distance": (Pair.distance,),
    "cylindrical": (Pair.parallel, Pair.line),
    "screw": (Pair.parallel, Pair.line, Pair.thread),
    "planar": (Pair.parallel, Pair.plane),
    "inline": (Pair.line,),
    "in_plane": (Pair.plane,),
    "parallel_axes": (Pair.parallel,),
    "perpendicular_axes": (Pair.angle,),
    "orientation_lock": (Pair.lock,),
    "revolute_spherical": (Pair.distance, Pair.plane),
    "constant_velocity": (Pair.spherical, Pair.twist),
}
"""Joint type -> the conditions it is made of (formulation section 6)."""


def joint_residuals(joint, i0, j0, i, j):
    """The residuals of a joint between bodies i and j, which were at i0 and j0 at design."""
    pair = Pair(joint, i0, j0, i, j)
    return np.concatenate([condition(pair) for condition in JOINTS[joint.type]])


def design(mechanism):
    """All bodies of a mechanism at the design position, by name."""
    return {"ground": GROUND} | {
        b.name: Body(np.array(b.origin), np.array(b.euler_parameters)) for b in mechanism.bodies
    }


def residuals(mechanism, now):
    """The residuals of all joints with the bodies (by name; those not named are at design) where
    they are now.
    """
    before = design(mechanism)
    after = before | now
    return np.concatenate(
        [
            joint_residuals(each, before[each.i], before[each.j], after[each.i], after[each.j])
            for each in mechanism.joints
        ]
    )


def taylor(function, radius=0.1, points=32):
    """Value, first and second derivative at t = 0 of an analytic function, real for real t, from
    values on a circle (Cauchy).

    No step size to trade: aliasing is (radius / radius of convergence)^points, round-off 1e-16 /
    radius^order.
    """
    circle = radius * np.exp(2j * np.pi * np.arange(points // 2 + 1) / points)
    values = np.array([function(t) for t in circle])
    # the lower half is conjugate to the upper: all but the two real points count twice
    weights = np.r_[1.0, np.full(points // 2 - 1, 2.0), 1.0] / points
    return [
        factorial * np.real((weights * circle**-k) @ values)
        for k, factorial in enumerate((1.0, 1.0, 2.0))
    ]


def along(bodies):
    """Bodies moving with their velocities and accelerations: t -> poses, exact to second order in
    t.

    bodies: name -> (r, p, [rdot, omega'], [rddot, omega'dot]).
    """

    def at(t):
        poses = {}
        for name, (r, p, v, a) in bodies.items():
            p_t, p_tt = p_rate(p, v[3:]), p_acceleration(p, v[3:], a[3:])
            poses[name] = Body(
                r + t * v[:3] + 0.5 * t * t * a[:3], p + t * p_t + 0.5 * t * t * p_tt
            )
        return poses

    return at


def sample(found, k):
    """One sample of a solution's bodies, as `along` takes them."""
    return {
        name: (each.r[k], each.p[k], each.v[k], each.a[k]) for name, each in found.bodies.items()
    }
