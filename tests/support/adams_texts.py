"""Datasets of Adams Solver, written from places of parts and markers, and these places by hand."""

import numpy as np
from scipy.spatial.transform import Rotation

UNITS = "UNITS/LENGTH = MILLIMETER, MASS = KILOGRAM, FORCE = NEWTON, TIME = SECOND\n"
MM = 1e-3


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
