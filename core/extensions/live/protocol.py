"""Messages of the live page as JSON: questions of a page, and answers of the server.

Lengths of points are in the unit and along the axes of the file; everything else is SI.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

VERSION = 1
LARGEST_MESSAGE = 64_000
"""Largest message of a page [bytes]: hundreds of points take less."""
MOST_MESSAGES = 1_000
"""Most messages of a page in a second: a page asks again after an answer, and a hand makes 100."""
MOST_POINTS = 1_000

Number: TypeAlias = Annotated[float, msgspec.Meta(ge=-1e100, le=1e100)]
"""A number that can be squared; the reader judges its size."""
Identifier: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Rows: TypeAlias = Annotated[
    list[tuple[Number, Number, Number]], msgspec.Meta(max_length=MOST_POINTS)
]
"""The points of a table in its order."""
Name: TypeAlias = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
Values: TypeAlias = Sequence[float | None]
"""Numbers that are not known are NaN, which JSON has as null."""


class _Message(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag=str.lower,
):
    """A message; its answers carry the same number."""

    id: Identifier = 0


class Solve(_Message, frozen=True):
    """Solve a table with these points.

    Attributes:
        whole: whether samples beyond a step that has to be divided are wanted, which takes longer.
    """

    points: Rows
    whole: bool = True


class Read(_Message, frozen=True):
    """Read a text typed for a coordinate that the page takes for no number."""

    point: Name
    axis: Literal["x", "y", "z"]
    text: Annotated[str, msgspec.Meta(max_length=200)]


class Rank(_Message, frozen=True):
    """Find the effect of each number of a table on an output."""

    points: Rows
    output: Name


class Move(_Message, frozen=True):
    """Move a mechanism straight from its design to these values of its drivers [m or rad].

    Attributes:
        measured: whether reactions and the distance from a singular pose are wanted, which takes
            longer.
    """

    drivers: Annotated[dict[Name, Number], msgspec.Meta(max_length=100)]
    measured: bool = False


class Reach(_Message, frozen=True):
    """Find the travel of a driver while the others rest."""

    driver: Name


class Check(_Message, frozen=True):
    """Solve by several engines in worker processes, and judge them; without points, the file."""

    engines: Annotated[list[Name], msgspec.Meta(min_length=1, max_length=20)]
    points: Rows | None = None


class Vary(_Message, frozen=True):
    """Find the spread of an output over the variants of the file of tolerances."""

    points: Rows
    output: Name


class Export(_Message, frozen=True):
    """Solve by engines in worker processes, and hand out the file of `kincheck run`."""

    kind: Literal["csv", "xlsx", "report"]
    engines: Annotated[list[Name], msgspec.Meta(min_length=1, max_length=20)]
    points: Rows | None = None


class Save(_Message, frozen=True):
    """Write a table with these points to a new file beside the user's own."""

    points: Rows
    name: Name


class Propose(_Message, frozen=True):
    """Find the least moves of points that bring outputs into bands over the whole travel.

    Attributes:
        bands: ends by output [SI].
        boxes: largest move by row of the table and axis, "tierod_inner y" [m].
    """

    points: Rows
    bands: Annotated[dict[Name, tuple[Number, Number]], msgspec.Meta(max_length=100)]
    boxes: Annotated[dict[Name, Number], msgspec.Meta(max_length=100)]


class Names(_Message, frozen=True):
    """Write the file of names of a table: points by role, empty for none."""

    roles: Annotated[dict[Name, str], msgspec.Meta(max_length=MOST_POINTS)]


class Measured(_Message, frozen=True):
    """Tell how long edits took from the page's event to the drawn curves [ms]."""

    milliseconds: Annotated[list[Number], msgspec.Meta(min_length=1, max_length=10_000)]


Asked: TypeAlias = (
    Solve | Read | Rank | Vary | Move | Reach | Check | Export | Save | Propose | Names | Measured
)


class LivePoint(msgspec.Struct, frozen=True):
    """A row of the table: its name, numbers as in the file, and roles in the template; none for a
    row without use in the template.
    """

    name: str
    position: tuple[float, float, float]
    roles: tuple[str, ...]


class LiveOutput(msgspec.Struct, frozen=True):
    """An output: its value times scale is in the shown unit.

    Attributes:
        group: "outputs", "per travel" or "coordinates".
    """

    name: str
    label: str
    unit: str
    shown_unit: str
    scale: float
    group: str


class LiveReference(msgspec.Struct, frozen=True):
    """Values of an output over the sweep to compare with; null without one; and their tolerance."""

    values: Values
    tolerance: float


class LiveDriver(msgspec.Struct, frozen=True):
    """A driver for the page to move, with the ends of its slider [m or rad]."""

    name: str
    unit: str
    design: float
    low: float
    high: float


class LiveAxis(msgspec.Struct, frozen=True):
    """The axis of the sweep: values times scale are in the shown unit.

    Attributes:
        up: 1 for an axis drawn upwards, -1 for downwards, 0 for one to the right.
    """

    title: str
    values: list[float]
    scale: float
    up: int


class Opening(_Message, frozen=True, kw_only=True):
    """The file as it is: the first message to a page.

    Attributes:
        kind: "table" or "model".
        unit, axes: of the points.
        save: a free name for a new file.
        reference: values to compare with, by output.
        limits: smallest and largest value by output; null without one.
        varied: whether there is a file of tolerances.
        tunable: whether proposals can be asked for.
    """

    protocol: int = VERSION
    kind: str
    file: str
    source: str
    unit: str
    axes: str = ""
    points: list[LivePoint] = []
    outputs: list[LiveOutput]
    axis: LiveAxis
    drivers: list[LiveDriver] = []
    engines: list[str]
    save: str = ""
    reference: dict[str, LiveReference]
    limits: Mapping[str, tuple[float | None, float | None]] = {}
    varied: bool = False
    tunable: bool = False


