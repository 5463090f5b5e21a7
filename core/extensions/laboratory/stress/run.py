"""A stress run: specimens of all families, their references and the outcomes of every engine; and
its results, the JSON schema kincheck-stress/1.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal

import msgspec
import numpy as np

from ....case.case import Case
from ....errors import KincheckError, SolveError
from ....harness.engine import Engine
from ....harness.execution import Failure, Pair
from ....harness.provenance import plain
from ....version import VERSION
from ...proofs.exact_forces import UnprovedError
from ..truth.motion import Reach, Truth
from ..truth.proofs import distance_from_proof
from ..truth.rows import require_extended
from .families import Family, Specimen
from .verdicts import (
    BAD,
    Judgement,
    Verdict,
    judge_answer,
    refused_description,
    solve_all,
    suitable_engine,
)

# Fewest specimens of a small share, and fewest samples of each.
FEWEST_SPECIMENS, FEWEST_SAMPLES = 4, 3
COARSEST = 5
# Every other mechanism of up to this many bodies is proved: setting up a proof takes long.
LARGEST_PROVED = 6


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


@dataclass(frozen=True, eq=False)
class Draw:
    """A specimen with its number in the family and its reference."""

    number: int
    samples: int
    specimen: Specimen
    truth: Truth | None

    @property
    def case(self) -> Case | None:
        """The case; None if its description is refused."""
        found = self.specimen.case
        return found if isinstance(found, Case) else None

    @property
    def size(self) -> tuple[int, int]:
        """Numbers of bodies and joints."""
        mechanism = self.case.mechanism if self.case else None
        return (len(mechanism.bodies), len(mechanism.joints)) if mechanism else (0, 0)


@dataclass(frozen=True, eq=False)
class Example:
    """A specimen with a bad outcome, to be reduced and saved."""

    engine: Engine
    specimen: Specimen
    case: Case
    verdict: Verdict
    finding: Finding


def stress(
    families: Sequence[Family],
    engines: Sequence[Engine],
    *,
    samples: int,
    seed: int,
    command: str = "",
    prove: bool = True,
    progress: Callable[[str, float], object] = lambda what, done: None,
) -> tuple[Stress, list[Example]]:
    """Run all families; return the results and the smallest example of each bad engine and outcome.

    `prove` proves a share of the followed samples and needs python-flint. `progress` gets the next
    task and the finished part. A KincheckError is raised if this machine has no extended precision.
    """
    require_extended()
    found = Stress(
        kincheck=VERSION,
        command=command,
        seed=seed,
        samples=samples,
        abouts={family.name: family.about for family in families},
        seconds={"truth": 0.0, "proofs": 0.0, "engines": 0.0},
    )
    examples: list[Example] = []

    @contextmanager
    def measure_time(part: str) -> Generator[None]:
        begun = perf_counter()
        yield
        found.seconds[part] += perf_counter() - begun

    share, parts = max(1, samples // len(families)), 1 + len(engines)
    for number, family in enumerate(families):
        name, done = family.name, number / len(families)
        try:
            progress(f"{name}: making {share} samples", done)
            with measure_time("truth"):
                draws = specimens(family, seed, share)
            if prove:
                with measure_time("proofs"):
                    found.proofs.extend(_proofs(name, seed, draws))
            count = f"{sum(draw.samples for draw in draws)} samples of {len(draws)} specimens"
            for k, engine in enumerate(engines, 1):
                progress(f"{name}: {count} by {engine.name}", done + k / parts / len(families))
                with measure_time("engines"):
                    examples += _solve(found, name, engine, draws)
        except KincheckError as error:  # the other families keep their results
            found.unfinished[name] = str(error)
            progress(f"{name}: not finished: {error}", (number + 1) / len(families))
    found.findings.extend(example.finding for example in examples)
    return found, examples


def specimens(family: Family, seed: int, share: int) -> list[Draw]:
    """Return specimens with a share of samples in total."""
    most = max(FEWEST_SAMPLES, share // FEWEST_SPECIMENS) if family.several else share
    found: list[Draw] = []
    while (done := sum(draw.samples for draw in found)) < share:
        rest = min(most, max(FEWEST_SAMPLES, share - done))
        found.append(specimen(family, seed, len(found), rest))
    return found


def specimen(family: Family, seed: int, number: int, most: int) -> Draw:
    """Return specimen `number` of a family; its mechanism is independent of the rest of the run."""
    rng = np.random.default_rng([seed, zlib.crc32(family.name.encode()), number])
    # a coarse sweep is harder to solve, a fine sweep has more samples to judge
    fineness = float(rng.random()) ** 0.5
    wanted = int(COARSEST * (family.samples / COARSEST) ** fineness) if family.several else most
    samples = min(wanted, most)
    one = family.specimen(rng, samples)
    truth = one.truth(one.case) if one.truth and isinstance(one.case, Case) else None
    return Draw(number, samples, one, truth)


def _solve(found: Stress, family: str, engine: Engine, draws: Sequence[Draw]) -> Iterator[Example]:
    """Solve and judge all specimens of a family with an engine; yield the smallest bad ones."""
    begun = perf_counter()
    cases = [(draw, draw.case) for draw in draws if draw.case is not None]
    answers = iter(
        solve_all(
            [
                Pair(case, suitable_engine(engine, case, d.number), d.specimen.tol)
                for d, case in cases
            ]
        )
    )
    judgements: list[tuple[Draw, Judgement]] = []
    for draw in draws:
        one, truth = draw.specimen, draw.truth
        if draw.case is None:
            judgements.append((draw, refused_description(one, draw.samples)))
            continue
        answer = next(answers)
        judgement = judge_answer(one, draw.case, truth, answer)
        judgements.append((draw, judgement))
        unsupported = judgement.counts[Verdict.UNSUPPORTED]
        if one.tilt is None or truth is None or truth.violated is None or unsupported:
            continue
        found.acceptances.append(
            Acceptance(
                engine=engine.name,
                tilt=one.tilt,
                accepted=not isinstance(answer, Failure) and answer.solved == draw.samples,
                told=judgement.told,
                unavoidable=float(truth.violated.max()),
            )
        )
    counts = [each.counts for _, each in judgements]
    true = [each.worst for _, each in judgements if not each.counts[Verdict.SILENTLY_WRONG]]
    found.cells.append(
        Cell(
            family=family,
            engine=engine.name,
            mode=engine.mode,
            version=engine.version(),
            settings=plain(engine.settings),
            specimens=len(judgements),
            samples={str(verdict): sum(each[verdict] for each in counts) for verdict in Verdict},
            elsewhere=sum(each.elsewhere for _, each in judgements),
            worst=largest(true),
            bad=sum(any(each[verdict] for verdict in BAD) for each in counts),
            seconds=perf_counter() - begun,
        )
    )
    for verdict in BAD:
        bad = [
            (d, case, each) for d, each in judgements if each.counts[verdict] and (case := d.case)
        ]
        if not bad:
            continue
        draw, case, judgement = min(bad, key=lambda each: each[0].size)
        sample = int(np.flatnonzero(judgement.verdicts == verdict)[0])
        finding = Finding(
            family=family,
            engine=engine.name,
            mode=engine.mode,
            verdict=verdict,
            specimen=draw.specimen.name,
            number=draw.number,
            sample=sample,
            value=float(case.sweep.values[sample]),
            message=judgement.message,
            tol=draw.specimen.tol,
            worst=list(judgement.worst),
        )
        solver = suitable_engine(engine, case, draw.number)
        yield Example(solver, draw.specimen, case, verdict, finding)


def _proofs(family: str, seed: int, draws: Sequence[Draw]) -> Iterator[Proofs]:
    """Prove a random sample of every other small mechanism with a followed reference."""
    rng, proved, worst = np.random.default_rng([seed, 1]), 0, 0.0
    reasons: list[str] = []
    for draw in draws[::2]:
        truth = draw.truth
        if truth is None or not truth.parts:
            continue
        reached = np.flatnonzero(truth.reach == Reach.REACHED)
        if not len(reached) or len(truth.system.mechanism.moving) > LARGEST_PROVED:
            continue
        try:
            worst = max(worst, distance_from_proof(truth, int(rng.choice(reached))))
            proved += 1
        except (UnprovedError, SolveError) as error:  # SolveError: near a singular design
            reasons.append(f"{draw.specimen.name}: {error}")
    if tried := proved + len(reasons):
        yield Proofs(family=family, tried=tried, proved=proved, worst=worst, reasons=reasons)
