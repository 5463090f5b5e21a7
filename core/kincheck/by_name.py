"""Functions on cases and engines by name, as on the command line."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

from kincheck.core import KincheckError
from kincheck.core.case.case import Case, Free
from kincheck.core.case.io.reader_options import NOTHING, Supplied
from kincheck.core.case.io.reference import PROVED
from kincheck.core.case.io.reference_curve import CurveOptions, with_curve
from kincheck.core.case.io.reference_file import judged_by
from kincheck.core.cli.check_engine import examined
from kincheck.core.cli.engine_loading import made
from kincheck.core.cli.main import registry
from kincheck.core.cli.run_options import TOL
from kincheck.core.cli.serve import judge_by, opened
from kincheck.core.harness import run as running
from kincheck.core.harness.engine import Engine
from kincheck.core.harness.record import Results
from kincheck.core.harness.resource_limits import default_jobs
from kincheck.core.harness.scene import with_scenes
from kincheck.core.harness.workers.pool import solver_for
from kincheck.core.report.report import write_report
from kincheck.core.studies.checks.findings import Report
from kincheck.core.studies.compliance import study
from kincheck.core.studies.compliance.study import ComplianceResults
from kincheck.core.studies.diagnosis import Diagnosis, diagnose
from kincheck.core.studies.free import FreeResult, free_of
from kincheck.core.studies.tolerance.results import SweepResults
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.variation.variation_file import read_variation

if TYPE_CHECKING:
    from kincheck.core.live.server import Live, LiveServer

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
    reference: str | Path | None = None,
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
        reference: measured curve, or proved reference, of the only case; how a curve was read is
            among the notes.

    Raises:
        KincheckError: a case cannot be read, there is no engine of a name, or a member of the
            engine protocol is missing.
    """
    known, problems = registry(), list[str]()
    named = known.cases() if cases is None else _several(cases)
    found = [each if isinstance(each, Case) else known.find_case(str(each)) for each in named]
    if reference is not None:
        found = _judged_by(found, Path(reference))
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


def live(
    case: str | Path | Case,
    supplied: Supplied = NOTHING,
    *,
    reference: str | Path | None = None,
    variation: str | Path | None = None,
) -> "LiveServer":
    """Serve the page of `kincheck serve`; a notebook on this machine shows it in a frame.

    The server's `case` has the numbers of the page, and its `close` ends it.

    Args:
        case: path of a table of hardpoints or of another file, name of a case, or a case.
        supplied: facts missing in a file of another tool.
        reference: measured curve, or proved reference, to lay over the curves.
        variation: file of tolerances of a table.

    Raises:
        KincheckError: the file cannot be read, or a library is missing.
    """
    from kincheck.core.live.model import LiveModel
    from kincheck.core.live.server import LiveServer

    known = registry()

    def referenced(case: Case) -> Case:
        return case if reference is None else _judged_by([case], Path(reference))[0]

    def read() -> "Live":
        if isinstance(case, Case):
            return LiveModel(Path(case.name), referenced(case))
        return opened(known, str(case), supplied, referenced, vary)

    vary = None if variation is None else Path(variation)
    file = Path(case.name if isinstance(case, Case) else case)
    return LiveServer(file, read, known.engines, judge_by(known), framed=True)


def _judged_by(cases: Sequence[Case], file: Path) -> list[Case]:
    if file.suffix.lower() == PROVED:
        return judged_by(cases, [file])
    if len(cases) != 1:
        problem = f"{file}: found {len(cases)} cases, expected the one of a measured curve"
        raise KincheckError(f"{problem}; run them one by one")
    case, notes = with_curve(cases[0], file, CurveOptions())
    return [replace(case, assembly=(*case.assembly, *notes))]


def explain(
    case: str | Path | Case, supplied: Supplied = NOTHING, *, samples: int = 41, tol: float = TOL
) -> Diagnosis:
    """Diagnose a case as the command `kincheck explain` does: degrees of freedom, redundant rows,
    conditioning, and sensitivities of outputs [SI].

    Args:
        case: a case, its name, or path to its file.
        supplied: facts missing in a file of another tool.
        samples: number of samples of the sweep to examine.
        tol: largest residual that engines may leave [m or -].

    Raises:
        KincheckError: there is no such case, or its file is invalid.
    """
    found = case if isinstance(case, Case) else load(case, supplied)
    return diagnose(found, samples=samples, tol=tol)


def sweep(
    case: str | Path | Case,
    variation: str | Path,
    supplied: Supplied = NOTHING,
    *,
    samples: int | None = None,
    seed: int = 0,
    order: int = 0,
) -> SweepResults:
    """Solve variants of a case as the command `kincheck sweep` does.

    Args:
        case: a case, its name, or path to its file.
        variation: file of what varies.
        supplied: facts missing in a file of another tool.
        samples: number of variants to draw; None if the file lists them.
        seed: of the draws.
        order: highest time derivative of the outputs to reduce: 0, 1 or 2.

    Raises:
        KincheckError: a file is invalid, or the number of samples is missing or superfluous.
    """
    found = case if isinstance(case, Case) else load(case, supplied)
    varied = read_variation(Path(variation), found)
    return sweep_designs(
        found, varied, samples=samples, seed=seed, order=order, tol=TOL, jobs=default_jobs()
    )


def report(results: Results, file: str | Path) -> None:
    """Write results as the report of `kincheck run --out`: one HTML file, worst first.

    Raises:
        OSError: the file cannot be written.
    """
    write_report(results, Path(file))


def free(
    case: str | Path | Case,
    *,
    duration: float | None = None,
    samples: int | None = None,
    rates: Mapping[str, float] | None = None,
) -> FreeResult:
    """Integrate the motion of a case without its drivers, as the command `kincheck free` does.

    Args:
        case: a case, its name, or path; masses, loads and the rates at the start move it.
        duration: of the motion [s]; by default that of the case's [free].
        samples: number of samples, both ends included; by default that of [free].
        rates: at the start by driver or joint [m/s or rad/s]; by default those of [free].

    Raises:
        KincheckError: duration or samples are missing, or the mechanism has no free motion.
    """
    found = case if isinstance(case, Case) else load(case)
    own = found.free
    if (duration is None or samples is None) and own is None:
        raise KincheckError(
            f"case {found.name!r} says no duration of its free motion; give duration and samples"
        )
    given = own or Free(1.0, 2)
    asked = Free(
        given.duration if duration is None else duration,
        given.samples if samples is None else samples,
        given.rates if rates is None else rates,
    )
    return free_of(replace(found, free=asked))


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
