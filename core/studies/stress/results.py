"""Results of a stress run: the JSON schema kincheck-stress/1."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Literal

import msgspec


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """The smallest example of a bad outcome of an engine in a family.

    Attributes:
        specimen, number: name, and number in the family, which with the seed of the run reproduces
            the specimen.
        sample: number of the first bad sample; `value` is its value of the swept driver [m,
            rad or s].
        message: message of the engine.
        tol: largest accepted residual.
        worst: see `Cell`.
        file: name of the case file, if one is written.
        reduced: reductions of the case, as text.
    """

    family: str
    engine: str
    mode: str
    verdict: str
    specimen: str
    number: int
    sample: int
    value: float
    message: str
    tol: float
    worst: list[float | None]
    file: str | None = None
    reduced: list[str] = []


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """Results of an engine in a family.

    Attributes:
        samples: number of samples by verdict.
        elsewhere: number of silently wrong samples in another assembly, or in none.
        worst: largest errors of position, velocity, acceleration and force at correct samples, over
            the round-off bound.
        bad: number of specimens with a bad sample.
    """

    family: str
    engine: str
    mode: str
    version: str | None
    settings: dict[str, Any]
    specimens: int
    samples: dict[str, int]
    elsewhere: int
    worst: list[float | None]
    bad: int
    seconds: float


def largest(errors: Iterable[Sequence[float | None]]) -> list[float | None]:
    """Return the largest error of each quantity; None if nothing was compared."""
    columns = zip([None] * 4, *errors, strict=True)
    return [max((x for x in each if x is not None), default=None) for each in columns]


class Proofs(msgspec.Struct, frozen=True, kw_only=True):
    """Samples of a family with a proved reference, by Krawczyk's test in ball arithmetic.

    Attributes:
        worst: largest distance of the reference from the proved ball, over an
            engine's round-off bound.
        reasons: reasons of the failed proofs.
    """

    family: str
    tried: int
    proved: int
    worst: float
    reasons: list[str] = []


class Acceptance(msgspec.Struct, frozen=True, kw_only=True):
    """A specimen of contradictory geometry: whether it was accepted, its reported residual, and its
    unavoidable residual [m].
    """

    engine: str
    tilt: float
    accepted: bool
    told: float
    unavoidable: float


class Stress(msgspec.Struct, frozen=True, kw_only=True):
    """Results of a stress run.

    Attributes:
        abouts: description of each family.
        seconds: time of each part of the run [s].
        unfinished: families that could not be run, with the reasons.
    """

    schema: Literal["kincheck-stress/1"] = "kincheck-stress/1"
    kincheck: str
    command: str
    seed: int
    samples: int
    abouts: dict[str, str]
    cells: list[Cell] = []
    findings: list[Finding] = []
    proofs: list[Proofs] = []
    acceptances: list[Acceptance] = []
    seconds: dict[str, float]
    unfinished: dict[str, str] = {}
