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
    [hardpoints.NAME]    at: of a table of hardpoints, the name of a row, or its role in the
                         template: "lca_front". All that follows from the row moves as if it
                         were moved in the table: joints, axes through it, wheel radius, the other
                         side of an axle.
                         Of another case: a position, direction or length:
                         "joints.tie_rod.points.0", "joints.hinge.axis", "joints.rod.length",
                         "points.wheel_center.position"; or the name of a joint or point with
                         one position only: "ball". Every position of the case at the same point at
                         design moves along, so a ball stays at the end of its rod or spring;
                         markers of a wheel's rotation move with its centre.
                         Such names also find the rows of a table.
                         Or a number of the masses and loads: "bodies.knuckle.mass",
                         "forces.spring.stiffness", damping, free_length or free_angle; or
                         "bodies.knuckle.center_of_mass", which moves alone
                         (only) = ["joints.ball.point", ...]: just these of all that moves
                         sigma, or half_width, or values: a number for all three coordinates or
                         three numbers; 0 does not vary
                         monte_carlo: sigma (normal) or half_width (uniform); or distribution =
                         "truncated_normal" with sigma, and half_width as the largest offset, or
                         "triangular" with half_width, most frequent at the nominal value
                         grid: values = [-1, 0, 1], offsets for each coordinate, or three such
                         lists; or half_width and steps, the number of values from -half_width
                         to half_width
                         one_at_a_time: values, or half_width (both ends; with steps, as in a
                         grid), or sigma (both sides)
                         offsets are along the axes of the case, or of its table; the offsets of a
                         direction, scaled to length one, are angles. Masses are in kg; stiffness
                         and damping in N and s with the units of length and angle, as in a case
                         file
    [lines.NAME]         axis = "joints.strut_slide.axis", through = ["strut_foot", "strut_top"]:
                         a direction through two positions as they vary; named like `at`. Other
                         directions do not change.
    [limits.OUTPUT]      low, high: the specification limits of an output, one or both, in the
                         file's units of length and angle (default: the case's units), N and s; the
                         study counts the variants inside the limits at every sample. OUTPUT may be
                         a rate: [limits."camber.velocity"]
    [correlations.NAME]  monte_carlo: coordinates = ["ball.x", "ball.y"], of [hardpoints.ball];
                         matrix = [[1, 0.8], [0.8, 1]]: their correlations, by a Gaussian copula.
                         A coordinate is in one table at most
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from .study_choices import Mode

SCHEMA = "kincheck-vary/1"
MOST_STEPS = 10_000

Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]
Size = Annotated[float, Meta(ge=0.0)]
# a list, not a tuple: msgspec 0.22 crashes on a number or a tuple of constrained numbers
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


Drawn = Literal["normal", "uniform", "truncated_normal", "triangular"]


class VaryKeys(msgspec.Struct, forbid_unknown_fields=True):
    """The tables of the file."""

    schema: Annotated[str, Meta(description=f'"{SCHEMA}"')]
    mode: Annotated[Mode, Meta(description=f"one of {', '.join(Mode)}")]
    hardpoints: Annotated[
        dict[str, Any], Meta(min_length=1, description="a table of at least one hardpoint")
    ]
    units: Annotated[dict[str, Any], Meta(description="a table")] = {}
    lines: Annotated[dict[str, Any], Meta(description="a table")] = {}
    limits: Annotated[dict[str, Any], Meta(description="a table")] = {}
    correlations: Annotated[dict[str, Any], Meta(description="a table")] = {}


class VaryUnits(msgspec.Struct, forbid_unknown_fields=True):
    """[units] of the offsets and limits."""

    length: Annotated[Literal["m", "mm"], Meta(description='"m" or "mm"')] | None = None
    angle: Annotated[Literal["rad", "deg"], Meta(description='"rad" or "deg"')] | None = None


class HardpointKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[hardpoints.NAME]."""

    at: Text
    only: (
        Annotated[tuple[Text, ...], Meta(min_length=1, description="a list of places of the case")]
        | None
    ) = None
    sigma: Sizes | None = None
    half_width: Sizes | None = None
    distribution: (
        Annotated[
            Drawn,
            Meta(description='"normal", "uniform", "truncated_normal" or "triangular"'),
        ]
        | None
    ) = None
    values: Offsets | None = None
    steps: Steps | None = None


class LineKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[lines.NAME]."""

    axis: Text
    through: Annotated[
        tuple[Text, Text], Meta(description='two names ["first position", "second position"]')
    ]


class LimitKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[limits.OUTPUT]."""

    low: Annotated[float, Meta(description="a number")] | None = None
    high: Annotated[float, Meta(description="a number")] | None = None


class CorrelationKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[correlations.NAME]."""

    coordinates: Annotated[
        list[Text], Meta(min_length=2, description="a list of at least two coordinates")
    ]
    matrix: Annotated[
        list[list[float]], Meta(description="a matrix of correlations [[1, r], [r, 1]]")
    ]


def variation_schema() -> dict[str, Any]:
    """Return the schema of variation files."""
    from ...case.io.catalogue import document_schema

    tables = {
        "hardpoints": HardpointKeys,
        "lines": LineKeys,
        "limits": LimitKeys,
        "correlations": CorrelationKeys,
    }
    return document_schema(SCHEMA, VaryKeys, tables, {"units": VaryUnits})
