"""An engine with a fault of its own for some cases, and the same without faults."""

from .engine_faults import Wrapped

FAULTS = {
    "screw": "position shifted",
    "planar": "acceleration off by ten millionths",
    "gear": "a state",
    "beyond_a_fold": "frozen beyond a fold",
}
"""By case; each is one that engines have had."""


class Sound(Wrapped):
    """The native engine by another name, run in worker processes."""

    name = "sound"
    in_process = False


class Faulty(Sound):
    """Its faults are those of the cases, and two of its manners."""

    name = "faulty"

    def unsupported(self, case):
        return None

    def build(self, case):
        if case.name == "unknown_to_engines":
            raise KeyError("unknown_to_engines")
        return super().build(case)

    def solve(self, model, case, tol):
        self.fault = FAULTS.get(case.name, "")
        return super().solve(model, case, tol)


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
