"""An engine whose simulator gives up, in the case of that name, by a check in its own C++ code."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from .fakes import Fake, solution


def _drake():
    """Break a check of Drake: three positions for a plant that has none."""
    plants: Any = importlib.import_module("pydrake.multibody.plant")
    plant = plants.MultibodyPlant(0.0)
    plant.Finalize()
    plant.SetPositions(plant.CreateDefaultContext(), [0.0, 0.0, 0.0])


def _simbody():
    """Give OpenSim a name that it refuses, too late: the process ends."""
    o: Any = importlib.import_module("opensim")
    model = o.Model()
    model.addBody(o.Body("a b/c", 1.0, o.Vec3(0.0), o.Inertia(1.0)))
    model.initSystem()


@dataclass
class GivingUp(Fake):
    """The fake that gives up.

    Attributes:
        deed: how.
    """

    deeds: ClassVar[dict[str, Callable[[], object]]] = {"drake": _drake, "simbody": _simbody}
    deed: str = "drake"

    def __init__(self, deed):
        super().__init__("giving_up")
        self.deed = deed

    def solve(self, model, case, tol):
        if case.name == "gives_up":
            self.deeds[self.deed]()
        return solution(case)
