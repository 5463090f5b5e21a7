"""An engine with a fault of its own for some cases, and the same without faults."""

from dataclasses import dataclass

import kincheck.adapters
import numpy as np
from kincheck.core.trajectory import PointMotion


@dataclass
class Sound:
    """The native engine by another name, run in worker processes."""

    name = "sound"
    mode = "projection"
    loop = "python"

    def __post_init__(self):
        self.settings = {}
        self.native = kincheck.adapters.engine("native")

    def version(self):
        return "1.0"

    def unsupported(self, case):
        known = case.mechanism.joints[1].type != "unknown_to_engines"
        return None if known else "joint 'tested' is of an unknown type"

    def build(self, case):
        return self.native.build(case)

    def solve(self, model, case, tol):
        return self.native.solve(model, case, tol)


class Faulty(Sound):
    """Each fault is one that engines have had."""

    name = "faulty"
    solved = 0

    def unsupported(self, case):
        return None

    def build(self, case):
        if case.name == "unknown_to_engines":
            raise KeyError("unknown_to_engines")
        return super().build(case)

    def solve(self, model, case, tol):
        found = super().solve(model, case, tol)
        self.solved += 1
        if case.name == "screw":  # a wrong position, with the rates of the right one
            return _moved(found, lambda p, v, a: (p + 1e-6, v, a))
        if case.name == "planar":  # a wrong acceleration
            return _moved(found, lambda p, v, a: (p, v, a * (1.0 + 1e-5)))
        if case.name == "gear":  # a state that outlives the case
            return _moved(found, lambda p, v, a: (p + 1e-15 * self.solved, v, a))
        if case.name == "beyond_a_fold":  # the last pose, for all that cannot be reached
            return _called_solved(_moved(found, lambda *each: tuple(map(np.nan_to_num, each))))
        return found


def _moved(found, change):
    points = {
        name: PointMotion(*change(each.position, each.velocity, each.acceleration))
        for name, each in found.points.items()
    }
    return type(found)(
        points, found.solved, found.iterations, found.residual, found.message, found.details
    )


def _called_solved(found):
    solved = np.ones_like(found.solved)
    return type(found)(found.points, solved, found.iterations, found.residual, "", found.details)


class Shy(Sound):
    """Not installed."""

    name = "shy"

    def version(self):
        return None


class Odd(Sound):
    """Outside the protocol."""

    name = "odd"
    mode = "magic"

    def __reduce__(self):
        raise TypeError("no")
