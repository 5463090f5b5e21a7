"""A stress run as data: the JSON schema kincheck-stress/1."""

from __future__ import annotations

from typing import Any, Literal

import msgspec


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """The smallest example of a bad outcome of an engine in a family.

    Attributes:
        specimen, number: its name, and its number in the family: with the run's seed that makes it
            again.
        sample: the first bad one: its number, and the value there of what is swept [m, rad or s].
        message: what the engine said.
        tol: largest residual that was accepted.
        worst: see `Cell`.
        file: name of the case file, where one was written.
        reduced: what was taken off the case, in words.
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
    """An engine in a family.

    Attributes:
        samples: by verdict.
        elsewhere: how many of the silently wrong ones are in another assembly, or in none.
        worst: largest error of position, velocity and acceleration of samples that are right, over
            what is round-off.
        bad: how many specimens have a bad sample.
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


class Proofs(msgspec.Struct, frozen=True, kw_only=True):
    """Samples of a family whose truth was proved, by Krawczyk's test in ball arithmetic.

    Attributes:
        worst: the largest distance of the truth from the proved ball, over what is round-off of an
            engine.
        reasons: why others were not proved.
    """

    family: str
    tried: int
    proved: int
    worst: float
    reasons: list[str] = []


class Acceptance(msgspec.Struct, frozen=True, kw_only=True):
    """A specimen of contradictory geometry: whether it was accepted, the residual told, and what
    could not be avoided [m].
    """

    engine: str
    tilt: float
    accepted: bool
    told: float
    unavoidable: float


class Stress(msgspec.Struct, frozen=True, kw_only=True):
    """A run. abouts: what each family is; seconds: by what took them; unfinished: families that
    could not be run, and why.
    """

    schema: Literal["kincheck-stress/1"] = "kincheck-stress/1"
    kincheck: str
    command: str
    seed: int
    samples: int
    abouts: dict[str, str]
    cells: list[Cell]
    findings: list[Finding]
    proofs: list[Proofs]
    acceptances: list[Acceptance]
    seconds: dict[str, float]
    unfinished: dict[str, str] = {}
