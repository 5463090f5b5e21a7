"""What is known of the reference of a case: where it comes from, which one it was, and whether it is to be suspected."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import msgspec
import numpy as np

from ..trajectory import QUANTITIES
from .case import Series

VALUES = "values"
"""What a digest is of where no file holds the reference."""


class Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """The reference that a record was judged against.

    Attributes:
        citation: where it comes from; empty where nobody says.
        sha256: digest of its content.
        of: the content: the name of a file, whose bytes they are, or "values", which `digest` describes.
        own: it claims to be of others, and is native's own result in every bit.
    """

    citation: str
    sha256: str
    of: str
    own: bool = False

    @property
    def sound(self) -> bool:
        """Whether agreement with it can validate: it says where it comes from, and is not kincheck's own."""
        return bool(self.citation and self.sha256) and not self.own


def digest(reference: Mapping[str, Series]) -> str:
    """Return the SHA-256 of true values: names of outputs and quantities in order, and after each its little-endian doubles, SI."""
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
        difference, tolerance: the largest difference that is left in the first of the quantities, and what it is within [unit].
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
