"""Results as data: the record of one (case, engine) pair, the results of a whole run, and the JSON
schema kincheck-results/1.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import msgspec
import numpy as np

from ..case.case import PER_TRAVEL, Truth
from ..dataset import Dataset, Variable
from ..errors import UnknownNameError, number_of
from ..tabular import Tabular
from ..trajectory import PER_TIME, QUANTITIES
from .scene_record import Scene
from .table_units import driver_unit, in_table_units

Facts: TypeAlias = Mapping[str, Any]
"""Circumstances of a run, or facts of a case, as `Results.run` has them."""
USEFUL = ("toe", "camber", "caster", "roll_center_height", "half_track_change", "scrub_radius")
"""Outputs of a suspension that are drawn first."""
FEW, SHOWN = 9, 6
"""Variables of a record that are all drawn, and outputs that are drawn of more."""


VIEWS = 3
"""Mechanisms that results show in a notebook."""


class RecordTable(Tabular):
    """The outputs of a record over its samples."""

    if TYPE_CHECKING:  # the fields of Record
        case: Any
        engine: Any
        mode: Any
        outcome: Any
        message: Any
        driver: Any
        outputs: Any
        table: Any

    __slots__ = ()

    def summary(self) -> str:
        """Return case, engine, outcome and message."""
        message = f": {self.message}" if self.message else ""
        return f"{self.case}, {self.engine} ({self.mode}), {self.outcome.shown}{message}"

    def dataset(self) -> Dataset:
        """Return the outputs and their rates over the driver [units of the output]."""
        coords = {name: Variable("sample", values) for name, values in self.driver.items()}
        variables = dict[str, Variable]()
        for name, output in self.outputs.items():
            for quantity, per_time in zip(QUANTITIES, PER_TIME, strict=True):
                values = getattr(output, quantity)
                if values is not None:
                    key = name if quantity == QUANTITIES[0] else f"{name}.{quantity}"
                    numbers = np.array(values, dtype=np.float64)  # null becomes NaN
                    variables[key] = Variable("sample", numbers, f"{output.unit}{per_time}")
        return Dataset(
            ("sample",), coords, variables, next(iter(coords), ""), self._shown([*variables])
        )

    def drawn(self) -> Dataset:
        """Return the dataset in the units of the case's file."""

        def converted(each: Variable, unit: str) -> Variable:
            name, size = in_table_units(unit, self.table)
            return Variable(each.dims, each.values / size, name)

        data = self.dataset()
        if not self.table or not data.x:
            return data
        swept = converted(data.coords[data.x], driver_unit(self.table))
        variables = {name: converted(each, each.unit) for name, each in data.variables.items()}
        return replace(data, coords={**data.coords, data.x: swept}, variables=variables)

    def _shown(self, names: list[str]) -> list[str]:
        """Return the variables that are drawn: all of a few; of more, the useful outputs of a
        suspension, then other measures, then coordinates, without their rates.
        """

        def place(name: str) -> tuple[int, bool, bool]:
            useful = USEFUL.index(name) if name in USEFUL else len(USEFUL)
            return useful, name.endswith(PER_TRAVEL), "." in name

        outputs = [name for name in names if name in self.outputs]
        return names if len(names) <= FEW else sorted(outputs, key=place)[:SHOWN]


class ResultsTable(Tabular):
    """The records of a run, one per row."""

    if TYPE_CHECKING:  # the fields of Results
        records: Any
        scenes: Any

    __slots__ = ()

    def summary(self) -> str:
        """Return the number of cases and engines, and of each outcome."""
        cases = {each.case for each in self.records}
        engines = {each.engine for each in self.records}
        counts = Counter(each.outcome.shown for each in self.records)
        outcomes = [f"{count} {name}" for name, count in counts.items()]
        whole = [number_of(len(cases), "case"), number_of(len(engines), "engine")]
        return ", ".join([*whole, *outcomes])

    def _repr_html_(self) -> str:
        """Return the table, and the mechanisms of the first cases in motion, for a notebook."""
        shown = [*self.scenes.items()][:VIEWS]
        return super()._repr_html_() + "".join(scene.view(case) for case, scene in shown)

    def dataset(self) -> Dataset:
        """Return outcome, errors and time of every record. An error is the largest ratio of an
        output's error to its tolerance.
        """
        records = self.records
        coords = {
            name: Variable("record", np.array([getattr(each, name) for each in records], dtype=str))
            for name in ("case", "engine", "mode")
        }
        outcomes = np.array([each.outcome.shown for each in records], dtype=str)
        variables = {"outcome": Variable("record", outcomes)}
        for quantity in QUANTITIES:
            shares = [_share(each, quantity) for each in records]
            variables[f"{quantity}_error_over_tolerance"] = Variable("record", shares)
        for name, unit in (("residual_max", ""), ("us_per_step", "us")):
            numbers = np.array([getattr(each, name) for each in records], dtype=np.float64)
            variables[name] = Variable("record", numbers, unit)
        return Dataset(("record",), coords, variables)

    def record(self, case: str, engine: str) -> Any:
        """Return the first record of a case and an engine.

        Raises:
            UnknownNameError: there is none.
        """
        for each in self.records:
            if (each.case, each.engine) == (case, engine):
                return each
        known = [f"{each.case} · {each.engine}" for each in self.records]
        raise UnknownNameError("record", f"{case} · {engine}", known)


