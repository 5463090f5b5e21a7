"""Mechanisms that several tests solve, and ways to write the same mechanism differently."""

from dataclasses import replace

import numpy as np
from kincheck import (
    Body,
    Distance,
    Gear,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    RackPinion,
    Revolute,
    Screw,
    Spherical,
    Table,
    Translational,
    Universal,
    solve,
)
from kincheck.cases.jet import constant, cos, sin, sqrt, steady
from kincheck.core.joints import Kind

ORIGIN, X, Y, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def mcpherson():
    """The suspension of SAE 943745: body frames of its Table 4, joint points reconstructed to fit
    (formulation notes).
    """
    tilt = (np.sqrt(1.0 - 0.0265**2), 0.0, -0.0265, 0.0)
    top, lower, wheel = (1.0, 0.55, 0.6), (0.97772, 0.605, 0.180), (0.975, 0.715, 0.101)
    return Mechanism(
        "mcpherson",
        [
            Body("chassis", fixed=True),
            Body("lca", (1.17, 0.353, 0.005)),
            Body("knuckle", wheel, tilt),
            Body("strut", top, tilt),
            Body("rack", (1.14, 0.0, 0.1455), fixed=True),
        ],
        [
            Revolute("lca_pivot", "chassis", "lca", (1.17, 0.353, 0.005), X),
            Spherical("ball", "lca", "knuckle", (0.9676, 0.660, -0.010)),
            Spherical("strut_top", "strut", "chassis", top),
            Translational("slide", "knuckle", "strut", top, tuple(np.subtract(top, lower))),
            Distance("tie_rod", "knuckle", "rack", ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))),
        ],
        [Point("wheel", "knuckle", wheel), Point("rod_end", "knuckle", (1.115, 0.665, 0.118))],
        [PointCoordinate("stroke", "wheel", Z)],
    )


CRANK, ROD = 0.25, 1.0


def slider_crank(rod=None):
    """A crank of 0.25 m about +y, a massless rod of 1 m (or the length given), a slider along x;
    design: stretched out.
    """
    pin, slider = (CRANK, 0.0, 0.0), (CRANK + ROD, 0.0, 0.0)
    return Mechanism(
        "slider_crank",
        [Body("crank"), Body("slider", slider)],
        [
            Revolute("pivot", "ground", "crank", (0.0, 0.0, 0.0), Y),
            Distance("rod", "crank", "slider", (pin, slider), rod),
            Translational("guide", "ground", "slider", slider, X),
        ],
        [Point("pin", "crank", pin), Point("end", "slider", slider)],
        [JointAngle("turn", "pivot")],
    )


def slider_crank_motion(angle, rate=1.0, rod=ROD):
    """Closed form: the slider's x, as a jet of position, velocity and acceleration."""
    theta = steady(np.asarray(angle), rate)
    height = CRANK * sin(theta)
    return CRANK * cos(theta) + sqrt(rod * rod + -1.0 * (height * height))


A0, B0, C0, D0 = (0.0, 0.0, 0.0), (0.3, 0.0, 0.4), (1.6, 0.0, 1.2), (1.4, 0.0, 0.0)


def four_bar():
    """A planar crank-rocker of four spatial revolutes about y: three rows say what others say
    already.
    """
    y = Y
    return Mechanism(
        "four_bar",
        [Body("crank"), Body("coupler"), Body("rocker")],
        [
            Revolute("A", "ground", "crank", A0, y),
            Revolute("B", "crank", "coupler", B0, y),
            Revolute("C", "coupler", "rocker", C0, y),
            Revolute("D", "ground", "rocker", D0, y),
        ],
        [Point("C", "coupler", C0)],
        [JointAngle("turn", "A")],
    )


def four_bar_motion(angle, rate=1.0):
    """Closed form: x and z of C, as jets: C is where the circles about B and D meet, on the side it
    has at design.
    """
    theta = steady(np.asarray(angle), rate)
    c, s = cos(theta), sin(theta)
    bx, bz = c * B0[0] + s * B0[2], c * B0[2] - s * B0[0]  # a turn about +y takes z to x
    coupler, rocker = (
        np.subtract(C0, B0) @ np.subtract(C0, B0),
        np.subtract(C0, D0) @ np.subtract(C0, D0),
    )
    dx, dz = D0[0] - bx, D0[2] - bz
    square = dx * dx + dz * dz
    along = (square + (coupler - rocker)) / (2.0 * square)
    across = sqrt(constant(coupler, square) / square - along * along)
    return bx + along * dx - across * dz, bz + along * dz + across * dx


