"""A stress run: specimens of all families, their references and the outcomes of every engine."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from ...case.case import Case
from ...errors import KincheckError, SolveError
from ...harness.engine import Engine
from ...harness.execution import Failure, Pair
from ...harness.provenance import plain
from ...harness.record import Outcome
from ...kinematics import UnprovedError
from ...version import VERSION
from ..truth.motion import Reach, Truth
from ..truth.proofs import distance_from_proof
from ..truth.rows import require_extended
from .families import Family, Specimen
from .results import Acceptance, Cell, Finding, Proofs, Stress
from .solving import solve_all, suited
from .verdicts import BAD, Judgement, Verdict, described_wrong, judged

# Fewest specimens of a small share, and fewest samples of each.
FEWEST_SPECIMENS, FEWEST_SAMPLES = 4, 3
COARSEST = 5
# Every other mechanism of up to this many bodies is proved: setting up a proof takes long.
LARGEST_PROVED = 6


@dataclass(frozen=True, eq=False)
class Example:
    """A specimen with a bad outcome, to be reduced and saved."""

    engine: Engine
    specimen: Specimen
    case: Case
    verdict: Verdict
    finding: Finding


@dataclass(frozen=True, eq=False)
class Made:
    """A specimen with its case, or the reason for its refusal, and its reference."""

    number: int
    samples: int
    specimen: Specimen
    case: Case | None
    refusal: KincheckError | None
    truth: Truth | None


@dataclass(eq=False)
class _Results:
    cells: list[Cell] = field(default_factory=list[Cell])
    proofs: list[Proofs] = field(default_factory=list[Proofs])
    examples: list[Example] = field(default_factory=list[Example])
    acceptances: list[Acceptance] = field(default_factory=list[Acceptance])
    unfinished: dict[str, str] = field(default_factory=dict[str, str])


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
    found, seconds = _Results(), {"truth": 0.0, "proofs": 0.0, "engines": 0.0}
    for number, family in enumerate(families):
        try:
            _family(
                family,
                engines,
                found,
                seconds,
                samples=max(1, samples // len(families)),
                seed=seed,
                prove=prove,
                progress=lambda what, done, before=number: progress(
                    what, (before + done) / len(families)
                ),
            )
        except KincheckError as error:  # the other families keep their results
            found.unfinished[family.name] = str(error)
            progress(f"{family.name}: not finished: {error}", (number + 1) / len(families))
    results = Stress(
        kincheck=VERSION,
        command=command,
        seed=seed,
        samples=samples,
        abouts={family.name: family.about for family in families},
        cells=found.cells,
        findings=[example.finding for example in found.examples],
        proofs=found.proofs,
        acceptances=found.acceptances,
        seconds=seconds,
        unfinished=found.unfinished,
    )
    return results, found.examples


def _family(
    family: Family,
    engines: Sequence[Engine],
    found: _Results,
    seconds: dict[str, float],
    *,
    samples: int,
    seed: int,
    prove: bool,
    progress: Callable[[str, float], object],
) -> None:
    begun, parts = perf_counter(), 1 + len(engines)
    progress(f"{family.name}: making {samples} samples", 0.0)
    made = specimens(family, seed, samples)
    seconds["truth"] += (now := perf_counter()) - begun
    if prove:
        found.proofs += _proofs(family.name, made, seed)
    seconds["proofs"] += (then := perf_counter()) - now
    count = f"{sum(each.samples for each in made)} samples of {len(made)} specimens"
    for number, engine in enumerate(engines, 1):
        progress(f"{family.name}: {count} by {engine.name}", number / parts)
        _solve(family, engine, made, found)
    seconds["engines"] += perf_counter() - then


def specimens(family: Family, seed: int, share: int) -> list[Made]:
    """Return specimens with a share of samples in total."""
    most = max(FEWEST_SAMPLES, share // FEWEST_SPECIMENS) if family.several else share
    found: list[Made] = []
    while (done := sum(one.samples for one in found)) < share:
        found.append(
            specimen(family, seed, len(found), min(most, max(FEWEST_SAMPLES, share - done)))
        )
    return found


def specimen(family: Family, seed: int, number: int, most: int) -> Made:
    """Return specimen `number` of a family; its mechanism is independent of the rest of the run."""
    rng = np.random.default_rng([seed, zlib.crc32(family.name.encode()), number])
    # a coarse sweep is harder to solve, a fine sweep has more samples to judge
    fineness = float(rng.random()) ** 0.5
    wanted = int(COARSEST * (family.samples / COARSEST) ** fineness) if family.several else most
    samples = min(wanted, most)
    one = family.specimen(rng, samples)
    try:
        case = one.describe()
    except KincheckError as error:
        return Made(number, samples, one, None, error, None)
    return Made(number, samples, one, case, None, one.truth(case) if one.truth else None)


def _solve(family: Family, engine: Engine, made: Sequence[Made], found: _Results) -> None:
    """Solve all specimens of a family with an engine."""
    begun = perf_counter()
    there = [(one, one.case) for one in made if one.case is not None]
    answers = solve_all(
        [Pair(case, suited(engine, case, one.number), one.specimen.tol) for one, case in there]
    )
    results = {
        one.number: (case, answer) for (one, case), answer in zip(there, answers, strict=True)
    }
    judgements: list[tuple[Made, Judgement]] = []
    for one in made:
        if one.refusal is not None:
            judgements.append((one, described_wrong(one.specimen, one.samples, one.refusal)))
            continue
        case, answer = results[one.number]
        judgement = judged(one.specimen, case, one.truth, answer)
        judgements.append((one, judgement))
        missing = isinstance(answer, Failure) and answer.outcome in (
            Outcome.UNSUPPORTED,
            Outcome.UNAVAILABLE,
        )
        if (
            one.specimen.reported
            and one.truth is not None
            and one.truth.violated is not None
            and not missing
        ):
            accepted = not isinstance(answer, Failure) and answer.solved == one.samples
            tilt = dict(one.specimen.facts).get("tilt", 0.0)
            unavoidable = float(one.truth.violated.max())
            found.acceptances.append(
                Acceptance(
                    engine=engine.name,
                    tilt=tilt,
                    accepted=accepted,
                    told=judgement.told,
                    unavoidable=unavoidable,
                )
            )
    found.cells.append(_cell(family, engine, judgements, perf_counter() - begun))
    for verdict in BAD:
        bad = [
            (one, each) for one, each in judgements if each.counts[verdict] and one.case is not None
        ]
        if bad:
            one, judgement = min(bad, key=lambda pair: _size(pair[0]))
            found.examples.append(_example(family, engine, one, judgement, verdict))


def _size(one: Made) -> tuple[int, int]:
    return (len(one.case.mechanism.bodies), len(one.case.mechanism.joints)) if one.case else (0, 0)


def _cell(
    family: Family, engine: Engine, judgements: Sequence[tuple[Made, Judgement]], seconds: float
) -> Cell:
    worst: list[float | None] = [None] * 4
    for _, each in judgements:
        if not each.counts[Verdict.SILENTLY_WRONG]:
            worst = [
                max((x for x in pair if x is not None), default=None)
                for pair in zip(worst, each.worst, strict=True)
            ]
    return Cell(
        family=family.name,
        engine=engine.name,
        mode=engine.mode,
        version=engine.version(),
        settings=plain(engine.settings),
        specimens=len(judgements),
        samples={
            str(verdict): sum(each.counts[verdict] for _, each in judgements) for verdict in Verdict
        },
        elsewhere=sum(each.elsewhere for _, each in judgements),
        worst=worst,
        bad=sum(any(each.counts[verdict] for verdict in BAD) for _, each in judgements),
        seconds=seconds,
    )


def _example(
    family: Family, engine: Engine, one: Made, judgement: Judgement, verdict: Verdict
) -> Example:
    case, sample = one.case, judgement.first(verdict)
    if case is None or sample is None:
        raise ValueError("an example needs a case and a bad sample")
    finding = Finding(
        family=family.name,
        engine=engine.name,
        mode=engine.mode,
        verdict=verdict,
        specimen=one.specimen.name,
        number=one.number,
        sample=sample,
        value=float(case.sweep.values[sample]),
        message=judgement.message,
        tol=one.specimen.tol,
        worst=list(judgement.worst),
    )
    return Example(suited(engine, case, one.number), one.specimen, case, verdict, finding)


def _proofs(family: str, made: Sequence[Made], seed: int) -> list[Proofs]:
    """Prove a random sample of every other small mechanism with a followed reference."""
    rng, tried, proved, worst = np.random.default_rng([seed, 1]), 0, 0, 0.0
    reasons: list[str] = []
    for one in made[::2]:
        truth = one.truth
        if (
            truth is None
            or not truth.parts
            or one.case is None
            or len(one.case.mechanism.moving) > LARGEST_PROVED
        ):
            continue
        reached = np.flatnonzero(truth.reach == Reach.REACHED)
        if not len(reached):
            continue
        tried += 1
        try:
            worst = max(worst, distance_from_proof(truth, int(rng.choice(reached))))
            proved += 1
        except (
            UnprovedError,
            SolveError,
        ) as error:  # also raised too near to a singular design
            reasons.append(f"{one.specimen.name}: {error}")
    return (
        [Proofs(family=family, tried=tried, proved=proved, worst=worst, reasons=reasons)]
        if tried
        else []
    )