def _share(record: Any, quantity: str) -> float:
    """Return the largest ratio of a quantity's error to its tolerance; NaN if nothing was
    compared.
    """
    found = [getattr(each, quantity) for each in record.errors.values()]
    shares = [each.ratio for each in found if each is not None]
    return max(shares, default=np.nan)


IDENTICAL = (
    "the reference equals native's own result in every bit, as no independent data do: no pass is"
    " called validated; give the data of the cited source"
)
"""Note on a case whose reference is `Evidence.own`."""


class Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """The reference used to judge a record.

    Attributes:
        citation: source of the reference; empty if none is given.
        sha256: digest of the content.
        of: the digested content: a file name (the bytes of the file) or "values" (see `digest`).
        own: whether the reference claims to be third-party data, but equals native's own result in
            every bit.
        units, signs: units of the columns by name, and convention of signs; empty in results of
            older versions.
        grid: samples with a value, in words; empty for all samples.
        limits: by output, the known errors of the values, added to the tolerance; absent for exact
            values.
    """

    citation: str
    sha256: str
    of: str
    own: bool = False
    units: dict[str, str] = {}
    signs: str = ""
    grid: str = ""
    limits: dict[str, str] = {}

    @property
    def sound(self) -> bool:
        """Return whether agreement with the reference can validate: its source is cited, and is
        outside kincheck.
        """
        return bool(self.citation and self.sha256) and not self.own


class Explanation(msgspec.Struct, frozen=True, kw_only=True):
    """A change of the reference that brings quantities of outputs within tolerance.

    Attributes:
        change: words to follow "the reference"; "or" joins alternatives.
        difference, tolerance: the largest remaining difference in the first of the quantities, and
            its tolerance [unit].
    """

    outputs: list[str]
    quantities: list[str]
    change: str
    difference: float
    tolerance: float
    unit: str


REFERENCE = "reference"
"""The subject of a suspicion, beside the native engine."""


class Suspect(msgspec.Struct, frozen=True, kw_only=True):
    """A case whose engines agree with each other, but not with the reference or not with native.

    Attributes:
        subject: "reference" or "native".
        engines: those that agree.
        agreement: largest difference between engines in `output` and `quantity` [unit].
        outputs: quantities out of tolerance, by output; empty in results of older versions.
        output, quantity, sample: place of the subject's largest deviation, in tolerances.
        difference, tolerance: the deviation at this place, and its tolerance [unit].
        explanations: simple changes that make the subject fit.
        unexplained: outputs and quantities that no such change explains.
        message: the whole suspicion in one sentence.
    """

    subject: str = REFERENCE
    engines: list[str]
    agreement: float
    outputs: dict[str, list[str]] = {}
    output: str
    quantity: str
    sample: int
    difference: float
    tolerance: float
    unit: str
    explanations: list[Explanation]
    unexplained: list[str]
    message: str


class Outcome(StrEnum):
    """The outcome of a (case, engine) pair; every pair has exactly one.

    UNJUDGED is a solved pair that nothing can be compared with: neither a pass nor a fault.
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
        """Return whether the pair ran and failed. A missing engine or feature is no fault."""
        return self not in (
            Outcome.PASS,
            Outcome.UNJUDGED,
            Outcome.UNSUPPORTED,
            Outcome.UNAVAILABLE,
        )

    @property
    def judged(self) -> bool:
        """Return whether an answer was compared with a standard."""
        return self in (Outcome.PASS, Outcome.FAIL)

    @property
    def shown(self) -> str:
        """The text of the outcome in every table, page and message."""
        return "not judged" if self is Outcome.UNJUDGED else self.value


ROWS = "rows"
"""Key of a record's details: what a recording leaves of the rows of its mechanism, by quantity."""


