"""Options of readers: user input beyond the content of the file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from functools import partial
from typing import Any, ClassVar

from ...errors import KincheckError
from ...options import flags_of, option, option_fields, switch
from .readers import CaseOptions, readers

CURVES = "measured curves"
_curves = partial(option, heading=CURVES)


def _options_of_all() -> Any:
    """Return a data class with the options of all readers.

    Raises:
        KincheckError: two of them have an option of the same name.
    """
    kinds = dict.fromkeys([CaseOptions, *(each.options for each in readers())])
    whole = [kind for kind in kinds if not any(kind in other.__mro__[1:] for other in kinds)]
    every = {base for each in whole for base in each.__mro__}
    declared = Counter(name for each in every for name in vars(each).get("__annotations__", ()))
    for each, *_ in (found for kind in whole for found in option_fields(kind)):
        if declared[each.name] > 1:
            raise KincheckError(
                f"{declared[each.name]} readers have an option {each.name!r} of their own. Rename"
                " that of the one that you installed, or uninstall it."
            )
    return make_dataclass("_Options", (), bases=tuple(whole[::-1]), frozen=True)


_Options = _options_of_all()


class Supplied(_Options):  # pyright: ignore[reportUntypedBaseClass]
    """Options of the readers of foreign files, as typed; the readers check them: all options of
    all readers, as `kincheck import --help` lists them.
    """


NOTHING = Supplied()


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
