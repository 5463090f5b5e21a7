"""The motion of a mechanism along its own length, and the singular poses on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...dataset import Dataset, Variable
from ...errors import number_of
from ...tabular import Tabular
from ...trajectory import Array
from .singularity import Singularity


@dataclass(frozen=True, eq=False)
class Event:
    """A singular pose on a curve.

    Attributes:
        arc: length from the beginning of the curve.
        value: of the driver, from the design position [m or rad].
        singularity: dependent rows, and motions possible with the driver held.
        points: position of the wanted points [m], shape (3,) each.
    """

    arc: float
    value: float
    singularity: Singularity
    points: Mapping[str, Array]

    @property
    def kind(self) -> str:
        """ "limit point" if the driver locks up and turns back; "branch point" if the motion may
        branch.
        """
        return "limit point" if self.singularity.lock_up else "branch point"


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Tabular):
    """The motion of a mechanism along its own length, n poses.

    Attributes:
        driver: its name.
        arc: length from the design position, shape (n,); it falls from zero if the curve was traced
            backwards. The length of a step is the change of all unknowns: displacements in units of
            the mechanism's size, turns in radians.
        values: of the driver, from its design value [m or rad], shape (n,).
        sigma: smallest singular value of the rows, drivers included: distance from a singular pose
            [-], shape (n,).
        points: position by name [m], shape (n, 3).
        events: limit points and branch points, in order.
        closed: whether the curve came back to the design position, which is then the last pose too.
        message: empty, or the reason of an early end.
        unit: of the driver, m or rad.
    """

    driver: str
    arc: Array
    values: Array
    sigma: Array
    points: Mapping[str, Array]
    events: tuple[Event, ...]
    closed: bool
    message: str = ""
    unit: str = ""

    def summary(self) -> str:
        """Return the driver's range, the number of poses, and the singular ones."""
        low, high = self.values.min(initial=np.inf), self.values.max(initial=-np.inf)
        kinds = [each.kind for each in self.events]
        events = [number_of(kinds.count(kind), kind) for kind in dict.fromkeys(kinds)]
        span = f"{self.driver} from {low:.6g} to {high:.6g} {self.unit}".rstrip()
        shape = "closed" if self.closed else "open"
        return ", ".join(filter(None, [span, number_of(len(self.arc), "pose"), shape, *events]))

    def dataset(self) -> Dataset:
        """Return driver, points and distance from singularity over the length of the curve."""
        coords = {
            "arc": Variable("pose", self.arc),
            "point": Variable("point", [*self.points]),
            "axis": Variable("axis", ["x", "y", "z"]),
        }
        variables = {
            self.driver: Variable("pose", self.values, self.unit),
            "smallest_singular_value": Variable("pose", self.sigma),
        }
        if self.points:
            positions = np.stack([*self.points.values()], axis=1)
            variables["position"] = Variable(("pose", "point", "axis"), positions, "m")
        return Dataset(("pose",), coords, variables, "arc")
