"""Options of hardpoints: what files of points leave open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

from ...case.io.readers import ReaderOptions
from ...options import option, switch

HARDPOINTS = "hardpoints"
_option = partial(option, heading=HARDPOINTS)


@dataclass(frozen=True)
class HardpointOptions(ReaderOptions):
    """Options of all hardpoints.

    Attributes:
        bushings: file of their bushings.
    """

    HEADINGS: ClassVar[Mapping[str, str]] = {
        HARDPOINTS: (
            "Suspensions of Project Chrono (.json), Adams/Car (.sub), tables (.csv, .xlsx), trees"
            " (.yaml, .json) and scripts (.m)."
        ),
    }

    template: str | None = _option(
        "type of suspension, if the file does not state it, as kincheck templates prints them",
        metavar="NAME",
    )
    units: str | None = _option(
        "unit of the coordinates, such as mm or m, if the file does not state it",
        metavar="UNIT",
    )
    axes: str | None = _option(
        "directions of x, y and z, if the file does not state them: forward,left,up or"
        " rearward,right,up, ...",
        metavar="X,Y,Z",
    )
    travel: str | None = _option(
        "travel of the wheel, up and down, default 50mm:41, or START:STOP:SAMPLES, positive"
        " up: --travel=-40:120mm:33. In metres without a unit",
        metavar="M[:SAMPLES]",
    )
    side: str | None = _option(
        "side of the wheel, left or right. Without it, the side follows from the points",
        metavar="SIDE",
    )
    names: Path | None = _option(  # noqa: RUF009
        'names of the points in the file: TOML, with a line ROLE = "NAME" for each. A new FILE'
        " is written",
        Path,
        metavar="FILE",
    )
    ask_names: bool = switch(
        "refuse names that are only like those of the template, with a guess for each",
        heading=HARDPOINTS,
    )
    wheel_radius: str | None = _option(
        "radius of the loaded wheel, such as 300mm, if no point is its contact: for roll"
        " centre, scrub radius and trail",
        metavar="M",
    )
    wheelbase: str | None = _option(
        "wheelbase [m], for Ackermann, turning circle and anti-values",
        metavar="M",
    )
    rack_per_turn: str | None = _option(
        "travel of the rack per turn of the steering wheel [m], for the steering ratio",
        metavar="M",
    )
    axle: str | None = _option(
        "motion of both wheels, the right one a mirror image of the left, and a rack: heave,"
        " roll or steer, over --travel of the left wheel or of the rack",
        metavar="MOTION",
    )
    rack: str | None = _option(
        "travel of the rack while the wheel goes up, such as 20mm, positive to the left: -M to"
        " M, or START:STOP. In metres without a unit",
        metavar="M",
    )
    position: str | None = _option(
        "axle, front or rear, for anti-values, with --wheelbase, --cg-height and a share",
        metavar="AXLE",
    )
    cg_height: str | None = _option(
        "height of the vehicle's centre of gravity above the road [m]",
        metavar="M",
    )
    brake_share: str | None = _option(
        "share of the braking force at this axle, 0 to 1",
        metavar="X",
    )
    drive_share: str | None = _option(
        "share of the driving force at this axle, 0 to 1",
        metavar="X",
    )
    swing_arms: bool = switch(
        "add the instant centres and swing arms in the views from the front and from the side to"
        " the outputs: length, angle and coordinates",
        heading=HARDPOINTS,
    )
    bushings: Path | None = None


@dataclass(frozen=True)
class WheelOptions(HardpointOptions):
    """Options of files with the hardpoints of several wheels."""

    corner: str | None = _option(
        "wheel of a table of the whole car: FL, FR, RL, RR, or in words",
        metavar="NAME",
    )
    sheet: str | None = _option(
        "sheet of a workbook with several tables, or section of a tree, such as front",
        metavar="NAME",
    )


NOTHING = WheelOptions()
