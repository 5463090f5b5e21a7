"""Files of proved references, schema kincheck-reference/1, and their use as the truth of a case."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from ...trajectory import QUANTITIES, Array
from ..case import Case, Origin, Quantity, Series, Truth
from .document import fault, read_text, shown

LARGEST_FILE = 256_000_000
# Twelve digits of a driver value: a smaller error moves no output by as much as a tolerance; a
# rounded table has a larger error.
SAME_GRID = 1e-12
# Fewer forms than Python's numbers: no 1_0, no nan.
_DECIMAL = re.compile(r"[-+]?\d++(?:\.\d*+)?(?:[eE][-+]?\d++)?", re.ASCII)


class ProvedSeries(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One output, SI, as decimals; null if a sample is not proved, or has no value of the output.

    Attributes:
        signs: the convention of signs and axes; empty for the case's own axes.
        radius: proved bounds of |printed - true| for position, velocity and acceleration, the
            largest over the samples.
        reason: the reason for missing numbers; null if there are numbers.
    """

    position: list[str | None]
    velocity: list[str | None]
    acceleration: list[str | None]
    radius: list[float | None]
    unit: str
    signs: str
    reason: str | None = None


class Sample(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """Proof of a sample, or the reason for a missing proof.

    Attributes:
        alone: radius of the box around the native pose with exactly one solution [lengths: units of
            the mechanism's size].
        contraction: of Krawczyk's operator in this box, below one.
        branch: lower bound of all branch tests; absent if the equations have no spurious zero.
        redundant: upper bound of the omitted rows at the solution; absent without omitted rows.
        contradicted: number of omitted rows proved nonzero: the rounded geometry closes only
            without them.
        left_out: omitted rows, if they differ from `Reference.redundant`.
    """

    proved: bool
    reason: str | None = None
    alone: float | None = None
    contraction: float | None = None
    branch: float | None = None
    redundant: float | None = None
    contradicted: int = 0
    left_out: list[str] | None = None


class Reference(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A proved reference.

    Attributes:
        numbers: meaning of the numbers of the case: "double" or "decimal".
        note: the proved statement.
        digits: all printed numbers are within 10^-digits of the true numbers.
        bits: working precision.
        rows: the solved equations, as "joint: primitive".
        redundant: the omitted equations.
        driver: values at the samples by driver, the swept one first [m, rad or s].
        samples: one proof for each value.
        seconds: time of the proofs [s].
    """

    schema: Literal["kincheck-reference/1"] = "kincheck-reference/1"
    case: str
    kincheck: str
    numbers: str
    note: str
    digits: int
    bits: int
    rows: list[str]
    redundant: list[str]
    driver: dict[str, list[float]]
    outputs: dict[str, ProvedSeries]
    samples: list[Sample]
    seconds: float

    @property
    def proved(self) -> int:
        """Number of proved samples."""
        return sum(sample.proved for sample in self.samples)


def read(file: Path) -> Reference:
    """Read the reference in a file.

    Raises:
        CaseError: the file is unreadable, or no proved reference.
    """
    text = read_text(file, LARGEST_FILE, "give a file that kincheck reference wrote")
    try:
        return msgspec.json.decode(text, type=Reference)
    except (msgspec.DecodeError, RecursionError) as error:
        raise fault(
            file,
            "",
            f"found {error}, expected a proved reference; make one with kincheck reference CASE",
        ) from None


def sha256(file: Path) -> str:
    """Return the digest of a file, as `sha256sum` prints it."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def series(
    file: Path, found: Reference, values: Array, outputs: Sequence[Quantity]
) -> dict[str, Series]:
    """Return the doubles nearest to the proved numbers, by output; NaN at unproved samples.

    Args:
        file: file of the reference, for messages.
        values: grid of the sweep [m, rad or s], shape (n,).
        outputs: outputs of the case.

    Raises:
        CaseError: the grid, the outputs or their signs differ from the case's.
    """
    grid = np.array(next(iter(found.driver.values())) if found.driver else [])
    if grid.shape != values.shape or not np.allclose(
        grid, values, rtol=0.0, atol=SAME_GRID * float(np.abs(values).max())
    ):
        raise fault(
            file,
            "driver",
            "found other samples than those of the sweep, expected the same; make the reference"
            " anew",
        )
    proved = {name: each for name, each in found.outputs.items() if each.reason is None}
    for output in outputs:
        if output.name in proved and (proved[output.name].unit, proved[output.name].signs) != (
            output.unit,
            output.signs,
        ):
            problem = (
                "found another unit or convention of signs, expected that of the case; make the"
                " reference anew"
            )
            raise fault(file, f"outputs.{output.name}", problem)
    names = [output.name for output in outputs if output.name in proved]
    if not names:
        raise fault(
            file,
            "outputs",
            f"found {', '.join(proved) or 'none'}, expected outputs of the case; make the reference"
            " anew",
        )
    known = dict[str, Series]()
    for name in names:
        position, *rates = (
            _numbers(file, f"outputs.{name}.{each}", getattr(proved[name], each), len(values))
            for each in QUANTITIES
        )
        known[name] = Series(position, *(x if np.isfinite(x).any() else None for x in rates))
    return known


def _numbers(file: Path, key: str, column: Sequence[str | None], count: int) -> Array:
    if len(column) != count:
        raise fault(
            file,
            key,
            f"found {len(column)} samples, expected {count} as in the sweep; make the reference"
            " anew",
        )
    for k, text in enumerate(column):
        if text is not None and not (_DECIMAL.fullmatch(text) and math.isfinite(float(text))):
            raise fault(
                file,
                f"{key}[{k}]",
                f"found {shown(text)}, expected a decimal number; make the reference anew",
            )
    return np.array([np.nan if text is None else float(text) for text in column])


def with_proved_references(
    cases: Sequence[Case], files: Sequence[Path], unused: list[str] | None = None
) -> list[Case]:
    """Return the cases with the proved references in these files. Their truth becomes
    in_house_oracle.

    Args:
        unused: called with a message for each file of a case not among these; None makes such a
            file an error.

    Raises:
        CaseError: a file cannot be used, or belongs to a case not among these.
    """
    found = {case.name: case for case in cases}
    for file in files:
        proved = read(file)
        if proved.case not in found:
            stray = fault(
                file,
                "case",
                f"found {proved.case!r}, expected one of the cases to be run:"
                f" {', '.join(found) or 'none'}",
            )
            if unused is None:
                raise stray
            unused.append(str(stray))
            continue
        case = found[proved.case]
        truth = series(file, proved, case.sweep.values, case.outputs)
        origin = Origin(f"proved by kincheck {proved.kincheck}", file.name, sha256(file), own=True)
        found[case.name] = replace(
            case, truth=Truth.IN_HOUSE_ORACLE, reference=truth, origin=origin
        )
    return list(found.values())
