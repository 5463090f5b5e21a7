"""The strut of cases/mcpherson_suspension.toml in 60 digits, by other means than any engine or
output of kincheck.

The knuckle's pose is six numbers that close two rods, a line and the stroke; outputs come from its
rotation matrix and from differences of poses over steps so small that only digits beyond the
fortieth know of them. The file's CSV was made with `rows`.
"""

from functools import cache

from mpmath import mp, mpf

mp.dps = 60
STEP = mpf("1e-12")  # squared it is what differences are off by

P, L, U, K = (
    [mpf(x) for x in each.split()]
    for each in ("1.17 0.353 0.005", "0.9676 0.66 -0.01", "1 0.55 0.6", "0.97772 0.605 0.18")
)
T, R, W = (
    [mpf(x) for x in each.split()]
    for each in ("1.115 0.665 0.118", "1.14 0.355 0.1455", "0.975 0.715 0.101")
)
RADIUS, WHEELBASE, CG, BRAKES = mpf("0.3"), mpf("2.6"), mpf("0.55"), mpf("0.7")


def sub(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return mp.fsum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Pose:
    """The knuckle moved by d and turned by the Cayley vector c about its wheel centre."""

    def __init__(self, unknowns):
        self.d, self.c = list(unknowns[:3]), list(unknowns[3:])

    def turn(self, a):
        """A direction fixed to the knuckle."""
        c, k = self.c, 2 / (1 + dot(self.c, self.c))
        once = cross(c, a)
        return [x + k * (y + z) for x, y, z in zip(a, once, cross(c, once), strict=True)]

    def place(self, p):
        """A point fixed to the knuckle."""
        return [x + y + z for x, y, z in zip(W, self.d, self.turn(sub(p, W)), strict=True)]


@cache
def pose(stroke):
    """The knuckle where the wheel centre has risen by the stroke."""

    def closed(*unknowns):
        k = Pose(unknowns)
        ball, foot, axis = k.place(L), k.place(K), k.turn(sub(U, K))
        # two of its three components say that the line meets the top
        missed = cross(axis, sub(U, foot))
        arm, rod = sub(ball, P), sub(k.place(T), R)
        return [
            k.d[2] - stroke,
            ball[0] - L[0],
            dot(arm, arm) - dot(sub(L, P), sub(L, P)),
            missed[0],
            missed[1],
            dot(rod, rod) - dot(sub(T, R), sub(T, R)),
        ]

    start = [0, 0, stroke, 0, 0, 0]
    return Pose(mp.findroot(closed, start, tol=mpf("1e-100")))


def level_with(k):
    """Contact centre: down from the wheel centre along the steepest line of the wheel plane."""
    s, up = k.turn([0, 1, 0]), [0, 0, 1]
    fall = sub([dot(up, s) * x for x in s], up)
    return [
        x + RADIUS * y / mp.sqrt(dot(fall, fall)) for x, y in zip(k.place(W), fall, strict=True)
    ]


def attitudes(stroke):
    """Outputs of the pose alone; x of the frame is rearward, y outboard."""
    k = pose(stroke)
    s, contact, center = k.turn([0, 1, 0]), level_with(k), k.place(W)
    # in the wheel plane and in the road plane; rearward is positive x, so this points forward
    front = cross([0, 0, 1], s)
    length = mp.sqrt(dot(front, front))
    ball = k.place(L)
    share = (contact[2] - ball[2]) / (U[2] - ball[2])
    meets = [a + share * (b - a) for a, b in zip(ball, U, strict=True)]
    offset = sub(meets, contact)
    return {
        "toe": mp.asin(-front[1] / length),
        "camber": mp.asin(-s[2]),
        "steer_angle": mp.asin(-front[1] / length),
        "half_track_change": contact[1] - W[1],
        "wheelbase_change": -(contact[0] - W[0]),
        "wheel_center_y": -(center[1] - W[1]),
        "caster": mp.atan((U[0] - ball[0]) / (U[2] - ball[2])),
        "kingpin_inclination": mp.atan((ball[1] - U[1]) / (U[2] - ball[2])),
        "scrub_radius": -dot(offset, [s[0], s[1], 0]) / mp.sqrt(s[0] ** 2 + s[1] ** 2),
        "mechanical_trail": dot(offset, front) / length,
    }


def ratios(stroke):
    """Outputs of the way the knuckle goes."""
    here, before, after = (pose(stroke + step) for step in (0, -STEP, STEP))
    contact = level_with(here)
    # the knuckle's point that is at the contact now: its design position, then where that goes
    arm = sub(contact, here.place(W))
    back = Pose([*here.d, *(-x for x in here.c)]).turn(arm)
    material = [x + y for x, y in zip(W, back, strict=True)]
    v = [
        (b - a) / (2 * STEP)
        for a, b in zip(before.place(material), after.place(material), strict=True)
    ]
    strut = [mp.sqrt(dot(sub(U, k.place(K)), sub(U, k.place(K)))) for k in (before, after)]
    return {
        "motion_ratio": (strut[0] - strut[1]) / (2 * STEP),
        "roll_center_height": contact[1] * v[1] / v[2],
        "anti_dive": BRAKES * WHEELBASE / CG * -v[0] / v[2],
    }


def rows(strokes):
    """Value and derivatives by the stroke of every output, under the names that columns of a
    reference have.
    """
    for stroke in strokes:
        row = {"stroke": stroke}
        for outputs, step, orders in ((attitudes, STEP, 2), (ratios, mpf("1e-11"), 1)):
            before, here, after = (outputs(stroke + k * step) for k in (-1, 0, 1))
            for name, value in here.items():
                first = (after[name] - before[name]) / (2 * step)
                row |= {name: value, f"{name}.velocity": first, f"{name}.per_travel": first}
                if orders == 2:
                    second = (after[name] - 2 * value + before[name]) / step**2
                    row |= {f"{name}.acceleration": second, f"{name}.per_travel.velocity": second}
        yield row
