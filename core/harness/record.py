"""Results as data: the record of one (case, engine) pair and of a whole run; the JSON schema
kincheck-results/1.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Literal

import msgspec

from ..case.case import Truth
from ..trajectory import QUANTITIES
from .evidence import Evidence, Suspect


class Outcome(StrEnum):
    """What became of a pair. Every pair gets exactly one.

    UNJUDGED is a pair that was solved and that nothing could be compared with: neither a pass nor a
    fault.
    """

    PASS = "pass"
    FAIL = "fail"
    UNJUDGED = "unjudged"
    ERROR = "error"
    UNSUPPORTED = "unsupported"
    UNAVAILABLE = "unavailable"
    TIMEOUT = "timeout"
    CRASHED = "crashed"

    @property
    def bad(self) -> bool:
        """Whether something was run and went wrong; a missing engine or feature is no fault of a
        result.
        """
        return self not in (
            Outcome.PASS,
            Outcome.UNJUDGED,
            Outcome.UNSUPPORTED,
            Outcome.UNAVAILABLE,
        )

    @property
    def judged(self) -> bool:
        """Whether an answer was compared with a standard."""
        return self in (Outcome.PASS, Outcome.FAIL)

    @property
    def shown(self) -> str:
        """The outcome in the words of every table, page and message."""
        return "not judged" if self is Outcome.UNJUDGED else self.value


class OutputSeries(msgspec.Struct, frozen=True, kw_only=True):
    """One output over the samples, in SI. A sample, or a whole series, that was not computed is
    null; `reason` says why.

    Attributes:
        sense: what a positive value means, where name and unit do not say it.
    """

    position: list[float | None]
    velocity: list[float | None] | None
    acceleration: list[float | None] | None
    unit: str
    sense: str | None = None
    reason: str | None = None


class Deviation(msgspec.Struct, frozen=True, kw_only=True):
    """How far an output is from what it is compared with, over the samples both have.

    Attributes:
        worst_step: index of the sample with the largest deviation.
        against: kind of the reference, or the name of the engine compared with.
    """

    max_abs: float
    rms: float
    worst_step: int
    tolerance: float
    against: str
    within: bool


class Deviations(msgspec.Struct, frozen=True, kw_only=True):
    """Deviations of one output; null where there is nothing to compare, and `reason` says why.

    Attributes:
        lost: how many values there are none of where what they are compared with has one, all
            samples being solved; absent where none are. Where all are there is no deviation either.
        contradicted: how many samples have a value although the standard's solver cannot reach
            them; absent where none have.
    """

    position: Deviation | None
    velocity: Deviation | None
    acceleration: Deviation | None
    reason: str | None = None
    lost: int | msgspec.UnsetType = msgspec.UNSET
    contradicted: int | msgspec.UnsetType = msgspec.UNSET

    @property
    def sound(self) -> bool:
        """Whether nothing is out of tolerance, lost or contradicted."""
        return self.within and not self.lost and not self.contradicted

    @property
    def within(self) -> bool:
        """Whether all that was compared is within tolerance."""
        return all(each.within for _, each in self.items())

    def items(self) -> list[tuple[str, Deviation]]:
        """Quantity and deviation of what was compared."""
        every = zip(QUANTITIES, (self.position, self.velocity, self.acceleration), strict=True)
        return [(quantity, deviation) for quantity, deviation in every if deviation is not None]


class Seconds(msgspec.Struct, frozen=True, kw_only=True):
    """Wall-clock seconds: making the model, the first solve, a solve after it (median of several),
    and judging the answer.

    A phase that was not reached is null, and so are those after it.

    Attributes:
        waited: the part of `warm` in which others had the processor.
    """

    build: float | None = None
    first: float | None = None
    warm: float | None = None
    compare: float | None = None
    waited: float | None = None


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one (case, engine) pair. What was not computed is null, never zero; `message`
    says why.

    Attributes:
        truth: kind of the case's reference; consensus_only where it has none, whatever the case
            claims.
        driver: values at the samples by name: of what is swept [m, rad or s] first, then of every
            further moving driver.
        errors: one entry for every output of the case, whatever the outcome.
        residual_max: the engine's own largest constraint residual over the solved samples [m or -].
        rank: of the rows that the engine solves, at the design: native's are those of the joints,
            Cartesian and without drivers (unknowns less rank is dof), a simulator's those of its
            own model, loops, relations and drivers. Ranks of different engines are not to be
            compared.
        dof: degrees of freedom, drivers apart; the same in all engines.
        iterations: Newton iterations, sum over the solved samples.
        solved, samples: how many samples were reached, out of how many.
        us_per_step: warm solve by sample [us]; null unless all samples were reached.
        evidence: of the reference that it was judged against; null where there is none, and in
            records of before.
        reasons: why a number is null, by its key: residual_max, rank, dof, iterations, us_per_step.
            Records of before have none.
    """

    case: str
    truth: str
    engine: str
    mode: str
    loop: str
    version: str | None
    outcome: Outcome
    message: str
    settings: dict[str, Any] = {}
    driver: dict[str, list[float]] = {}
    outputs: dict[str, OutputSeries] = {}
    errors: dict[str, Deviations] = {}
    residual_max: float | None = None
    rank: int | None = None
    dof: int | None = None
    iterations: int | None = None
    solved: int | None = None
    samples: int | None = None
    seconds: Seconds | None = None
    us_per_step: float | None = None
    reasons: dict[str, str] = {}
    details: dict[str, Any] = {}
    evidence: Evidence | None = None

    @property
    def validated(self) -> bool:
        """Whether it passed, and every output was judged against a truth that nobody here made and
        whose source is cited.
        """
        judged = [deviations.position for deviations in self.errors.values()]
        return (
            self.outcome is Outcome.PASS
            and bool(judged)
            and Truth(self.truth).validates
            and self.evidence is not None
            and self.evidence.sound
            and all(each is not None and each.against == self.truth for each in judged)
        )

    @property
    def compared(self) -> bool:
        """Whether any output was compared with a standard."""
        return any(deviations.items() for deviations in self.errors.values())


