"""Options of readers: user input beyond the content of the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import ClassVar

from ...options import flags_of, option, option_fields, positive, switch

HARDPOINTS, MODELS, CURVES = "hardpoints", "models", "measured curves"
_hardpoints, _models, _curves = (
    partial(option, heading=heading) for heading in (HARDPOINTS, MODELS, CURVES)
)


@dataclass(frozen=True)
class Supplied:
    """Options of the readers of foreign files, as typed; the readers check them.

    Attributes:
        recorded: whether a recording is there, whose motion a dataset without its own follows.
        bushings: file of the bushings of hardpoints.
    """

    HEADINGS: ClassVar[Mapping[str, str]] = {
        HARDPOINTS: (
            "Suspensions of Project Chrono (.json), Adams/Car (.sub), tables (.csv, .xlsx), trees"
            " (.yaml, .json) and scripts (.m)."
        ),
        MODELS: (
            "Models (MJCF, URDF, SDF, USD, OpenSim), which do not state drivers, and datasets of"
            " Adams (.adm)."
        ),
    }

    template: str | None = _hardpoints(
        "type of suspension, if the file does not state it; kincheck templates prints them",
        metavar="NAME",
    )
    units: str | None = _hardpoints(
        "unit of the coordinates, such as mm or m, if the file does not state it",
        metavar="UNIT",
    )
    axes: str | None = _hardpoints(
        "directions of x, y and z, if the file does not state them: forward,left,up or"
        " rearward,right,up, ...",
        metavar="X,Y,Z",
    )
    travel: str | None = _hardpoints(
        "travel of the wheel, up and down, default 50mm:41; or START:STOP:SAMPLES, positive"
        " up: --travel=-40:120mm:33; in metres without a unit",
        metavar="M[:SAMPLES]",
    )
    side: str | None = _hardpoints(
        "side of the wheel, left or right; without it, the side follows from the points",
        metavar="SIDE",
    )
    names: Path | None = _hardpoints(  # noqa: RUF009
        'names of the points in the file: TOML, with a line ROLE = "NAME" for each; a new FILE'
        " is written",
        Path,
        metavar="FILE",
    )
    ask_names: bool = switch(
        "refuse names that are only like those of the template, with a guess for each",
        heading=HARDPOINTS,
    )
    wheel_radius: str | None = _hardpoints(
        "radius of the loaded wheel, such as 300mm, if no point is its contact: for roll"
        " centre, scrub radius and trail",
        metavar="M",
    )
    wheelbase: str | None = _hardpoints(
        "wheelbase [m], for Ackermann, turning circle and anti-values",
        metavar="M",
    )
    rack_per_turn: str | None = _hardpoints(
        "travel of the rack per turn of the steering wheel [m], for the steering ratio",
        metavar="M",
    )
    axle: str | None = _hardpoints(
        "motion of both wheels, the right one a mirror image of the left, and a rack: heave,"
        " roll or steer, over --travel of the left wheel or of the rack",
        metavar="MOTION",
    )
    rack: str | None = _hardpoints(
        "travel of the rack while the wheel goes up, such as 20mm, positive to the left: -M to"
        " M, or START:STOP; in metres without a unit",
        metavar="M",
    )
    position: str | None = _hardpoints(
        "axle, front or rear, for anti-values; with --wheelbase, --cg-height and a share",
        metavar="AXLE",
    )
    cg_height: str | None = _hardpoints(
        "height of the vehicle's centre of gravity above the road [m]",
        metavar="M",
    )
    brake_share: str | None = _hardpoints(
        "share of the braking force at this axle, 0 to 1",
        metavar="X",
    )
    drive_share: str | None = _hardpoints(
        "share of the driving force at this axle, 0 to 1",
        metavar="X",
    )
    corner: str | None = _hardpoints(
        "wheel of a table of the whole car: FL, FR, RL, RR, or in words",
        metavar="NAME",
    )
    sheet: str | None = _hardpoints(
        "sheet of a workbook with several tables, or section of a tree, such as front",
        metavar="NAME",
    )
    drive: tuple[str, ...] = _models(
        "a joint that moves, as qpos, in rad or m without a unit: knee:-30:30deg:61; several"
        " move together",
        metavar="JOINT:START:STOP[:SAMPLES]",
        several="repeated",
    )
    hold: tuple[str, ...] = _models(
        "joints or free bodies that do not move",
        metavar="NAME",
        several="together",
    )
    hold_rest: bool = switch(
        "hold as many joints as needed: free bodies, joints with an actuator, others",
        heading=MODELS,
    )
    without: tuple[str, ...] = _models(
        "elements of a model to leave out, by tag, name or TAG/NAME, or statements of a dataset"
        " of Adams, as BUSHING or BUSHING/3; a note beside every verdict says so",
        metavar="NAME",
        several="together",
    )
    start: tuple[str, ...] = _models(
        "keyframe:NAME, or JOINT=VALUE, as qpos, in rad or m without a unit, instead of qpos0;"
        " the start is assembled to close, and a note says by how far joints moved",
        metavar="WHERE",
        several="together",
    )
    closure: float | None = option(
        "accept gaps up to X [m] that stem from rounded digits of the file: rows that are"
        " redundant within X are left out; default: [closure] tolerance of a case file, else 0;"
        " for a model, from its digits",
        positive,
        metavar="X",
    )
    recorded: bool = False
    bushings: Path | None = None

    @property
    def given(self) -> list[str]:
        """Names of the given options, as on the command line."""
        values = (getattr(self, each.name) for each in fields(self))
        named = zip(_NAMES, values, strict=True)
        return [name for name, value in named if value and name not in _UNCHECKED]


# not options of files of one kind
_UNCHECKED = ("recorded", "bushings")
_NAMES = tuple(each.name.replace("_", "-") for each in fields(Supplied))
_CORNER = _NAMES.index("corner")
OF_HARDPOINTS, OF_SEVERAL = _NAMES[:_CORNER], _NAMES[_CORNER : _CORNER + 2]
"""Options of all hardpoints, and of files with those of several wheels."""
NOTHING = Supplied()

WITHOUT = "left out by --without: "
"""Begin of the note on what the user leaves out of a model."""
LEFT_OUT = "; left out: "
"""Separator in the source of a case, before the list of omitted content of its file."""


@dataclass(frozen=True)
class CurveOptions:
    """What the user states of a curve."""

    HEADINGS: ClassVar[Mapping[str, str]] = {
        CURVES: "Facts that the file of --reference does not state; for one case."
    }

    columns: Sequence[str] = _curves(
        'output of a column, if its name does not state it: "Toe Angle=toe [deg]"; with the'
        " opposite sign: COLUMN=-OUTPUT",
        metavar="COLUMN=OUTPUT",
        flag="--map",
        several="repeated",
    )
    signs: str | None = _curves(
        "iso8855 or sae_j670, if the file has no comment '# signs: CONVENTION'",
        metavar="CONVENTION",
    )
    accuracy: Sequence[str] = _curves(
        'uncertainty of the measurement, the tolerance of the output: "toe=0.02 deg"; without'
        " a unit in that of the column",
        metavar="OUTPUT=NUMBER UNIT",
        several="repeated",
    )
    citation: str | None = _curves(
        "source of the curve; without it, agreement is not called validated",
        metavar="TEXT",
    )
    sheet: str | None = _curves(
        "sheet of a workbook with several tables",
        metavar="NAME",
        flag="--reference-sheet",
    )
    own_samples: bool = switch(
        "solve at the samples of the curve, instead of interpolating it",
        flag="--at-reference",
        heading=CURVES,
    )

    @property
    def without_curve(self) -> str:
        """The message if there is no curve that they are for; empty without any of them."""
        given = [
            flags_of(each, meaning)[0]
            for each, meaning, _ in option_fields(CurveOptions)
            if meaning is not None and getattr(self, each.name) not in (None, False, (), [])
        ]
        if not given:
            return ""
        return (
            f"{', '.join(given)}: for a measured curve, and there is none; add --reference FILE, or"
            f" leave {'it' if len(given) == 1 else 'them'} out"
        )
