"""Random primitives between random moving bodies, a thousand lanes each; one maker for each type of
primitive.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, replace

import numpy as np
from kincheck.core import primitives as p
from kincheck.core.algebra import IDENTITY, ZERO, Quat, Vec3, X, Y, Z, cross
from kincheck.core.doors import extensions
from kincheck.core.jet import Jet
from kincheck.core.primitives import Drive, Pose, Primitive, Twist


def cos_sin(a):
    """Cosine and sine of a jet."""
    c, s = np.cos(a.x), np.sin(a.x)
    return Jet(c, -s * a.v, -s * a.a - c * a.v * a.v), Jet(s, c * a.v, c * a.a - s * a.v * a.v)


LANES = 1000
PAPER_ROWS = "kincheck.core.extensions.laboratory.paper.rows"


def in_body_axes(kind):
    """Whether the rows of a primitive type are in body axes: those of the paper's styles."""
    return kind.__module__.startswith(PAPER_ROWS.rpartition(".")[0])


def discovered():
    """All primitive types of the package, whether or not anything exports them."""
    for module in pkgutil.iter_modules(p.__path__):
        importlib.import_module(f"{p.__name__}.{module.name}")
    if "laboratory" in extensions():
        importlib.import_module(PAPER_ROWS)
    waiting, found = [Primitive], []
    while waiting:
        subtypes = [
            each
            for each in waiting.pop().__subclasses__()
            if each.__module__.startswith("kincheck.")
        ]
        waiting += subtypes
        found += subtypes
    return sorted(found, key=lambda each: each.__name__)


TYPES = discovered()


# Random motions


def lanes(values):
    """Scalars of one or all lanes as an array, shape (n, lanes)."""
    return np.array([np.broadcast_to(x, LANES) for x in values])


def vector(rng):
    return Vec3(*rng.normal(size=(3, LANES)))


def direction(rng):
    a = vector(rng)
    return (1.0 / np.sqrt(a @ a)) * a


def orientation(rng):
    e = rng.normal(size=(4, LANES))
    e /= np.sqrt((e * e).sum(axis=0))
    return Quat(e[0], Vec3(*e[1:]))


def rotation(axis, angle):
    return Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * axis)


SPURIOUS = [rotation(axis, np.pi) for axis in (X, Y, Z)] + [
    rotation((1.0 / np.sqrt(3.0)) * Vec3(a, b, c), 2.0 * np.pi / 3.0)
    for a, b, c in ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
]
"""Rotations other than none at which the equations of a lock hold as well."""


def frame(rng):
    """f, g, h: right-handed, orthonormal."""
    h, other = direction(rng), direction(rng)
    f = cross(other, h)
    f = (1.0 / np.sqrt(f @ f)) * f
    return f, cross(h, f), h


@dataclass(frozen=True)
class Body:
    """A body on its way: pose (u, q), velocity (v, w), acceleration (v_t, w_t), global axes."""

    u: Vec3
    q: Quat
    v: Vec3
    w: Vec3
    v_t: Vec3
    w_t: Vec3

    @property
    def pose(self):
        return Pose.of(self.u, self.q)

    def in_axes_of(self, primitive):
        """Angular velocity and acceleration as the primitive's rows take them."""
        if not in_body_axes(type(primitive)):
            return self
        to_body = self.pose.A.T
        return replace(self, w=to_body @ self.w, w_t=to_body @ self.w_t)

    @property
    def motion(self):
        return Twist(self.v, self.w)

    @property
    def jets(self):
        """The pose as a function of time: q' = w q / 2, q'' = w' q / 2 - |w|^2 q / 4."""
        u = Vec3(*(Jet(*each) for each in zip(self.u, self.v, self.v_t, strict=True)))
        q_t, turning = Quat(0.0, 0.5 * self.w) * self.q, Quat(0.0, 0.5 * self.w_t) * self.q
        q_tt = [a - 0.25 * (self.w @ self.w) * b for a, b in zip(turning, self.q, strict=True)]
        e0, *e = (Jet(*each) for each in zip(self.q, q_t, q_tt, strict=True))
        return Pose.of(u, Quat(e0, Vec3(*e)))


def body(rng):
    return Body(vector(rng), orientation(rng), *(vector(rng) for _ in range(4)))


@dataclass(frozen=True)
class DriverMotion:
    """A driver's value and derivatives, as numbers for rows and right-hand sides and as jets for
    phi.
    """

    numbers: Drive
    jets: Drive


def driver_motion(rng):
    c, c_t, c_tt = 3.0 * rng.normal(size=(3, LANES))
    cosine, sine = cos_sin(Jet(0.5 * c, 0.5 * c_t, 0.5 * c_tt))
    return DriverMotion(
        Drive(c, c_t, c_tt, cosine.x, sine.x), Drive(Jet(c, c_t, c_tt), 0.0, 0.0, cosine, sine)
    )


