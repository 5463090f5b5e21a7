"""Options of readers: user input beyond the content of the file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path


@dataclass(frozen=True)
class Supplied:
    """Options of the readers of foreign files, as typed; the readers check them.

    Attributes:
        template: suspension template of the hardpoints.
        units: unit of the coordinates in a file of hardpoints: "mm", "m", ...
        axes: directions of x, y and z in a file of hardpoints: "forward,left,up", ...
        travel: wheel travel of a suspension, up and down: "METRES", "METRES:SAMPLES" or
            "START:STOP:SAMPLES".
        rack: simultaneous travel of the rack to the left: "METRES" or "START:STOP".
        ask_names: whether to refuse names of hardpoints that are guessed.
        side: side of the wheel of hardpoints, "left" or "right"; by default from the points.
        corner: corner of a car of which hardpoints are read: "FL", "rear right", ...
        sheet: sheet of a workbook with several tables.
        names: file of the user's own names of hardpoints, by role of the template; written if new.
        wheel_radius: loaded radius of the wheel of hardpoints [m].
        wheelbase: wheelbase of the vehicle of hardpoints [m].
        axle: motion of both wheels of hardpoints: "heave", "roll" or "steer".
        position: axle of hardpoints, "front" or "rear", for anti-values.
        cg_height: height of the centre of gravity of the vehicle of hardpoints above the road [m].
        rack_per_turn: travel of the rack per turn of the steering wheel [m].
        brake_share, drive_share: shares of the vehicle's forces at the axle of hardpoints [-].
        drive: driven joints of a model: "JOINT:START:STOP" or "JOINT:START:STOP:SAMPLES", in their
            coordinates [rad, m].
        hold: joints or free bodies of a model to hold in place.
        hold_rest: whether to hold further joints of a model as needed.
        start: start of a model: "keyframe:NAME", "JOINT=VALUE" [rad, m].
        without: elements of a model to leave out, by tag, name or TAG/NAME, or statements of a
            dataset of Adams that force the motion: KIND or KIND/id.
        recorded: whether a recording is there, whose motion a dataset without its own follows.
        bushings: file of the bushings of hardpoints.
        closure: tolerance of rows redundant but for the digits of a file [m].
    """

    template: str | None = None
    units: str | None = None
    axes: str | None = None
    travel: str | None = None
    rack: str | None = None
    names: Path | None = None
    wheel_radius: str | None = None
    wheelbase: str | None = None
    axle: str | None = None
    position: str | None = None
    cg_height: str | None = None
    rack_per_turn: str | None = None
    brake_share: str | None = None
    drive_share: str | None = None
    ask_names: bool = False
    side: str | None = None
    corner: str | None = None
    sheet: str | None = None
    drive: tuple[str, ...] = ()
    hold: tuple[str, ...] = ()
    hold_rest: bool = False
    start: tuple[str, ...] = ()
    closure: float | None = None
    without: tuple[str, ...] = ()
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
