"""A dataset in its start: places of parts, markers, and coordinates of joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ....joints.base import AxialJoint
from ....trajectory import Array
from .dataset import Dataset, Statement
from .parts import Frame, Marker, Places, Units, body_name


@dataclass(frozen=True, eq=False)
class Model:
    """Parts and markers of a dataset.

    Attributes:
        places: frames of the parts, global; those of the start once it is assembled.
    """

    dataset: Dataset
    units: Units
    places: Places
    ground: int
    markers: Mapping[int, Marker]

    def frame(self, marker: Marker) -> Frame:
        """Return the frame of a marker, global."""
        return marker.place.seen_from(self.places[marker.part])

    def body(self, marker: Marker) -> str:
        """Return the name of a marker's body."""
        return body_name(marker.part, self.ground)

    def marker(self, owner: Statement, name: str, wanted: int | None = None) -> Marker:
        """Return the marker of an argument, or of an identifier in it.

        Raises:
            CaseError: it is missing, or on no part.
        """
        wanted = self.dataset.one_id(owner, name) if wanted is None else wanted
        self.dataset.member(owner, name, "MARKER", wanted)
        if wanted not in self.markers:
            raise owner.fault(
                f"{name} = {wanted}: found a floating marker or one on no part, expected one that"
                " is fixed on a part; name another"
            )
        return self.markers[wanted]

    def ends(self, owner: Statement) -> tuple[Marker, Marker]:
        """Return the markers I and J; see `marker`."""
        return self.marker(owner, "I"), self.marker(owner, "J")

    def require_x(self, owner: Statement, *markers: Marker) -> None:
        """Refuse markers whose x axis is not stated."""
        for marker in markers:
            if not marker.place.turned:
                raise owner.fault(
                    f"the x axis of {marker} is not stated, but needed; add XP or REULER to it"
                )

    def turn(self, i: Marker, j: Marker) -> float:
        """Return the turn of marker I from J about z [rad]; zero if an x axis is not stated."""
        one, other = self.frame(i), self.frame(j)
        known = i.place.turned and j.place.turned
        return math.atan2(float(one.x @ other.y), float(one.x @ other.x)) if known else 0.0

    def slide(self, i: Marker, j: Marker) -> float:
        """Return the displacement of marker I from J along z [m]."""
        return float((self.frame(i).origin - self.frame(j).origin) @ self.frame(j).z)


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of a joint, to drive and to couple.

    Attributes:
        name: of the joint, with the freedom if it has several.
        value: turn or displacement of I from J at the start [rad, m].
    """

    name: str
    joint: AxialJoint
    freedom: str
    value: float

    @property
    def turns(self) -> bool:
        """Whether it is an angle."""
        return self.freedom == "rotation"

    @property
    def axis(self) -> Array:
        """The axis of its joint, of length one, shape (3,)."""
        return np.array(self.joint.axis) / np.linalg.norm(self.joint.axis)
