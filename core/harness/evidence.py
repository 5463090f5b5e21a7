"""Evidence on the reference of a case: its origin, its digest, and any suspicion."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec
import numpy as np

from ..case.case import Case, Origin, Series, Truth
from ..trajectory import QUANTITIES, Array

VALUES = "values"
"""Subject of a digest if no file holds the reference."""
IDENTICAL = (
    "the reference equals native's own result in every bit, as no independent data do: no pass is"
    " called validated; give the data of the cited source"
)
# Straight series prove nothing: their rounded values agree in every bit whatever the source. The
# series of a driven coordinate is straight.
FEWEST, STRAIGHT = 3, 1e-9


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


def evidence(case: Case, native: Mapping[str, Series]) -> Evidence | None:
    """Return the evidence on the reference of a case; None without a reference.

    Args:
        native: known outputs of the native engine.
    """
    if not case.reference:
        return None
    origin = case.origin or Origin(case.source)
    return Evidence(
        citation=origin.citation,
        sha256=origin.sha256 or digest(case.reference),
        of=origin.file or VALUES,
        units=dict(origin.units),
        signs=origin.signs,
        grid=origin.grid,
        limits=dict(origin.limits),
        own=origin.own or (case.truth is Truth.THIRD_PARTY_DATA and _identical(case, native)),
    )


def _identical(case: Case, native: Mapping[str, Series]) -> bool:
    """Return whether every reference value equals native's in every bit, with at least one curved
    series.
    """
    telling = False
    for name, series in case.reference.items():
        for quantity in QUANTITIES:
            reference: Array | None = getattr(series, quantity)
            if reference is None:
                continue
            found: Array | None = getattr(native.get(name), quantity, None)
            known = np.isfinite(reference)
            if (
                found is None
                or found.shape != reference.shape
                or not np.array_equal(reference[known], found[known])
            ):
                return False
            telling = telling or not _straight(case.sweep.values[known], reference[known])
    return telling


def _straight(x: Array, y: Array) -> bool:
    if len(y) < FEWEST:
        return True
    slope = float(y[x.argmax()] - y[x.argmin()]) / (float(np.ptp(x)) or 1.0)
    off: Array = y - slope * x
    return float(np.ptp(off)) <= STRAIGHT * float(np.abs(y).max())


def digest(reference: Mapping[str, Series]) -> str:
    """Return the SHA-256 of reference values.

    Order: outputs by name, then quantities; after each name its values as little-endian SI doubles.
    """
    whole = hashlib.sha256()
    for name, series in sorted(reference.items()):
        for quantity in QUANTITIES:
            if (values := getattr(series, quantity)) is not None:
                whole.update(f"{name}.{quantity}\n".encode())
                whole.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return whole.hexdigest()


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
