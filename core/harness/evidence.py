"""What is known of the reference of a case: where it comes from, which one it was, and whether it
is to be suspected.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec
import numpy as np

from ..case.case import Case, Origin, Series, Truth
from ..trajectory import QUANTITIES, Array

VALUES = "values"
"""What a digest is of where no file holds the reference."""
IDENTICAL = (
    "the reference is identical to native's own result in every bit, which no data of others is: no"
    " pass is called validated; give the data of their source"
)
# A straight line through the samples is met by rounding, and a driven coordinate is one.
FEWEST, STRAIGHT = 3, 1e-9


class Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """The reference that a record was judged against.

    Attributes:
        citation: where it comes from; empty where nobody says.
        sha256: digest of its content.
        of: the content: the name of a file, whose bytes they are, or "values", which `digest`
            describes.
        own: it claims to be of others, and is native's own result in every bit.
    """

    citation: str
    sha256: str
    of: str
    own: bool = False

    @property
    def sound(self) -> bool:
        """Whether agreement with it can validate: it says where it comes from, and is not
        kincheck's own.
        """
        return bool(self.citation and self.sha256) and not self.own


def evidence(case: Case, native: Mapping[str, Series]) -> Evidence | None:
    """Return the evidence that the reference of a case is; None where it has none.

    Args:
        native: outputs of the native engine, as far as they are known.
    """
    if not case.reference:
        return None
    origin = case.origin or Origin(case.source)
    return Evidence(
        citation=origin.citation,
        sha256=origin.sha256 or digest(case.reference),
        of=origin.file or VALUES,
        own=origin.own or (case.truth is Truth.THIRD_PARTY_DATA and _identical(case, native)),
    )


def _identical(case: Case, native: Mapping[str, Series]) -> bool:
    """Whether every value of the reference equals native's in every bit, of series that are neither
    constant nor straight.
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
    """Return the SHA-256 of true values: names of outputs and quantities in order, and after each
    its little-endian doubles, SI.
    """
    whole = hashlib.sha256()
    for name, series in sorted(reference.items()):
        for quantity in QUANTITIES:
            if (values := getattr(series, quantity)) is not None:
                whole.update(f"{name}.{quantity}\n".encode())
                whole.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return whole.hexdigest()


class Explanation(msgspec.Struct, frozen=True, kw_only=True):
    """A change of the reference that brings these quantities of these outputs within tolerance.

    Attributes:
        change: in words, after "the reference"; several that do, with "or" between them.
        difference, tolerance: the largest difference that is left in the first of the quantities,
            and what it is within [unit].
    """

    outputs: list[str]
    quantities: list[str]
    change: str
    difference: float
    tolerance: float
    unit: str


class Suspect(msgspec.Struct, frozen=True, kw_only=True):
    """A case whose engines agree with each other and not with its reference.

    Attributes:
        agreement: largest difference between engines in the output and quantity named [unit].
        output, quantity, sample: where the reference is off most, in tolerances.
        difference, tolerance: how far it is off there, and what it is held to [unit].
        explanations: simple changes of the reference that make it fit.
        unexplained: outputs and quantities for which there is none.
        message: all of it in one sentence.
    """

    engines: list[str]
    agreement: float
    output: str
    quantity: str
    sample: int
    difference: float
    tolerance: float
    unit: str
    explanations: list[Explanation]
    unexplained: list[str]
    message: str
