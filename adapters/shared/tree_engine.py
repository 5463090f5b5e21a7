"""Base class of the engines in projection mode whose simulator has a tree of links; see
`tree_model`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.harness.engine import Floor
from ...core.joints import Translational
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Point
from ...core.mechanism.motions import PointCoordinate
from .compiled_floor import Call, floor_of
from .loop_closures import CLOSURES
from .projection_engine import ProjectionEngine
from .tree_model import TreeModel

# The smallest model: one slide with a driven point, so one frame in a condition.
LEAST = Mechanism(
    "slide",
    [Body("slide")],
    [Translational("rail", GROUND, "slide", point=(0.0, 0.0, 0.0), axis=(1.0, 0.0, 0.0))],
    [Point("slide", "slide", (1.0, 0.0, 0.0))],
    [PointCoordinate("stroke", "slide", (1.0, 0.0, 0.0))],
)


class TreeEngine(ProjectionEngine):
    """An engine whose model is a `TreeModel`."""

    joints = CLOSURES

    @property
    def described(self) -> Mapping[str, Any]:
        """Return the coordinates of the tree and the equations of its loops."""
        return {
            "coordinates": f"spanning tree in {self.title}; a joint is a chain of slides, hinges"
            " and balls",
            "closures": "conditions on placements, Jacobians and accelerations of frames",
        }

    @abstractmethod
    def model_of(self, case: Case) -> TreeModel:
        """Return the simulator's model of the unscaled case, at the design position."""

    def build(self, case: Case) -> TreeModel:
        """Return the simulator's model of the case in the scaled frame, at the design position."""
        return self.model_of(self.own(case))

    def floor(self, case: Case) -> Floor:
        """Return the floor from all simulator calls for a pose and its rates."""
        model, least = self.build(case), self.model_of(replace(case, mechanism=LEAST, outputs=()))
        solved = self.solve(model, case, 1e-12)
        n, wanted = len(model.moving), len(model.wanted)
        # the same Python on the smallest model
        least.moving, least.wanted = least.moving * n, least.moving * wanted
        zeros = np.zeros(model.unknowns), np.zeros(least.unknowns)
        pose: dict[str, tuple[Call, Call, int]] = {
            f"placements and Jacobians of {n} frames": (model.observe, least.observe, 1),
        }
        own, empty = zeros
        rates: dict[str, tuple[Call, Call, int]] = {
            f"accelerations of {n} frames": (
                partial(model.observe_rates, own),
                partial(least.observe_rates, empty),
                1,
            ),
            f"motions of {wanted} points": (
                partial(model.points, own, own),
                partial(least.points, empty, empty),
                1,
            ),
        }
        return floor_of(self.name, solved, model.unknowns, pose, rates)
