"""Joints with equations of their own throughout: a telescope, and one with a thread."""

import math
from dataclasses import dataclass, field

from kincheck import Cylindrical
from kincheck.core.algebra import ZERO, Vec3, cross, vec
from kincheck.core.joints import AxialJoint
from kincheck.core.joints.base import direction, length, position, triad, unit
from kincheck.core.primitives import Drive, Primitive, Row


@dataclass(frozen=True)
class Across(Primitive):
    """The point of body j stays on the line of body i through its point, across f and g."""

    n = 2
    f: Vec3
    g: Vec3
    s_i: Vec3
    s_j: Vec3

    def phi(self, i, j):
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        return tuple(i.turn(a) @ d for a in (self.f, self.g))

    def rows(self, i, j):
        S_i, S_j = i.turn(self.s_i), j.turn(self.s_j)
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        axes = [i.turn(a) for a in (self.f, self.g)]
        return tuple(Row(-a, cross(a, d) - cross(S_i, a), a, cross(S_j, a)) for a in axes)

    def gamma(self, i, j, vi, vj):
        S_i, S_j = i.turn(self.s_i), j.turn(self.s_j)
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        d_t = vj.of(S_j) - vi.of(S_i)
        bent = vj.centripetal(S_j) - vi.centripetal(S_i)
        return tuple(
            -(a @ bent + 2.0 * (cross(vi.w, a) @ d_t) + cross(vi.w, cross(vi.w, a)) @ d)
            for a in (i.turn(self.f), i.turn(self.g))
        )


@dataclass(frozen=True)
class Aligned(Primitive):
    """The axis h of both bodies is one: it stays across f and g of body i."""

    n = 2
    f: Vec3
    g: Vec3
    h: Vec3

    def phi(self, i, j):
        return tuple(i.turn(a) @ j.turn(self.h) for a in (self.f, self.g))

    def rows(self, i, j):
        h = j.turn(self.h)
        crossed = [cross(i.turn(a), h) for a in (self.f, self.g)]
        return tuple(Row(ZERO, c, ZERO, -c) for c in crossed)

    def gamma(self, i, j, vi, vj):
        h, h_t = j.turn(self.h), cross(vj.w, j.turn(self.h))
        return tuple(
            -(cross(vi.w, cross(vi.w, a)) @ h + 2.0 * (cross(vi.w, a) @ h_t) + a @ cross(vj.w, h_t))
            for a in (i.turn(self.f), i.turn(self.g))
        )

    def branch(self, i, j):
        return (i.turn(self.h) @ j.turn(self.h),)


@dataclass(frozen=True)
class Slide(Primitive):
    """The displacement of the point of body j along h of body i is that of the drive."""

    n = 1
    h: Vec3
    s_i: Vec3
    s_j: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i, j):
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        return (i.turn(self.h) @ d - self.drive.c,)

    def rows(self, i, j):
        a, S_i, S_j = i.turn(self.h), i.turn(self.s_i), j.turn(self.s_j)
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        return (Row(-a, cross(a, d) - cross(S_i, a), a, cross(S_j, a)),)

    def nu(self, i, j):
        return (self.drive.c_t,)

    def gamma(self, i, j, vi, vj):
        a, S_i, S_j = i.turn(self.h), i.turn(self.s_i), j.turn(self.s_j)
        d = (j.u + j.swing(self.s_j)) - (i.u + i.swing(self.s_i))
        d_t = vj.of(S_j) - vi.of(S_i)
        bent = vj.centripetal(S_j) - vi.centripetal(S_i)
        a_t = cross(vi.w, a)
        return (self.drive.c_tt - (a @ bent + 2.0 * (a_t @ d_t) + cross(vi.w, a_t) @ d),)


@dataclass(frozen=True)
class Turn(Primitive):
    """The angle of body j about h relative to body i is that of the drive."""

    n = 1
    h: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i, j):
        rho = i.q.conjugate() * j.q
        return (2.0 * (self.drive.half_cos * (self.h @ rho.e) - self.drive.half_sin * rho.e0),)

    def rows(self, i, j):
        return (Row(ZERO, -i.turn(self.h), ZERO, i.turn(self.h)),)

    def nu(self, i, j):
        return (self.drive.c_t,)

    def gamma(self, i, j, vi, vj):
        return (self.drive.c_tt - cross(vi.w, i.turn(self.h)) @ (vj.w - vi.w),)

    def branch(self, i, j):
        rho = i.q.conjugate() * j.q
        return (self.drive.half_cos * rho.e0 + self.drive.half_sin * (self.h @ rho.e),)


@dataclass(frozen=True)
class Telescope(AxialJoint):
    """Body j slides along the axis of body i, and turns about it."""

    type = "telescope"
    freedoms = ("rotation", "translation")
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i, j):
        P, (f, g, h) = vec(self.point), triad(self.axis)
        return Across(f, g, i.arm(P), j.arm(P)), Aligned(f, g, h)

    def measured(self, freedom, i, j):
        P, h = vec(self.point), unit(self.axis)
        return Turn(h) if freedom == "rotation" else Slide(h, i.arm(P), j.arm(P))

    def equivalent(self):
        return [], [Cylindrical(f"{self.name}_tube", self.i, self.j, self.point, self.axis)]


@dataclass(frozen=True)
class Threaded(Telescope):
    """The telescope moves by the lead [m] at each turn."""

    type = "threaded"
    lead: float = length()

    @property
    def relations(self):
        return ({"translation": 1.0, "rotation": -self.lead / (2.0 * math.pi)},)

    def equivalent(self):
        return None