def placed(mechanism, where, turn=tuple, factor=1.0):
    """The mechanism with its points and axes sent through `where` and `turn` and its lengths
    multiplied by the factor.

    Drivers along global directions stay as they are.
    """
    ways = {Kind.POSITION: where, Kind.DIRECTION: turn, Kind.LENGTH: lambda length: factor * length}
    return replace(
        mechanism,
        bodies=[replace(body, origin=where(body.origin)) for body in mechanism.bodies],
        joints=[replace(joint, **joint.mapped(ways)) for joint in mechanism.joints],
        points=[replace(point, position=where(point.position)) for point in mechanism.points],
    )


def swapped(mechanism):
    """The mechanism with both bodies of every joint exchanged."""
    return replace(mechanism, joints=[joint.reversed() for joint in mechanism.joints])


def without_fixed_bodies(mechanism):
    """The mechanism with its fixed bodies replaced by the ground."""

    def name(body):
        return "ground" if mechanism.is_fixed(body) else body

    joints = [replace(joint, i=name(joint.i), j=name(joint.j)) for joint in mechanism.joints]
    return replace(mechanism, bodies=mechanism.moving, joints=joints)


LEAN = 0.3
"""Of the cranks of a chain at design [rad]."""
BRANCH = LEAN + np.pi / 2.0
"""Where all links of the chain are in line."""


def chain(loops, lean=LEAN):
    """A chain of four-bar loops (IFToMM A02): cranks at (k, 0) that lean alike, tied by couplers of
    length one; only the first is driven.
    """
    s, c, n = np.sin(lean), np.cos(lean), range(loops)
    cranks = [
        Revolute(f"pivot{k}", "ground", f"crank{k}", (k, 0.0, 0.0), Z) for k in range(loops + 1)
    ]
    balls = [Spherical(f"ball{k}", f"crank{k}", f"coupler{k}", (k + s, c, 0.0)) for k in n]
    crosses = [
        Universal(f"cross{k}", f"crank{k + 1}", f"coupler{k}", (k + 1 + s, c, 0.0), (Z, Y))
        for k in n
    ]
    return Mechanism(
        "chain",
        [*(Body(f"crank{k}") for k in range(loops + 1)), *(Body(f"coupler{k}") for k in n)],
        [*cranks, *balls, *crosses],
        [Point("end", f"crank{loops}", (loops + s, c, 0.0))],
        [JointAngle("turn", "pivot0")],
    )


def chain_end(loops, turn):
    """Closed form of the last crank's pin, its velocity and acceleration at rate one."""
    return crank_tip(loops, LEAN - turn)


def crank_tip(at, lean):
    """Closed form of the tip of a crank with its pivot at (at, 0), its velocity and acceleration,
    where the crank's angle grows at rate one.
    """
    s, c, zero = np.sin(lean), np.cos(lean), 0.0 * lean
    return [np.column_stack(each) for each in ([at + s, c, zero], [-c, s, zero], [-s, -c, zero])]


def pushed(angle=1.0):
    """A slider that drives its crank from an angle, with the slider's x and the pin at design."""
    design = float(slider_crank_motion([angle]).x[0])
    pin, m = (CRANK * np.cos(angle), 0.0, -CRANK * np.sin(angle)), slider_crank()
    rod = Distance("rod", "crank", "slider", (pin, (design, 0.0, 0.0)))
    guide = Translational("guide", "ground", "slider", (design, 0.0, 0.0), X)
    driven = replace(m, joints=[m.joint("pivot"), rod, guide], points=[Point("pin", "crank", pin)])
    return replace(driven, drivers=[JointDisplacement("push", "guide")]), design, pin


