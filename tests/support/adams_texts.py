"""Datasets of Adams Solver, written from places of parts and markers, and these places by hand."""

import numpy as np
from scipy.spatial.transform import Rotation

UNITS = "UNITS/LENGTH = MILLIMETER, MASS = KILOGRAM, FORCE = NEWTON, TIME = SECOND\n"
MM = 1e-3
AT = np.array([120.0, -40.0, 75.0])
AXES = Rotation.from_euler("ZXZ", [30.0, 50.0, -20.0], degrees=True)
X, Y, Z = AXES.as_matrix().T
HALF = Rotation.from_rotvec(np.pi * X)


class Deck:
    """A dataset in millimetres: ground 1, other parts anywhere, markers where they are wanted."""

    def __init__(self, seed=0, units=UNITS):
        self.rng, self.units = np.random.default_rng(seed), units
        self.parts = {1: (np.zeros(3), Rotation.identity())}
        self.markers = {}
        self.lines = []

    def part(self, number, arguments=""):
        """Add a part in a frame of its own."""
        place = self.rng.uniform(-300.0, 300.0, 3), Rotation.random(random_state=self.rng)
        self.parts[number] = place
        self.lines.append(f"PART/{number}, QG = {row(place[0])}, {euler(place[1])}{arguments}")
        return self

    def marker(self, number, part, at, turn):
        """Add a marker of a part at a global place [mm]."""
        origin, axes = self.parts[part]
        local = axes.inv().apply(np.asarray(at) - origin), axes.inv() * turn
        self.markers[number] = part, *local
        self.lines.append(
            f"MARKER/{number}, PART = {part}, QP = {row(local[0])}, {euler(local[1])}"
        )
        return self

    def joint(self, number, kind, part, other=1, at=AT, axes=AXES):
        """Add a joint of two parts with both markers at one place, I of the first part."""
        i, j = 10 * number + 1, 10 * number + 2
        self.marker(i, part, at, axes).marker(j, other, at, axes)
        return self.add(f"JOINT/{number}, {kind}, I = {i}, J = {j}")

    def add(self, *lines):
        """Add statements."""
        self.lines += lines
        return self

    @property
    def text(self):
        """The dataset."""
        return "A deck\n" + "\n".join([self.units.strip(), "PART/1, GROUND", *self.lines, "END\n"])

    def poses(self, moved, part=2):
        """Origin [m] and Euler parameters of a part after a global motion (shift [mm], turn)."""
        origin, axes = self.parts[part]
        shift, turn, about = moved
        x, y, z, w = (turn * axes).as_quat()
        at = about + turn.apply(origin - about) + shift
        return np.array([[*(MM * at), w, x, y, z]])

    def placed(self, number, poses):
        """Origin [m] and axes, (n, 3) and rotations, of a marker at poses by body."""
        part, at, turn = self.markers[number]
        if part == 1:
            return MM * at, turn
        r, p = poses[f"PART_{part}"]
        axes = Rotation.from_quat(p[:, [1, 2, 3, 0]])
        return r + axes.apply(MM * at), axes * turn


def row(values):
    """Numbers with all digits."""
    return ", ".join(repr(float(x)) for x in values)


def euler(turn):
    """REULER of a rotation, in degrees."""
    angles = turn.as_euler("ZXZ", degrees=True)
    return "REULER = " + ", ".join(f"{float(x)!r}D" for x in angles)


def about(axis, angle):
    return Rotation.from_rotvec(angle * axis)


def jointed(statement, *, of_j=AXES, of_i=AXES, ground_first=False):
    """A deck of one part on the ground, both markers at one place."""
    deck = Deck(3).part(2)
    ends = ((11, 2, of_i), (12, 1, of_j)) if not ground_first else ((11, 1, of_i), (12, 2, of_j))
    for number, part, turn in ends:
        deck.marker(number, part, AT, turn)
    return deck.add(f"{statement}, I = 11, J = 12".replace(", PITCH", ",PITCH"))


def driven(function, kind="ROTATION", joint="REVOLUTE", units=UNITS, start=0.4, offset=0.0):
    deck = Deck(5, units).part(2)
    deck.marker(11, 2, AT + offset * Z, AXES * Rotation.from_euler("z", start))
    deck.marker(12, 1, AT, AXES)
    deck.add(f"JOINT/1, {joint}, I = 11, J = 12")
    return deck.add(f"MOTION/7, {kind}, JOINT = 1", f", FUNCTION = {function}")
