"""A mechanism as Exudyn's bodies and algebraic equations; private to its adapter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from numpy.polynomial import Polynomial

from ...core import joints
from ...core.mechanism.mechanism import Mechanism
from ...core.mechanism.motions import Driver
from .equations import Equations
from .joint_objects import DRIVERS, JOINTS


class Rows(Equations):
    """The equations of all joints, couplers and drivers of a mechanism.

    Attributes:
        owned: the rows of each joint.
    """

    def __init__(self, mbs: Any, items: Any, mechanism: Mechanism, *, loaded: bool = False) -> None:
        super().__init__(mbs, items, mechanism, loaded=loaded)
        self.owned: dict[str, slice] = {}
        for joint in mechanism.joints:
            first = len(self.rows)
            JOINTS[type(joint)](self, joint)
            for relation in joint.relations if isinstance(joint, joints.AxialJoint) else ():
                self.relate([(joint.name, freedom, weight) for freedom, weight in relation.items()])
            self.owned[joint.name] = slice(first, len(self.rows))
        for coupler in mechanism.couplers:
            if coupler.curve:
                self.curve(coupler.terms, coupler.curve)
            else:
                self.relate(coupler.terms)
        for value, driver in enumerate(mechanism.drivers):
            self.drive(driver, value)

    def drive(self, driver: Driver, value: int) -> None:
        """Make the driver's coordinate follow its value."""
        self.follow(DRIVERS[type(driver)](self, driver), value)

    def curve(self, terms: Sequence[tuple[str, str, float]], curve: Sequence[float]) -> None:
        """Make the first coordinate, of weight one, follow the polynomial of the second."""
        (first, freedom, _), (second, other_freedom, weight) = terms
        value = self.unknown()
        self.follow(self.coordinate(second, other_freedom), value)
        bent = -Polynomial(curve) - Polynomial([0.0, weight])
        self.bent.append((self.coordinate(first, freedom), value, bent))

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        """Keep the weighted sum of two coordinates (joint, freedom, weight) at zero."""
        (first, freedom, weight), (second, other_freedom, other) = terms
        value, size = self.unknown(), math.hypot(weight, other)
        self.follow(self.coordinate(first, freedom), value, other / size)
        self.follow(self.coordinate(second, other_freedom), value, -weight / size)