class NamelessPoint(msgspec.Struct, frozen=True):
    """A row of a table without roles: its name, and its place [m], x forward, y left, z up."""

    name: str
    at: list[float]


class Role(msgspec.Struct, frozen=True):
    """A role of a template.

    Attributes:
        point: proposed for it; empty for none.
    """

    name: str
    meaning: str
    needed: bool
    point: str


class Unnamed(_Message, frozen=True):
    """A table whose points have no roles yet: the first message to the page that names them.

    Attributes:
        why, doubts: of the proposed roles.
        links: pairs of roles with a link between.
    """

    file: str
    template: str
    why: list[str]
    doubts: list[str]
    points: list[NamelessPoint]
    roles: list[Role]
    links: list[tuple[str, str]]


class Answer(_Message, frozen=True):
    """The motion over the sweep.

    Attributes:
        outputs: values by output; null without a value. Some may be missing if not all were wanted.
        solved: whether each sample was reached.
        drawing: the scene, as in reports; its frames are the samples in `frames`.
        message: why samples are missing; empty if none are.
        milliseconds: time of each step.
    """

    outputs: Mapping[str, Values]
    solved: list[bool]
    drawing: dict[str, Any]
    frames: list[int]
    message: str
    milliseconds: dict[str, float]


class Proposal(_Message, frozen=True):
    """Other points, and what they give.

    Attributes:
        message: whether they bring the outputs into their bands, and the largest move.
        outputs, drawing: as of an answer.
    """

    points: list[tuple[float, float, float]]
    message: str
    outputs: Mapping[str, Values]
    drawing: dict[str, Any]


class Pose(_Message, frozen=True):
    """A pose of a mechanism.

    Attributes:
        drivers: values reached, by driver [m or rad].
        share: of the way from the design.
        bodies: origin and Euler parameters, seven numbers, by body.
        distance: smallest singular value of the rows over the one at design: 0 is a singular pose;
            null if it was not asked for.
        reactions: force of a joint's first body on its second at rest [N], by joint; zero along
            axes that rigid bodies leave undetermined; empty without loads, or if not asked for.
        message: why the way ends before; empty if it does not.
    """

    drivers: dict[str, float]
    share: float
    bodies: dict[str, list[float]]
    outputs: Mapping[str, float | None]
    distance: float | None
    reactions: dict[str, list[float]]
    message: str
    milliseconds: dict[str, float]


class Reached(_Message, frozen=True):
    """The values up to which a mechanism moves if only this driver does [m or rad], and the
    reason on either side; empty if the slider ends before.
    """

    driver: str
    low: float
    high: float
    messages: tuple[str, str]


class Refused(_Message, frozen=True):
    """A design without a solution.

    Attributes:
        message: the message to a file with these numbers.
        point: the row of the table at fault; empty if unknown.
    """

    message: str
    point: str


class Effect(msgspec.Struct, frozen=True):
    """Derivative of an output by a number of the table at the key samples [output's unit per m]."""

    point: str
    axis: str
    slopes: Values


class Ranking(_Message, frozen=True):
    """The effects on an output at the samples of rebound, design and jounce, the largest first."""

    output: str
    samples: list[int]
    effects: list[Effect]


class Bins(msgspec.Struct, frozen=True):
    """Numbers of variants between edges of an output's value."""

    edges: list[float]
    counts: list[int]


class Spread(_Message, frozen=True):
    """The variants of an output at the samples of rebound, design and jounce.

    Attributes:
        bins: null where all variants are equal.
        failed: number of variants that do not reach all samples.
    """

    output: str
    samples: list[int]
    bins: list[Bins | None]
    variants: int
    failed: int


class Verdict(_Message, frozen=True):
    """An engine's result.

    Attributes:
        worst: largest deviation over its tolerance; null if nothing was compared.
        output: the output with this deviation.
    """

    engine: str
    outcome: str
    worst: float | None
    output: str
    message: str
    last: bool


class Saved(_Message, frozen=True):
    """A file was written."""

    name: str


class Exported(_Message, frozen=True):
    """A file to keep, as base64."""

    name: str
    content: bytes


class Invalid(_Message, frozen=True):
    """A message without an answer, and the reason."""

    message: str


class Changed(_Message, frozen=True):
    """The file has other content than at the opening of the page."""

    message: str


Told: TypeAlias = (
    Opening
    | Unnamed
    | Answer
    | Pose
    | Reached
    | Refused
    | Ranking
    | Spread
    | Proposal
    | Verdict
    | Saved
    | Exported
    | Invalid
    | Changed
)

_DECODER = msgspec.json.Decoder(Asked)


def read(text: str | bytes) -> Asked:
    """Return a message of a page.

    Raises:
        msgspec.MsgspecError: it is none.
    """
    return _DECODER.decode(text)


def encode(message: Told) -> str:
    """Return a message to a page as JSON."""
    return msgspec.json.encode(message).decode()


def live_schema() -> dict[str, Any]:
    """Return the JSON Schema of both directions."""
    (asked, told), parts = msgspec.json.schema_components(
        [Asked, Told], ref_template="#/$defs/{name}"
    )
    return {"asked": asked, "told": told, "$defs": parts}
