"""Mechanisms that several tests solve, and ways to write the same mechanism differently."""

from dataclasses import fields, replace

import numpy as np
from kincheck.cases.jet import constant, cos, sin, sqrt, steady
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Spherical,
    Translational,
    Universal,
)

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
            Revolute("lca_pivot", "chassis", "lca", (1.17, 0.353, 0.005), (1.0, 0.0, 0.0)),
            Spherical("ball", "lca", "knuckle", (0.9676, 0.660, -0.010)),
            Spherical("strut_top", "strut", "chassis", top),
            Translational("slide", "knuckle", "strut", top, tuple(np.subtract(top, lower))),
            Distance("tie_rod", "knuckle", "rack", ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))),
        ],
        [Point("wheel", "knuckle", wheel), Point("rod_end", "knuckle", (1.115, 0.665, 0.118))],
        [PointCoordinate("stroke", "wheel", (0.0, 0.0, 1.0))],
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
            Revolute("pivot", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            Distance("rod", "crank", "slider", (pin, slider), rod),
            Translational("guide", "ground", "slider", slider, (1.0, 0.0, 0.0)),
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
    y = (0.0, 1.0, 0.0)
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
    ways = {
        "point": where,
        "points": lambda pair: tuple(where(point) for point in pair),
        "axis": turn,
        "length": lambda length: factor * length,
    }
    joints = []
    for joint in mechanism.joints:
        given = {
            each.name: getattr(joint, each.name) for each in fields(joint) if each.name in ways
        }
        changes = {name: ways[name](value) for name, value in given.items() if value is not None}
        joints.append(replace(joint, **changes))
    return replace(
        mechanism,
        bodies=[replace(body, origin=where(body.origin)) for body in mechanism.bodies],
        joints=joints,
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
"""Of the cranks at design [rad]; at a right angle from upright the chain is singular."""


def chain(loops, lean=LEAN):
    """Cranks at (k, 0) that lean alike, tied by couplers of length one; only the first is
    driven.
    """
    s, c, n = np.sin(lean), np.cos(lean), range(loops)
    cranks = [
        Revolute(f"pivot{k}", "ground", f"crank{k}", (k, 0.0, 0.0), (0.0, 0.0, 1.0))
        for k in range(loops + 1)
    ]
    balls = [Spherical(f"ball{k}", f"crank{k}", f"coupler{k}", (k + s, c, 0.0)) for k in n]
    crosses = [
        Universal(
            f"cross{k}",
            f"crank{k + 1}",
            f"coupler{k}",
            (k + 1 + s, c, 0.0),
            ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
        )
        for k in n
    ]
    return Mechanism(
        "chain",
        [*(Body(f"crank{k}") for k in range(loops + 1)), *(Body(f"coupler{k}") for k in n)],
        [*cranks, *balls, *crosses],
        [Point("end", f"crank{loops}", (loops + s, c, 0.0))],
        [JointAngle("turn", "pivot0")],
    )


BRANCH = LEAN + np.pi / 2.0
"""Where all links of the chain are in line."""


def chain_end(loops, turn):
    """Closed form of the last crank's pin, its velocity and acceleration at rate one."""
    s, c, zero = np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0 * turn
    return [np.column_stack(each) for each in ([loops + s, c, zero], [-c, s, zero], [-s, -c, zero])]