class OutputSeries(msgspec.Struct, frozen=True, kw_only=True):
    """One output over the samples, in SI. A sample or series without a value is null; `reason`
    explains it.

    Attributes:
        sense: the meaning of a positive value, if name and unit do not show it.
    """

    position: list[float | None]
    velocity: list[float | None] | None
    acceleration: list[float | None] | None
    unit: str
    sense: str | None = None
    reason: str | None = None


class Deviation(msgspec.Struct, frozen=True, kw_only=True):
    """The deviation of an output from its standard over the samples that both have.

    Attributes:
        max_abs, tolerance: the largest deviation, and the tolerance at its sample. If the reference
            has an uncertainty, both belong to the sample with the largest ratio of the two.
        worst_step: index of the sample.
        against: kind of the reference, or the name of the engine compared with.
    """

    max_abs: float
    rms: float
    worst_step: int
    tolerance: float
    against: str
    within: bool

    @property
    def ratio(self) -> float:
        """The error in tolerances; infinite if none is allowed."""
        if self.tolerance > 0.0:
            return self.max_abs / self.tolerance
        return math.inf if self.max_abs > 0.0 else 0.0


class Deviations(msgspec.Struct, frozen=True, kw_only=True):
    """Deviations of one output. An uncompared quantity is null, and `reason` explains it.

    Attributes:
        lost: number of samples without a value where the standard has one, although all samples are
            solved; absent if zero. If all values are missing, the deviation is null too.
        contradicted: number of samples with a value that the standard's solver cannot reach; absent
            if zero.
    """

    position: Deviation | None
    velocity: Deviation | None
    acceleration: Deviation | None
    reason: str | None = None
    lost: int | msgspec.UnsetType = msgspec.UNSET
    contradicted: int | msgspec.UnsetType = msgspec.UNSET

    @property
    def sound(self) -> bool:
        """Return whether nothing is out of tolerance, lost or contradicted."""
        return self.within and not self.lost and not self.contradicted

    @property
    def within(self) -> bool:
        """Return whether every compared quantity is within tolerance."""
        return all(each.within for _, each in self.items())

    def items(self) -> list[tuple[str, Deviation]]:
        """Return each compared quantity with its deviation."""
        every = zip(QUANTITIES, (self.position, self.velocity, self.acceleration), strict=True)
        return [(quantity, deviation) for quantity, deviation in every if deviation is not None]


class Seconds(msgspec.Struct, frozen=True, kw_only=True):
    """Wall-clock seconds of the phases of a pair: build, first solve, warm solve, comparison.

    `warm` is the median of several solves after the first. A phase is null if it was not reached.

    Attributes:
        waited: the part of `warm` spent waiting for the processor.
    """

    build: float | None = None
    first: float | None = None
    warm: float | None = None
    compare: float | None = None
    waited: float | None = None

    @property
    def own(self) -> float | None:
        """The time of a warm solve without waiting for the processor; None if it is unknown.

        In 25 equal runs on two processors with five busy processes, the ratio of two runs reaches
        4.1 by the clock, and 1.9 without waiting.
        """
        return None if self.warm is None else self.warm - (self.waited or 0.0)


