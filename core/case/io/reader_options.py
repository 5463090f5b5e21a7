"""What a user says beside a file, because the file does not say it."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Supplied:
    """Options of the readers of foreign files, as they were typed; the readers check them.

    Attributes:
        template: the suspension template that hardpoints go onto.
        units: of the coordinates in a file of hardpoints: "mm", "m", ...
        axes: where x, y and z point in a file of hardpoints: "forward,left,up", ...
        travel: how far the wheel of a suspension goes up and down: "METRES" or "METRES:SAMPLES".
        drive: the joint of a model that is driven: "JOINT:START:STOP" or
            "JOINT:START:STOP:SAMPLES", in its coordinate [rad, m].
        hold: joints or free bodies of a model that are held where they are.
    """

    template: str | None = None
    units: str | None = None
    axes: str | None = None
    travel: str | None = None
    drive: tuple[str, ...] = ()
    hold: tuple[str, ...] = ()

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the options that were given."""
        return tuple(each.name for each in fields(self) if getattr(self, each.name))


NOTHING = Supplied()

LEFT_OUT = "; left out: "
"""Stands in the source of a case before what its file holds and the case does not."""
