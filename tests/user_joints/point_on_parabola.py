"""A point on a curve: with a primitive of its own, made of two known ones."""

from dataclasses import dataclass

from kincheck import Joint
from kincheck.core import primitives as p
from kincheck.core.algebra import ZERO, Scalar, Vec3, cross, vec
from kincheck.core.joints.base import directions, length, position, require_perpendicular, unit
from kincheck.core.primitives import Primitive, Row


@dataclass(frozen=True)
class Parabola(Primitive):
    """phi = y - x^2 / (2 R), with x along a and y along b from the apex; a, b and the apex fixed
    in body i.
    """

    n = 1
    a: Vec3
    b: Vec3
    s_i: Vec3
    s_j: Vec3
    R: Scalar

    def xy(self, ask):
        return (ask(p.Dot20(e, self.s_i, self.s_j, ZERO))[0] for e in (self.a, self.b))

    def phi(self, i, j):
        x, y = self.xy(lambda dot: dot.phi(i, j))
        return (y - x * x * (0.5 / self.R),)

    def rows(self, i, j):
        (x, _), (along, up) = (
            self.xy(lambda dot: dot.phi(i, j)),
            self.xy(lambda dot: dot.rows(i, j)),
        )
        return (Row(*(u - (x / self.R) * a for u, a in zip(up, along, strict=True))),)

    def gamma(self, i, j, vi, vj):
        (x, _), (along, _) = self.xy(lambda dot: dot.phi(i, j)), self.xy(lambda dot: dot.rows(i, j))
        x_t = along.ri @ vi.v + along.pi @ vi.w + along.rj @ vj.v + along.pj @ vj.w
        gamma_x, gamma_y = self.xy(lambda dot: dot.gamma(i, j, vi, vj))
        return (gamma_y - (x * gamma_x - x_t * x_t) * (1.0 / self.R),)


@dataclass(frozen=True)
class PointOnParabola(Joint):
    """The point, fixed in body j, stays on a parabola of body i through it: along the first axis,
    curved to the second.
    """

    type = "point_on_parabola"
    freedoms = ("slide", "rotation x", "rotation y", "rotation z")
    symmetric = False
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()
    radius: float = length()

    def __post_init__(self):
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i, j):
        P, (a, b) = vec(self.point), map(unit, self.axes)
        arms = i.arm(P), j.arm(P)
        return Parabola(a, b, *arms, self.radius), p.Dot20(unit([*cross(a, b)]), *arms, ZERO)
