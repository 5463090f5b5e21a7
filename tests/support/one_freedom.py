"""Mechanisms of one freedom with each coupler and each force element, and their closed forms.

A crank turns by q about y; gravity and a torsional spring act on it. A coupler moves another body
by f(q), or a force element acts on the crank. With the energy  1/2 M(q) q'^2 + V(q)  and the
elements' generalized force Q(q, q'), the effort at the crank is  M q'' + 1/2 M' q'^2 + V' - Q.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from .mechanisms import ORIGIN, X, Y, Z
from .splines import through

G, MASS, ARM, INERTIA, CLOCK = 9.81, 1.0, 0.3, 0.02, 20.0
OTHER, REACH, OWN = 0.5, 0.2, 0.01
"""Mass of the other body [kg], distance of its centre from its hinge [m], its inertia [kg m^2]."""
POINTS = ((-1.0, -0.3), (-0.5, -0.1), (0.0, 0.0), (0.5, 0.12), (1.0, 0.2))
STOP = ((-0.2, -30.0), (0.0, 0.0), (0.05, 8.0), (0.2, 120.0))
HOOK, EYE = np.array([0.5, 0.1, 0.6]), np.array([0.3, 0.05, 0.02])


@dataclass(frozen=True)
class Subject:
    """A coupler or force element on the crank.

    Attributes:
        type: of the coupler, joint or element.
        more: what it adds to a case.
        follows: f(q), f', f'' of the other body; None without one.
        slides: whether the other body moves along z, by f; else it turns about y, by f.
        force: generalized force Q(q, q') of an element.
        varied: place of a number of the element, and the case of another value of it.
    """

    type: str
    more: dict
    follows: Callable | None = None
    slides: bool = True
    force: Callable = field(default=lambda q, rate: 0.0)
    varied: tuple = ()


def _slide():
    return {
        "bodies": {"slide": body(X, OTHER)},
        "joints": {"rail": joint("translational", "slide", X, Z)},
        "points": {"end": {"body": "slide", "position": [1.0, 0.0, 0.0]}},
    }


def _wheel():
    return {
        "bodies": {"wheel": body((1.0 + REACH, 0.0, 0.0), OTHER)},
        "joints": {"axle": joint("revolute", "wheel", X, Y)},
        "points": {"end": {"body": "wheel", "position": [1.0 + REACH, 0.0, 0.0]}},
    }


def body(center, mass, inertia=OWN):
    return {
        "mass": mass,
        "center_of_mass": [*center],
        "inertia": [inertia, inertia, inertia, 0.0, 0.0, 0.0],
    }


def joint(kind, moved, point, axis, **more):
    found = {"type": kind, "bodies": ["ground", moved], "point": [*point], "axis": [*axis]}
    return found | more


def coupled(kind, keys, follows, *, slides=True, more=None):
    parts = _slide() if slides else _wheel()
    for name, each in (more or {}).items():
        parts[name] = parts.get(name, {}) | each
    parts["couplers"] = {"x": {"type": kind, **keys}} | parts.get("couplers", {})
    return Subject(kind, parts, follows, slides)


def line(slope):
    return lambda q: (slope * q, slope, 0.0)


def powers(*coefficients):
    found = np.polynomial.Polynomial(coefficients)
    return lambda q: tuple(float(found.deriv(k)(q)) if k else float(found(q)) for k in range(3))


def element(kind, keys, force, varied=()):
    own = {"forces": {"x": {"type": kind, **keys}}}
    return Subject(kind, own, force=force, varied=varied)


def turned(vector, q):
    """Return a vector turned about y."""
    x, y, z = vector
    return np.array([math.cos(q) * x + math.sin(q) * z, y, math.cos(q) * z - math.sin(q) * x])


def about_y(place, force):
    return float(np.cross(place, force)[1])


def moved_by(place):
    """Return the velocity of a place at a rate of one, about y."""
    return np.cross([0.0, 1.0, 0.0], place)


def of_spring(stiffness=250.0, free=0.7, damping=3.0, curve=None):
    def force(q, rate):
        eye = turned(EYE, q)
        along = (HOOK - eye) / np.linalg.norm(HOOK - eye)
        stretch = np.linalg.norm(HOOK - eye) - free
        tension = stiffness * stretch - damping * rate * (along @ moved_by(eye))
        tension += float(curve(stretch)) if curve else 0.0
        return about_y(eye, tension * along)

    return force


def of_clock(stiffness=5.0, free=0.1, damping=0.3, curve=None):
    def force(q, rate):
        more = float(curve(q - free)) if curve else 0.0
        return -(stiffness * (q - free) + damping * rate + more)

    return force


def of_bushing(turning=0.0, stiffness=0.0, damping=0.0, preload=0.0, curve=None, cardan=False):
    """Of a bushing at EYE with axes of the ground, along z and about y."""

    def force(q, rate):
        place = turned(EYE, q)
        z, speed = place[2] - EYE[2], rate * moved_by(place)[2]
        pull = stiffness * z + damping * speed + preload
        pull += float(curve(z)) if curve else 0.0
        turn = turning * (q if cardan else math.sin(q))
        return about_y(place, np.array([0.0, 0.0, -pull])) - turn

    return force


def straight_on(table):
    """Return the curve through a table, straight beyond its ends."""
    x, y = np.array(table).T
    inside = PchipInterpolator(x, y)

    def at(place):
        within = min(max(place, x[0]), x[-1])
        return float(inside(within)) + float(inside(within, 1)) * (place - within)

    return at


STOPPED = straight_on(STOP)
TABLE = [[*each] for each in STOP]
SPRING = {"bodies": ["ground", "crank"], "points": [[*HOOK], [*EYE]]}
RUBBER = {"bodies": ["ground", "crank"], "point": [*EYE]}
PUSH = (3.0, 1.0, -2.0)
SLIDING = {"freedoms": ["translation", "rotation"]}
POWERS = [0.0, 0.3, 0.1, -0.05, 0.02]
SUBJECTS = {
    "gear": coupled("gear", {"joints": ["axle", "pin"], "ratio": -1.5}, line(-1.5), slides=False),
    "rack_pinion": coupled("rack_pinion", {"joints": ["pin", "rail"], "radius": 0.2}, line(0.2)),
    "polynomial": coupled(
        "polynomial",
        {"joints": ["rail", "pin"], "coefficients": POWERS, **SLIDING},
        powers(*POWERS),
    ),
    "polynomial of turns": coupled(
        "polynomial",
        {"joints": ["axle", "pin"], "coefficients": POWERS},
        powers(*POWERS),
        slides=False,
    ),
    "spline": coupled(
        "spline",
        {"joints": ["rail", "pin"], "points": [[*each] for each in POINTS], **SLIDING},
        through(POINTS),
    ),
    "spline of turns": coupled(
        "spline",
        {"joints": ["axle", "pin"], "points": [[*each] for each in POINTS]},
        through(POINTS),
        slides=False,
    ),
    # q + 4 s - 2 p = 0 with p = q / 4 of a body without mass
    "linear_coupler": coupled(
        "linear_coupler",
        {
            "joints": ["pin", "rail", "third"],
            "factors": [1.0, 4.0, -2.0],
            "freedoms": ["rotation", "translation", "rotation"],
        },
        line(-0.125),
        more={
            "bodies": {"idler": {}},
            "joints": {"third": joint("revolute", "idler", (0.0, 0.5, 0.0), Y)},
            "couplers": {"quarter": {"type": "gear", "joints": ["third", "pin"], "ratio": 0.25}},
        },
    ),
    "screw": Subject(
        "screw",
        {
            "bodies": {"slide": body(X, OTHER)},
            "joints": {"rail": joint("screw", "slide", X, Z, lead=0.5)},
            "points": {"end": {"body": "slide", "position": [1.0, 0.0, 0.0]}},
            "couplers": {"x": {"type": "gear", "joints": ["rail", "pin"], "ratio": 2.0}},
        },
        line(0.5 / math.pi),
    ),
    "spring": element(
        "spring_damper",
        {**SPRING, "stiffness": 250.0, "free_length": 0.7, "damping": 3.0},
        of_spring(),
        ("stiffness", 10.0, of_spring(260.0)),
    ),
    "spring with stop": element(
        "spring_damper",
        {**SPRING, "free_length": 0.55, "curve": TABLE},
        of_spring(0.0, 0.55, 0.0, STOPPED),
        ("free_length", 0.002, of_spring(0.0, 0.552, 0.0, STOPPED)),
    ),
    "torsion": element(
        "torsion_spring_damper",
        {"joint": "pin", "stiffness": 5.0, "free_angle": 0.1, "damping": 0.3},
        of_clock(),
        ("stiffness", 1.0, of_clock(6.0)),
    ),
    "torsion with stop": element(
        "torsion_spring_damper",
        {"joint": "pin", "curve": [[2.0 * x, force] for x, force in STOP]},
        of_clock(0.0, 0.0, 0.0, straight_on(np.array(STOP) * [2.0, 1.0])),
    ),
    "force": element(
        "force",
        {"body": "crank", "point": [*EYE], "vector": [*PUSH]},
        lambda q, rate: about_y(turned(EYE, q), PUSH),
    ),
    "force with the body": element(
        "force",
        {"body": "crank", "point": [*EYE], "vector": [*PUSH], "frame": "body"},
        lambda q, rate: about_y(EYE, PUSH),
    ),
    "torque": element("torque", {"body": "crank", "vector": [*PUSH]}, lambda q, rate: PUSH[1]),
    "torque with the body": element(
        "torque", {"body": "crank", "vector": [*PUSH], "frame": "body"}, lambda q, rate: PUSH[1]
    ),
    "bushing": element(
        "bushing",
        {
            **RUBBER,
            "stiffness": [0.0, 0.0, 200.0],
            "damping": [0.0, 0.0, 5.0],
            "preload": [0.0, 0.0, 2.0],
            "turning_stiffness": [0.0, 4.0, 0.0],
        },
        of_bushing(4.0, 200.0, 5.0, 2.0),
    ),
    "bushing in angles": element(
        "bushing",
        {**RUBBER, "turning_stiffness": [3.0, 4.0, 5.0], "law": "cardan"},
        of_bushing(4.0, cardan=True),
    ),
    "bushing with stop": element(
        "bushing", {**RUBBER, "curve": [[], [], TABLE]}, of_bushing(curve=STOPPED)
    ),
}


def case_of(subject, **more):
    """Return the keys of a case; the crank has the driver `turn`, unless more says otherwise."""
    crank = body((ARM, 0.0, 0.0), MASS, INERTIA)
    parts = {
        "bodies": {"crank": crank},
        "joints": {"pin": joint("revolute", "crank", ORIGIN, Y)},
        "points": {"tip": {"body": "crank", "position": [ARM, 0.0, 0.0]}},
        "forces": {"clock": {"type": "torsion_spring_damper", "joint": "pin", "stiffness": CLOCK}},
        "drivers": {"turn": {"type": "joint_angle", "joint": "pin"}},
    }
    for name, each in subject.more.items():
        parts[name] = parts.get(name, {}) | each
    head = {
        "schema": "kincheck-case/1",
        "name": "one_freedom",
        "source": "made for this test",
        "gravity": [0.0, 0.0, -G],
    }
    return head | parts | more


def write(folder, subject, **more):
    (file := folder / "case.json").write_text(json.dumps(case_of(subject, **more)))
    return file


def inertia(subject, q):
    """Return M(q), and half its derivative."""
    found, half = MASS * ARM**2 + INERTIA, 0.0
    if subject.follows:
        _, slope, bend = subject.follows(q)
        own = OTHER if subject.slides else OTHER * REACH**2 + OWN
        found, half = found + own * slope**2, own * slope * bend
        if subject.type == "screw":
            found += OWN * 2.0**2
    return found, half


def hold(subject, q, rate=0.0, force=None, without=""):
    """Return V' - Q: the effort that holds the crank, or at a rate without its inertia [N m].

    Args:
        force: generalized force of the element in place of its own.
        without: text that names gravity and force elements that do not act.
    """
    found = 0.0 if "'clock'" in without else CLOCK * q
    if "gravity" not in without:
        found -= MASS * G * ARM * math.cos(q)
        if subject.follows:
            value, slope, _ = subject.follows(q)
            lift = 1.0 if subject.slides else -REACH * math.cos(value)
            found += OTHER * G * lift * slope
    return found if "'x'" in without else found - (force or subject.force)(q, rate)


def effort(subject, q, rate, **more):
    """Return the effort at the crank at a constant rate [N m]; see `hold`."""
    return inertia(subject, q)[1] * rate**2 + hold(subject, q, rate, **more)


def end(subject, q):
    """Return the height of the point `end` of the other body [m], and its derivatives by q."""
    value, slope, bend = subject.follows(q)
    if subject.slides:
        return value, slope, bend
    sine, cosine = math.sin(value), math.cos(value)
    return -REACH * sine, -REACH * cosine * slope, REACH * (sine * slope**2 - cosine * bend)


def tip(q):
    """Return the height of the point `tip` [m], and its derivatives by q."""
    return -ARM * math.sin(q), -ARM * math.cos(q), ARM * math.sin(q)


def resting(subject):
    """Return the angle of rest next to the design [rad]."""
    return brentq(lambda q: hold(subject, q), -0.9, 0.9, xtol=1e-15, rtol=1e-15)


def falling(subject, rate, times):
    """Return the angle of the free crank from rest at design with a rate."""

    def slope(_, state):
        q, speed = state
        whole, half = inertia(subject, q)
        return [speed, -(half * speed**2 + hold(subject, q, speed)) / whole]

    ends = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "t_eval": times, "max_step": 5e-3}
    return solve_ivp(slope, (0.0, times[-1]), [0.0, rate], **ends).y[0]


def types():
    """Return the types that have a subject."""
    return {each.type for each in SUBJECTS.values()}
