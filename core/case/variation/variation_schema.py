"""The keys of a variation file, schema kincheck-vary/1, TOML or JSON.

Reference. Keys in brackets may be left out.

    schema = "kincheck-vary/1"
    mode                 "monte_carlo": random variants, as many as --samples states
                         "grid": every combination of all values
                         "one_at_a_time": the nominal design, then each coordinate by itself at
                         each of its values
    [units]              length = "m" or "mm", required if a position or length varies: no default
                         is safe
                         (angle) = "rad" or "deg", of directions
    [hardpoints.NAME]    at: a position, direction or length of the case:
                         "joints.tie_rod.points.0", "joints.hinge.axis", "joints.rod.length",
                         "points.wheel_center.position"; or the name of a joint or point with
                         one position only: "ball". Every place of the case at the same point at
                         design moves along, so a ball and the rod that ends in it stay
                         together; markers of a wheel's rotation move with its centre.
                         (only) = ["joints.ball.point", ...]: just these of them
                         sigma, or half_width, or values: a number for all three coordinates or
                         three numbers; 0 does not vary
                         monte_carlo: sigma (normal) or half_width (uniform)
                         grid: values = [-1, 0, 1], offsets for each coordinate, or three such
                         lists; or half_width and steps, the number of values from -half_width
                         to half_width
                         one_at_a_time: values, or half_width (both ends; with steps, as in a
                         grid), or sigma (both sides)
                         offsets are along the case's axes; those of a direction, taken at
                         length one, are angles
    [lines.NAME]         axis = "joints.strut_slide.axis", through = ["strut_foot", "strut_top"]:
                         a direction through two positions as they vary; named like `at`. Other
                         directions do not change.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from .variation import Mode

SCHEMA = "kincheck-vary/1"
MOST_STEPS = 10_000

Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]
Size = Annotated[float, Meta(ge=0.0)]
# a list, not a tuple: converting to a number or a tuple of constrained numbers, msgspec 0.22
# crashes
Sizes = Annotated[
    Size | Annotated[list[Size], Meta(min_length=3, max_length=3)],
    Meta(description="a number that is not negative, or three [x, y, z]"),
]
Offsets = Annotated[
    list[float | list[float]],
    Meta(description="a list of offsets, or three such [[x, ...], [y, ...], [z, ...]]"),
]
Steps = Annotated[
    int, Meta(ge=2, le=MOST_STEPS, description=f"a whole number of values, 2 to {MOST_STEPS}")
]


class VaryKeys(msgspec.Struct, forbid_unknown_fields=True):
    """The tables of the file."""

    schema: Annotated[str, Meta(description=f'"{SCHEMA}"')]
    mode: Annotated[Mode, Meta(description=f"one of {', '.join(Mode)}")]
    hardpoints: Annotated[
        dict[str, Any], Meta(min_length=1, description="a table of at least one hardpoint")
    ]
    units: Annotated[dict[str, Any], Meta(description="a table")] = {}
    lines: Annotated[dict[str, Any], Meta(description="a table")] = {}


class VaryUnits(msgspec.Struct, forbid_unknown_fields=True):
    """[units] of the offsets."""

    length: Annotated[Literal["m", "mm"], Meta(description='"m" or "mm"')] | None = None
    angle: Annotated[Literal["rad", "deg"], Meta(description='"rad" or "deg"')] = "rad"


class HardpointKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[hardpoints.NAME]."""

    at: Text
    only: (
        Annotated[tuple[Text, ...], Meta(min_length=1, description="a list of places of the case")]
        | None
    ) = None
    sigma: Sizes | None = None
    half_width: Sizes | None = None
    values: Offsets | None = None
    steps: Steps | None = None


class LineKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[lines.NAME]."""

    axis: Text
    through: Annotated[
        tuple[Text, Text], Meta(description='two names ["first position", "second position"]')
    ]
