"""Results of a search over releases: the JSON schema kincheck-bisect/1."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

Kind: TypeAlias = Literal["result", "interface"]
UNKNOWN, NEITHER = "unknown", "neither"


class CurveChange(msgspec.Struct, frozen=True, kw_only=True):
    """A curve with different values in two releases.

    Attributes:
        output: the output and its quantity, such as "tip.x acceleration".
        difference: largest one between the releases [unit]; null if one of them lacks values.
        errors: of both releases against the standard [unit]; null if nothing was compared.
        against: kind of the reference, or the name of the engine in its place.
    """

    output: str
    difference: float | None
    tolerance: float
    errors: tuple[float | None, float | None]
    against: str
    unit: str


class CaseChange(msgspec.Struct, frozen=True, kw_only=True):
    """A case with another outcome or other curves, the farthest out of tolerance first.

    Attributes:
        kind: "interface" if one of the releases does not run the case.
        outcomes, messages: of both releases.
    """

    kind: Kind
    outcomes: tuple[str, str]
    messages: tuple[str, str]
    right: str
    curves: list[CurveChange] = []


class Change(msgspec.Struct, frozen=True, kw_only=True, rename={"earlier": "from", "later": "to"}):
    """Two successive installable releases with different results.

    Attributes:
        right: the release in agreement with the truth of its cases; "neither", or "unknown".
        field: the simulator's first differing field, in the order of computation.
        repeat: command that compares these two alone.
        reproducer: folder below --out to repeat it without kincheck.
    """

    earlier: str
    later: str
    kind: Kind
    cases: dict[str, CaseChange]
    right: str
    repeat: str
    field: str | None = None
    reproducer: str | None = None


class Bisection(msgspec.Struct, frozen=True, kw_only=True):
    """The changes of an engine over the releases of its package.

    Attributes:
        not_installable: reason by release.
        tried: the releases run.
    """

    schema: Literal["kincheck-bisect/1"] = "kincheck-bisect/1"
    kincheck: str
    engine: str
    package: str
    ends: tuple[str, str]
    releases: int
    every: bool
    command: str
    changes: list[Change]
    not_installable: list[str]
    reasons: dict[str, str]
    tried: list[str]
