"""Drivers and relations as coordinate constraints for Exudyn's own solvers; private to its adapter.

A generic joint with a moving offset has no rate, so driven coordinates are constraints on Exudyn's
relative coordinates of two bodies, and so are the relations of screws, gears, racks and pinions.
The drivers' values come from Python, from a table prepared beforehand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.joints.base import unit
from ...core.mechanism.mechanism import GROUND
from ...core.mechanism.motions import Driver, JointDriver, PointCoordinate
from .rows import Rows


class DriverTable:
    """Values and rates of the drivers at every step of a leg, which Exudyn reads at its time."""

    def __init__(self) -> None:
        self.per_second, self.rows = 1.0, list[list[list[float]]]()

    def reader(self, order: int, value: int) -> Any:
        """Return a user function of Exudyn for one driver and order of derivative."""

        def at(mbs: Any, t: float, number: int, offset: float) -> float:
            return self.rows[order][value][round(t * self.per_second)]

        return at


class Coordinates(Rows):
    """The rows, with drivers and relations for Exudyn's own solvers.

    Attributes:
        angles: driver number of each relative angle, or None; the turns of these angles are
            counted.
    """

    def __init__(self, mbs: Any, items: Any, case: Case, table: DriverTable) -> None:
        self.table = table
        self.angles: list[int | None] = []
        super().__init__(mbs, items, case.mechanism)

    def relative(self, name: str, freedom: str, value: int | None = None) -> int:
        """Return a new marker for the coordinate of a joint."""
        joint: Any = self.mechanism.joint(name)
        if freedom == "translation":
            return self.shift(joint.i, joint.j, joint.point, joint.axis)
        (i, _), (j, _) = (self.bodies[body] for body in joint.bodies)
        node = self.mbs.AddNode(
            self.items.NodeGenericData(initialCoordinates=[0.0], numberOfDataCoordinates=1)
        )
        self.angles.append(value)
        axis = [*unit(joint.axis)]
        marker = self.items.MarkerBodiesRelativeRotationCoordinate(
            bodyNumbers=[i, j], nodeNumber=node, axis0=axis
        )
        return self.mbs.AddMarker(marker)

    def shift(self, i: str, j: str, point: Sequence[float], axis: Sequence[float]) -> int:
        """Return a new marker for the displacement of a point of body j along an axis of body i."""
        numbers, origins = zip(*(self.bodies[body] for body in (i, j)), strict=True)
        arms = [np.subtract(point, origin) for origin in origins]
        marker = self.items.MarkerBodiesRelativeTranslationCoordinate(
            bodyNumbers=[*numbers],
            localPosition0=arms[0],
            localPosition1=arms[1],
            axis0=[*unit(axis)],
        )
        return self.mbs.AddMarker(marker)

    def drive(self, driver: Driver, value: int) -> None:
        if isinstance(driver, PointCoordinate):
            point = self.mechanism.point(driver.point)
            marker = self.shift(GROUND, point.body, point.position, driver.direction)
        else:
            assert isinstance(driver, JointDriver)
            marker = self.relative(driver.joint, driver.freedom, value)
        still = self.mbs.AddNode(self.items.NodePointGround())
        rest = self.mbs.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=still, coordinate=0))
        self.connect(
            self.items.ObjectConnectorCoordinate(
                markerNumbers=[rest, marker],
                offset=1.0,
                offsetUserFunction=self.table.reader(0, value),
                offsetUserFunction_t=self.table.reader(1, value),
            ),
            range(1),
        )

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        (one, large), (other, small) = sorted(
            ((self.relative(joint, freedom), weight) for joint, freedom, weight in terms),
            key=lambda term: -abs(term[1]),
        )
        self.connect(
            self.items.ObjectConnectorCoordinate(
                markerNumbers=[other, one], factor1=-large / small
            ),
            range(1),
        )