class Record(RecordTable, msgspec.Struct, frozen=True, kw_only=True):
    """The result of one (case, engine) pair. An uncomputed number is null, never zero;
    `reasons` and `message` explain it.

    Attributes:
        truth: kind of the case's reference; consensus_only without a reference, even if the case
            claims another kind.
        driver: values at the samples by driver: first the swept driver [m, rad or s], then every
            further moving driver.
        errors: one entry for every output of the case, with every outcome.
        residual_max: the engine's own largest constraint residual over the solved samples [m or -].
        rank: rank of the rows solved by the engine, at the design. Native: the joints' rows,
            Cartesian and without drivers (unknowns less rank is dof). A simulator: the rows of its
            own model, with loops, relations and drivers. Ranks of different engines are not
            comparable.
        dof: degrees of freedom without drivers; the same in all engines.
        iterations: Newton iterations, sum over the solved samples.
        solved, samples: number of samples reached, and number of samples.
        us_per_step: time of the warm solve per sample [us] without waiting for the processor,
            including the forces of outputs; null unless all samples were reached.
        table: units of the case's file, and the type of its driver; absent for a file in SI, and
            in records of older versions.
        faults: what is wrong with an answer beside deviations: missing or contradicted samples,
            residual, balance of power, bodies, degrees of freedom; `message` repeats them. Empty in
            records of older versions.
        evidence: evidence on the reference used for the verdict; null without a reference, and in
            records of older versions.
        reasons: reasons for null numbers, by key: residual_max, rank, dof, iterations, us_per_step.
            Empty in records of older versions.
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
    table: dict[str, Any] | msgspec.UnsetType = msgspec.UNSET
    faults: list[str] = []

    @property
    def pair(self) -> tuple[str, str, str]:
        """Case, engine and mode, which identify the record."""
        return self.case, self.engine, self.mode

    @property
    def validated(self) -> bool:
        """Return whether the pair passed and every output was judged against a cited reference from
        outside kincheck.
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
        """Return whether any output was compared with a standard, or a recording with the rows of
        its mechanism.
        """
        outputs = any(deviations.items() for deviations in self.errors.values())
        return outputs or ROWS in self.details


class Results(ResultsTable, msgspec.Struct, frozen=True, kw_only=True):
    """The results of a run.

    Attributes:
        run: circumstances of the run: versions, machine, settings and facts of the cases; if the
            run ended early, also the missing pairs.
        records: one per (case, engine) pair.
        references: the reference values of each case with a reference, by case and output.
        scenes: the mechanism of each case, by case; empty in a run without scenes.
        suspects: by name, cases with engines in agreement with each other and not with the
            reference or native.
    """

    schema: Literal["kincheck-results/1"] = "kincheck-results/1"
    run: dict[str, Any]
    records: list[Record]
    references: dict[str, dict[str, OutputSeries]] = {}
    scenes: dict[str, Scene] = {}
    suspects: dict[str, Suspect] = {}

    def explains(self, record: Record) -> bool:
        """Return whether the suspicion of the case explains all faults of a failed record, so that
        the record's own message is redundant.
        """
        found = self.suspects.get(record.case)
        if found is None or record.outcome is not Outcome.FAIL:
            return False
        whole = record.solved == record.samples and not any(
            each.lost for each in record.errors.values()
        )
        off = {
            (name, quantity)
            for name, errors in record.errors.items()
            for quantity, each in errors.items()
            if not each.within
        }
        accused = {(name, each) for name, every in found.outputs.items() for each in every}
        explained = record.engine in found.engines and (off <= accused or not accused)
        return whole and not record.faults and explained

    @property
    def missing(self) -> list[tuple[str, str, str]]:
        """Case, engine and mode of the requested pairs without a record: the run ended before, or
        the case is in `unread`.
        """
        return [(case, engine, mode) for case, engine, mode in self.run.get("missing", [])]

    @property
    def unread(self) -> dict[str, str]:
        """The reason for each unreadable case, by its requested name."""
        return self.run.get("unread", {})


def to_json(results: msgspec.Struct | Mapping[str, Any]) -> bytes:
    """Return indented JSON. Floats keep all their digits; a list of numbers stays on one line."""
    text = msgspec.json.format(msgspec.json.encode(results), indent=2)
    # JSON strings hold no bare line break: only white space between numbers changes
    rows = re.compile(rb"\[[^][{}\"]*\]")
    return (
        rows.sub(lambda row: re.sub(rb"\n *", b"", row[0].replace(b",\n", b", \n")), text) + b"\n"
    )


def update_outcome(record: Record) -> Record:
    """Return a record with today's outcome: older files call an uncompared pair a pass."""
    if record.outcome is Outcome.PASS and not record.compared:
        return msgspec.structs.replace(record, outcome=Outcome.UNJUDGED)
    return record


def from_json(text: bytes) -> Results:
    """Return the results in a text of this or an older version of `to_json`.

    Raises:
        msgspec.ValidationError: not the schema kincheck-results/1; the message names the key.
        msgspec.DecodeError: not JSON.
    """
    results = msgspec.json.decode(text, type=Results)
    return msgspec.structs.replace(
        results, records=[update_outcome(record) for record in results.records]
    )