class SceneBody(msgspec.Struct, frozen=True, kw_only=True):
    """A body as drawn: its frame at the design, and at every frame of the scene.

    Attributes:
        origin, euler_parameters: at the design, global [m, -].
        r: origins, global [m], shape (frames, 3); empty where only the design is known, or the body
            is fixed.
        p: Euler parameters e0..e3, body -> global [-], shape (frames, 4); empty as r.
    """

    name: str
    fixed: bool
    origin: list[float]
    euler_parameters: list[float]
    r: list[list[float]] = []
    p: list[list[float]] = []


class SceneJoint(msgspec.Struct, frozen=True, kw_only=True):
    """A joint's geometry, global at the design [m].

    Attributes:
        bodies: names of the first and the second body.
        points: none, one common to both bodies, or one on each.
        axes: directions of any length: none, one common to both bodies, or one on each.
    """

    name: str
    type: str
    bodies: list[str]
    points: list[list[float]] = []
    axes: list[list[float]] = []


class ScenePoint(msgspec.Struct, frozen=True, kw_only=True):
    """A named point of a body, global at the design [m], and whether an output reads it."""

    name: str
    body: str
    position: list[float]
    output: bool


class Scene(msgspec.Struct, frozen=True, kw_only=True):
    """A case's mechanism to look at. Poses are rounded to what a screen shows, and never compared
    with anything.

    Attributes:
        frames: indices of the samples at which there are poses; empty where only the design
            position is known.
        message: empty, or why samples have no pose.
    """

    bodies: list[SceneBody]
    joints: list[SceneJoint]
    points: list[ScenePoint]
    frames: list[int] = []
    message: str = ""


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """A run.

    Attributes:
        run: its circumstances: versions, machine, settings, what the cases are, and where it ended
            early, what is missing.
        records: one per (case, engine) pair.
        references: the true values of each case that has any, by case and output.
        scenes: the mechanism of each case, by case; a run made without them has none.
        suspects: cases whose engines agree with each other and not with the reference, by name.
    """

    schema: Literal["kincheck-results/1"] = "kincheck-results/1"
    run: dict[str, Any]
    records: list[Record]
    references: dict[str, dict[str, OutputSeries]] = {}
    scenes: dict[str, Scene] = {}
    suspects: dict[str, Suspect] = {}

    def blames_reference(self, record: Record) -> bool:
        """Whether a failure is told by what is said of its case's reference, and not by its own
        message.
        """
        whole = record.solved == record.samples and not any(
            each.lost for each in record.errors.values()
        )
        return record.case in self.suspects and record.outcome is Outcome.FAIL and whole

    @property
    def missing(self) -> list[tuple[str, str, str]]:
        """Case, engine and mode of the pairs that were asked for and have no record: the run ended
        before them, or see `unread`.
        """
        return [(case, engine, mode) for case, engine, mode in self.run.get("missing", [])]

    @property
    def unread(self) -> dict[str, str]:
        """Cases that were asked for and make no sense, by their names as given, and why."""
        return self.run.get("unread", {})


def to_json(results: msgspec.Struct | Mapping[str, Any]) -> bytes:
    """Indented JSON; floats keep all their digits, a list of numbers stays on one line."""
    text = msgspec.json.format(msgspec.json.encode(results), indent=2)
    # a string cannot hold a bare line break, so only white space between numbers is touched
    rows = re.compile(rb"\[[^][{}\"]*\]")
    return (
        rows.sub(lambda row: re.sub(rb"\n *", b"", row[0].replace(b",\n", b", \n")), text) + b"\n"
    )


def settled(record: Record) -> Record:
    """Return a record with the outcome that it has today: older files call it a pass where nothing
    was compared.
    """
    if record.outcome is Outcome.PASS and not record.compared:
        return msgspec.structs.replace(record, outcome=Outcome.UNJUDGED)
    return record


def from_json(text: bytes) -> Results:
    """The results that `to_json` wrote, now or with an older version.

    Raises:
        msgspec.ValidationError: not the schema kincheck-results/1; the message names the key.
        msgspec.DecodeError: not JSON.
    """
    results = msgspec.json.decode(text, type=Results)
    return msgspec.structs.replace(results, records=[settled(record) for record in results.records])
