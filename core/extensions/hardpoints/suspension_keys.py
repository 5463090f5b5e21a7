"""Keys of [suspension] of a case file."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from ...case.io.schema import (
    Flag,
    Length,
    Number,
    Numbers3,
    Points,
    Rods,
    Share,
    Text,
    one_of,
)
from ...case.quantity import Convention
from .suspension import Axle, Reaction, Side

Reactions = Annotated[Reaction, one_of(Reaction)]


class SuspensionKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[suspension]; global at design."""

    convention: Annotated[Convention, one_of(Convention)]
    side: Annotated[Side, one_of(Side)]
    forward: Numbers3
    up: Numbers3
    wheel_center: Text = "wheel_center"
    center_plane: Numbers3 = (0.0, 0.0, 0.0)
    static_toe: Number = 0.0
    static_camber: Number = 0.0
    wheel_axis: Text | None = None
    wheel_radius: Length | None = None
    wheel_contact: Text | None = None
    kingpin: Points | None = None
    kingpin_links: Rods | None = None
    axle: Annotated[Axle, one_of(Axle)] | None = None
    wheelbase: Length | None = None
    cg_height: Length | None = None
    rack_per_turn: Length | None = None
    brakes: Reactions = Reaction.OUTBOARD
    brake_share: Share | None = None
    drive: Reactions = Reaction.INBOARD
    drive_share: Share | None = None
    travel: Text | None = None
    per_travel: Flag = True
    other: dict[str, Any] | None = None


class OtherWheelKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[suspension.other]: the axle's other wheel; omitted keys are equal to the first wheel's."""

    wheel_center: Text
    static_toe: Number | None = None
    static_camber: Number | None = None
    wheel_axis: Text | None = None
    wheel_contact: Text | None = None
    kingpin: Points | None = None
    kingpin_links: Rods | None = None
    travel: Text | None = None