def circles_meet(center, radius, other, other_radius):
    """Where two circles in the plane z = 0 meet, on the left from the first center to the other:
    arrays of shape (..., 3). Circles that do not reach each other meet in between.
    """
    d = np.subtract(other, center)
    square = (d * d).sum(axis=-1, keepdims=True)
    along = 0.5 * (1.0 + (radius**2 - other_radius**2) / square)
    off = np.sqrt(np.maximum(radius**2 / square - along**2, 0.0))
    return center + along * d + off * np.cross(Z, d)


def planar_four_bar(pin, meet, rest, ends="hinges", across=X, crank="crank"):
    """A crank about the origin, a rod and a rocker in the plane z = 0, by where their joints are.

    Args:
        ends: of the rod: hinges make three rows more than are needed, universals one, and a hinge
            and a ball none.
        across: the universals' other axis.
    """
    pin, meet, rest = (tuple(np.asarray(each).tolist()) for each in (pin, meet, rest))
    rod = {
        "hinges": (
            Revolute("pin", crank, "rod", pin, Z),
            Revolute("end", "rod", "rocker", meet, Z),
        ),
        "universals": (
            Universal("pin", crank, "rod", pin, (across, Z)),
            Universal("end", "rod", "rocker", meet, (Z, across)),
        ),
        "ball": (Revolute("pin", crank, "rod", pin, Z), Spherical("end", "rod", "rocker", meet)),
    }
    pivot = Revolute("pivot", "ground", crank, ORIGIN, Z)
    return Mechanism(
        "four_bar",
        [Body(crank), Body("rod"), Body("rocker")],
        [pivot, Revolute("rest", "ground", "rocker", rest, Z), *rod[ends]],
        [Point("meet", "rocker", meet)],
        [JointAngle("turn", "pivot")],
    )


def gears():
    """A wheel, a pinion that rolls on a rack, and a nut on its thread, whose height is held."""
    return Mechanism(
        "gears",
        [Body("wheel"), Body("pinion", X), Body("rack"), Body("nut")],
        [
            Revolute("first", "ground", "wheel", ORIGIN, Z),
            Revolute("second", "pinion", "ground", X, Z),
            Translational("guide", "ground", "rack", (1.0, 0.3, 0.0), X),
            Screw("thread", "pinion", "nut", (1.0, 0.0, 0.5), Z, 0.02),
        ],
        [Point("tooth", "rack", (1.0, 0.3, 0.0)), Point("top", "nut", (1.2, 0.1, 0.5))],
        [JointAngle("turn", "first"), PointCoordinate("height", "top", Z)],
        [Gear("mesh", ("first", "second"), -2.0), RackPinion("rolls", ("second", "guide"), 0.3)],
    )


def indexing():
    """A wheel that turns a second one by a quarter of its turns, and a slide that tells the
    time.
    """
    return Mechanism(
        "indexing",
        [Body("wheel"), Body("driven"), Body("slide")],
        [
            Revolute("first", "ground", "wheel", ORIGIN, Z),
            Revolute("second", "ground", "driven", X, Z),
            Translational("guide", "ground", "slide", Z, X),
        ],
        [Point("rim", "driven", (1.2, 0.0, 0.0))],
        [JointDisplacement("clock", "guide"), JointAngle("turn", "first")],
        [Gear("gear", ("second", "first"), 0.25)],
    )


def solve_all(mechanism, driver, values, **options):
    """Solve a mechanism, and assert that every sample is solved."""
    found = solve(mechanism, driver, values, **options)
    assert found.solved.all(), found.message
    return found


def errors(motion, expected):
    """The largest errors of a point's position, velocity and acceleration, or of as many of them as
    there are on both sides.
    """
    found = [motion.position, motion.velocity, motion.acceleration]
    pairs = [(a, b) for a, b in zip(found, expected, strict=False) if a is not None]
    return np.array([np.abs(a - b).max() for a, b in pairs])


def indexed(turns):
    """The turns between time zero and one, and rest before and after."""
    rest = np.arange(-40.0, 41.0) * 0.01
    values = np.repeat([0.0, 2.0 * np.pi * turns], len(rest))
    return Table(tuple(np.concatenate([rest, 1.0 + rest])), tuple(values))
