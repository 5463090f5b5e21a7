"""Functions on cases and engines by name, as on the command line."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar, cast

from kincheck.core import KincheckError
from kincheck.core.case.case import Case
from kincheck.core.case.io.reader_options import NOTHING, Supplied
from kincheck.core.cli.check_engine import examined
from kincheck.core.cli.engine_loading import made
from kincheck.core.cli.main import registry
from kincheck.core.cli.run_options import TOL
from kincheck.core.harness import run as running
from kincheck.core.harness.engine import Engine
from kincheck.core.harness.record import Results
from kincheck.core.harness.scene import with_scenes
from kincheck.core.harness.workers.pool import solver_for
from kincheck.core.studies.checks.findings import Report
from kincheck.core.studies.compliance import study
from kincheck.core.studies.compliance.study import ComplianceResults

_One = TypeVar("_One")


def load(name: str | Path, supplied: Supplied = NOTHING) -> Case:
    """Return the built-in case of a name, or the case in a file.

    Args:
        name: name of the case, or path to a case file, hardpoint table or model.
        supplied: facts missing in a file of another tool.

    Raises:
        KincheckError: there is no such case, or its file is invalid.
    """
    return registry().find_case(str(name), supplied, driven=False)


def run(
    cases: str | Path | Case | Sequence[str | Path | Case] | None = None,
    engines: str | Engine | Sequence[str | Engine] | None = None,
    *,
    mode: str | None = None,
    tol: float = TOL,
    jobs: int | None = None,
) -> Results:
    """Solve cases with engines and judge the results, as the command `kincheck run` does.

    A missing engine is a record with the outcome `unavailable`.

    Args:
        cases: names, paths or cases; all built-in cases by default.
        engines: names or engines; all by default.
        mode: "projection" or "simulate"; by default the first mode of each engine.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        jobs: number of worker processes; 0 solves in this process. By default half the processors,
            and 0 if every engine may run in this process.

    Raises:
        KincheckError: a case cannot be read, there is no engine of a name, or a member of the
            engine protocol is missing.
    """
    known, problems = registry(), list[str]()
    named = known.cases() if cases is None else _several(cases)
    found = [each if isinstance(each, Case) else known.find_case(str(each)) for each in named]
    every = known.simulations if mode == "simulate" else known.engines
    team = list[Engine]()
    for each in every if engines is None else _several(engines):
        team += (
            known.find_engines([each], problems, mode)
            if isinstance(each, str)
            else [made(repr(each), each)]
        )
    if problems:
        raise KincheckError("\n".join(problems))
    solver, _ = solver_for(team, jobs)
    results = running.run(found, team, tol=tol, baseline=known.baseline(team), solver=solver)
    return with_scenes(results, found)


def compliance(
    case: str | Path | Case,
    travel: Sequence[float] | None = None,
    loads: Mapping[str, float | Sequence[float]] | None = None,
    axle: str = "heave",
) -> ComplianceResults:
    """Return the kinematics and compliance of a suspension, as the command `kincheck kc` does.

    Args:
        case: name, path or case.
        travel: of the wheel from design [m], by default 60 mm up and down; of the steering if
            `axle` is "steer".
        loads: values by load, "lateral", "longitudinal", "braking" or "aligning" [N, N m], each
            applied at design; one number acts over all travel.
        axle: motion of both wheels: "heave", "roll" or "steer".

    Raises:
        KincheckError: the case lacks facts, or a sample has no equilibrium; the message gives the
            last load with one.
    """
    found = study.compliance(case if isinstance(case, Case) else load(case), travel, loads, axle)
    if found.failures:
        raise KincheckError("\n".join(found.failures))
    return found


def check_engine(engine: str | Engine) -> Report:
    """Check an engine as the command `kincheck check-engine` does.

    Args:
        engine: an engine, its name, or MODULE:CLASS.

    Raises:
        KincheckError: there is no such engine.
    """
    return examined(engine, registry())


def _several(named: _One | Sequence[_One]) -> Sequence[_One]:
    """Return a sequence unchanged, and anything else as a sequence of one."""
    several = isinstance(named, Sequence) and not isinstance(named, str)
    return cast("Sequence[_One]", named if several else [named])
