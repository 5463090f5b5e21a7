"""Forces of a planar four-bar of four parallel hinges, written by hand: plane geometry, Newton and
Euler, and the null space of the equilibrium of its bodies. Nothing here comes from the code under
test.

The bars move in the plane of x and z, all hinges are along y, at their own y. The crank turns about
hinge "a" at one radian per second.
"""

import numpy as np

HINGES = {"a": (0.0, 0.0, 0.0), "b": (0.0, 0.0, 0.3), "c": (0.5, 0.0, 0.5), "d": (0.6, 0.0, 0.0)}
BODIES = {"a": ("ground", "crank"), "b": ("crank", "coupler"), "c": ("coupler", "rocker")}
BODIES["d"] = ("rocker", "ground")
CENTERS = {"crank": (0.0, 0.05, 0.15), "coupler": (0.25, 0.02, 0.4), "rocker": (0.55, -0.03, 0.25)}
MASS, INERTIA, GRAVITY = 1.0, 0.1, np.array([0.0, 0.0, -9.81])
Y = np.array([0.0, 1.0, 0.0])


def turned(angle):
    """The rotation about y by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def bars(t):
    """Angle, rate and its derivative of each bar since the design, at the crank's angle."""
    A, B, C, D = (np.array(HINGES[name]) for name in "abcd")
    b, rod, rocker = turned(t) @ (B - A), np.linalg.norm(C - B), np.linalg.norm(C - D)
    across = D - A - b
    distance = np.linalg.norm(across)
    along = (rod**2 - rocker**2 + distance**2) / (2.0 * distance)
    # of the two intersections of the circles the one above the line from b to d, as at design
    normal = np.cross(across, Y) / distance
    c = A + b + along * across / distance + np.sqrt(rod**2 - along**2) * normal

    def angle(now, design):
        return np.arctan2(np.cross(design, now) @ Y, design @ now)

    rod_now, rocker_now = c - A - b, c - D
    matrix = np.column_stack([np.cross(Y, rod_now), -np.cross(Y, rocker_now)])[[0, 2]]
    rates = np.linalg.solve(matrix, -np.cross(Y, b)[[0, 2]])
    pull = b + rates[0] ** 2 * rod_now - rates[1] ** 2 * rocker_now
    seconds = np.linalg.solve(matrix, pull[[0, 2]])
    return {
        "crank": (t, 1.0, 0.0),
        "coupler": (angle(rod_now, C - B), rates[0], seconds[0]),
        "rocker": (angle(rocker_now, C - D), rates[1], seconds[1]),
    }


def forces(t, cross=None):
    """Force and moment of every hinge on its second body, about the hinge, shape (joints, 6), and
    the crank's torque, at its angle: not a number where rigid bodies do not determine them.

    Args:
        cross: direction in the plane, on the rocker, of the second axis of a universal joint in
            place of hinge "c"; the first is along y.
    """
    moved = bars(t)
    places = {"crank": lambda p: turned(t) @ np.array(p)}
    on_rocker = np.array(HINGES["d"])
    places["rocker"] = lambda p: on_rocker + turned(moved["rocker"][0]) @ (np.array(p) - on_rocker)
    pin, pin_now = np.array(HINGES["b"]), places["crank"](HINGES["b"])
    places["coupler"] = lambda p: pin_now + turned(moved["coupler"][0]) @ (np.array(p) - pin)
    now = {"a": np.array(HINGES["a"]), "b": pin_now, "c": places["coupler"](HINGES["c"])}
    now["d"] = on_rocker
    rows = {name: 6 * k for k, name in enumerate(CENTERS)}
    right, centers = np.zeros(18), {}
    for name, center in CENTERS.items():
        _, w, w_t = moved[name]
        pivot, speedup = {
            "crank": (now["a"], np.zeros(3)),
            "coupler": (pin_now, -pin_now),  # the crank turns at one radian per second
            "rocker": (on_rocker, np.zeros(3)),
        }[name]
        centers[name] = places[name](center)
        arm = centers[name] - pivot
        arm[1] = 0.0
        acceleration = speedup + w_t * np.cross(Y, arm) - w**2 * arm
        right[rows[name] :][:3] = MASS * (acceleration - GRAVITY)
        right[rows[name] + 3 :][:3] = INERTIA * w_t * Y
    every = {joint: np.eye(6)[[0, 1, 2, 3, 5]] for joint in BODIES}  # no moment about y
    if cross is not None:
        normal = np.cross(Y, turned(moved["rocker"][0]) @ np.array(cross))
        every["c"] = np.vstack([np.eye(6)[:3], [0.0, 0.0, 0.0, *normal]])
    columns = []
    for joint, (first, second) in BODIES.items():
        for wrench in every[joint]:
            column = np.zeros(18)
            for body, sign in ((first, -1.0), (second, 1.0)):
                if body in rows:
                    force = sign * wrench[:3]
                    lever = now[joint] - centers[body]
                    column[rows[body] :][:3] = force
                    column[rows[body] + 3 :][:3] = sign * wrench[3:] + np.cross(lever, force)
            columns.append(column)
    drive = np.zeros(18)
    drive[rows["crank"] + 4] = 1.0
    matrix = np.column_stack([*columns, drive])
    _, sizes, vh = np.linalg.svd(matrix)
    assert sizes[-1] > 1e-3  # 18 independent equations for more unknowns
    solution, _, _, _ = np.linalg.lstsq(matrix, right)
    reactions, first = np.zeros((4, 6)), 0
    for k, wrenches in enumerate(every.values()):
        own = slice(first, first := first + len(wrenches))
        loose = np.abs(vh[18:, own] @ wrenches).max(axis=0) > 1e-9
        reactions[k] = np.where(loose, np.nan, solution[own] @ wrenches)
    assert np.abs(vh[18:, -1]).max() < 1e-9
    return reactions, solution[-1]