# One maker for each primitive


@dataclass(frozen=True)
class Specimen:
    """A primitive with geometry in lanes, and how to get body j admissible where its rows are
    simplified.
    """

    primitive: Primitive
    drive: DriverMotion | None = None
    on_manifold: Callable[[Body, Body], tuple[Body, Body]] | None = None
    """(i, j) -> (i, j) with phi = 0 and rows . velocity = nu; None: rows and gamma are exact
    anywhere.
    """


def dot10(rng):
    return Specimen(p.Dot10(direction(rng), direction(rng)))


def dot11(rng):
    f, g, h = frame(rng)
    angle, speed = rng.uniform(-3.0, 3.0, LANES), rng.normal(size=LANES)

    def turn(i, j):
        return i, replace(j, q=i.q * rotation(h, angle), w=i.w + speed * i.pose.turn(h))

    return Specimen(p.Dot11(f, g, h), None, turn)


def alike(i, j):
    return i, replace(j, q=i.q, w=i.w)


def dot12(rng):
    return Specimen(p.Dot12(), None, alike)


def dot20(rng):
    drive = driver_motion(rng)
    return Specimen(
        p.Dot20(direction(rng), vector(rng), vector(rng), vector(rng), drive.numbers), drive
    )


def dot21(rng):
    f, g, _ = frame(rng)
    return Specimen(p.Dot21(f, g, vector(rng)))


def distance(rng):
    d0 = vector(rng)
    return Specimen(
        p.Distance(vector(rng), vector(rng), d0, rng.uniform(0.5, 2.0, LANES), np.sqrt(d0 @ d0))
    )


def spherical(rng):
    return Specimen(p.Spherical(vector(rng), vector(rng), vector(rng)))


def ground(rng):
    def at_rest(i, j):
        return i, replace(j, u=ZERO, q=IDENTITY, v=ZERO, w=ZERO)

    return Specimen(p.Ground(), None, at_rest)


def driven_coordinate(rng):
    drive = driver_motion(rng)
    return Specimen(p.DrivenCoordinate(direction(rng), vector(rng), drive.numbers), drive)


def driven_angle(rng):
    h, drive = direction(rng), driver_motion(rng)

    def turn(i, j):
        c = drive.numbers
        return i, replace(j, q=i.q * rotation(h, c.c), w=i.w + c.c_t * i.pose.turn(h))

    return Specimen(p.DrivenAngle(h, drive.numbers), drive, turn)


def constant_velocity(rng):
    (f_i, g_i, _), (f_j, g_j, _) = frame(rng), frame(rng)
    return Specimen(p.ConstantVelocity(f_i, g_i, f_j, g_j))


def named_turn(rng):
    specimen = driven_angle(rng)
    return replace(specimen, primitive=p.NamedTurn(specimen.primitive.h, specimen.drive.numbers))


def named_slide(rng):
    drive, arms = driver_motion(rng), [vector(rng) for _ in range(3)]
    return Specimen(p.NamedSlide(*arms, h=direction(rng), drive=drive.numbers), drive)


MAKERS = {
    p.ConstantVelocity: constant_velocity,
    p.Distance: distance,
    p.Dot10: dot10,
    p.Dot11: dot11,
    p.Dot12: dot12,
    p.Dot20: dot20,
    p.Dot21: dot21,
    p.DrivenAngle: driven_angle,
    p.DrivenCoordinate: driven_coordinate,
    p.Ground: ground,
    p.NamedSlide: named_slide,
    p.NamedTurn: named_turn,
    p.Spherical: spherical,
}


def entry(table, kind):
    """What a table says of a type or of the nearest type it derives from: another row style has the
    same fields.
    """
    return next((table[each] for each in kind.__mro__ if each in table), None)


def make(kind, rng):
    """A specimen of a type, by its own maker or by that of the type it restyles without further
    fields.
    """
    maker = entry(MAKERS, kind)
    untested = f"{kind.__name__} is not tested: add a maker for it to MAKERS in tests/specimens.py"
    assert maker, untested
    specimen = maker(rng)
    required = {
        each.name
        for each in fields(kind)
        if each.default is MISSING and each.default_factory is MISSING
    }
    assert required <= {each.name for each in fields(specimen.primitive)}, untested
    return replace(specimen, primitive=retyped(specimen.primitive, kind))


def retyped(primitive, kind):
    """The same fields in another type."""
    return kind(**{each.name: getattr(primitive, each.name) for each in fields(primitive)})


def admissible(specimen, rng):
    """Two moving bodies: any where the primitive is exact, else on its manifold with admissible
    velocities.
    """
    i, j = body(rng), body(rng)
    return specimen.on_manifold(i, j) if specimen.on_manifold else (i, j)
