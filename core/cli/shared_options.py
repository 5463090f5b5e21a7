"""Options that commands share, and what they mean for cases, references and engines."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ..case.io.reader_options import Supplied
from ..errors import KincheckError
from ..harness.resource_limits import MEMORY, MOST, TIMEOUT, Limits
from ..options import (
    ONE_CASE,
    argument,
    group,
    joint_types,
    option,
    options,
    positive,
    whole,
)
from .parser import Command

if TYPE_CHECKING:
    from ..case.case import Case
    from ..case.io.reader_options import CurveOptions
    from ..harness.engine import Engine
    from ..harness.execution import Solver

T = TypeVar("T")

# Largest accepted constraint residual [m or -]: a thousand times the round-off of coordinates of
# one metre, and a thousandth of the outputs' 1e-9 m. A mechanism may amplify it a hundredfold
# unnoticed.
TOL = 1e-12

MODES = ("projection", "simulate")
MODE = "mode of the engines; default: projection, or simulate if an engine has only this"

HISTORY = "KINCHECK_HISTORY"
"""Environment variable: the history file if --history is not given."""

SCHEDULER = (
    "solve on the workers of this dask.distributed scheduler instead; it exchanges pickles: whoever"
    " runs or reaches it runs code as you, here and on the workers"
)


@options
class OfCase(Command):
    """A command on one case."""

    LAST = ("joint_type", "supplied")
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)


ISOLATION = "isolation"


def limit(text: str) -> float:
    """Return the number in the text of a limit."""
    number = positive(text)
    if number > MOST:
        raise KincheckError(f"{text!r} is too large. Give {MOST:g} at most.")
    return number


@options
class Isolated(Command):
    """A command for pairs of case and engine, each solved in a worker process."""

    HEADINGS: ClassVar[Mapping[str, str]] = {
        ISOLATION: "Each case is solved with each engine in a worker process."
    }
    jobs: int | None = option(
        "worker processes at a time; default: half the processors; 0 solves in this process,"
        " without limits: the default if only the native engine runs and no limit is given",
        whole(0),
        "N",
        heading=ISOLATION,
        default=None,
    )
    timeout: float | None = option(
        f"limit for one case with one engine; default {TIMEOUT:g}, a hundred times as long"
        " as the built-in cases take",
        limit,
        "SECONDS",
        heading=ISOLATION,
        default=None,
    )
    memory: float | None = option(
        f"limit for a worker process, on Linux; default {MEMORY:g}, sixteen times as much as"
        " the built-in cases take",
        limit,
        "GB",
        heading=ISOLATION,
        default=None,
    )
    scheduler: str | None = option(SCHEDULER, metavar="ADDRESS", heading=ISOLATION, default=None)


def contradictions(options: Isolated) -> list[str]:
    """Return the contradictions between the options."""
    problems: list[str] = []
    if options.scheduler is not None and options.jobs is not None:
        problems.append(
            "--scheduler: the cluster decides how many pairs run at a time. Leave out --jobs."
        )
    if options.jobs == 0 and (options.timeout or options.memory):
        problems.append(
            "--jobs 0 solves in this process, which cannot be limited. Leave out --timeout and"
            " --memory, or --jobs."
        )
    return problems


def unreachable(options: Any) -> list[str]:
    """Return why the requested cluster cannot be reached. This takes time, so it is the last check
    before the work.
    """
    if options.scheduler is None:
        return []
    from ..extensions.cluster.distributed import ClusterError, connect_client, load_distributed

    try:
        with connect_client(load_distributed(), options.scheduler):
            return []
    except ClusterError as error:
        return [str(error)]


def solver(options: Isolated, engines: Sequence[Engine]) -> tuple[Solver, dict[str, Any]]:
    """Return the solver of the pairs, and its settings for the results."""
    from ..extensions.cluster.distributed import on_cluster
    from ..harness.workers.pool import solver_for

    limits = Limits(options.timeout or TIMEOUT, options.memory or MEMORY)
    limited = {"timeout": limits.timeout, "memory_gb": limits.memory}
    if options.scheduler is not None:
        return on_cluster(options.scheduler, limits), {"scheduler": options.scheduler, **limited}
    wanted = limits if options.timeout or options.memory else None
    found, jobs = solver_for(engines, options.jobs, wanted)
    if jobs:
        from ..program.disk_cache import ready

        ready()  # its note would not be seen from a worker
    return found, {"jobs": jobs, **(limited if jobs else {})}


def return_cases(cases: Sequence[T], supplied: Supplied) -> tuple[list[T | str], Supplied]:
    """Return cases and facts with the files of --hold, --start and --without among the cases: these
    options take several names, and in `run --hold knee hip model.xml` also the file.
    """
    given = {name: getattr(supplied, name) for name in ("hold", "start", "without")}
    files = [name for each in given.values() for name in each if os.path.isfile(name)]
    left = {
        option: tuple(name for name in each if name not in files) for option, each in given.items()
    }
    return [*cases, *files], replace(supplied, **left)


def driver_value(text: str | None, case: Case) -> float | None:
    """Return the value of the swept driver in an option, in SI; None without one.

    Raises:
        KincheckError: it is no number, or has the unit of something else.
    """
    from ..case.case import TIME
    from ..case.io.document import measure
    from ..case.units import ANGLES, LENGTHS, SECOND

    if text is None:
        return None
    driver = case.sweep.driver
    turns = driver != TIME and case.mechanism.driver(driver).turns
    units = {"s": SECOND} if driver == TIME else ANGLES if turns else LENGTHS
    bare = "s" if driver == TIME else "rad" if turns else "m"
    try:
        return measure(text, units, bare)[0]
    except ValueError:
        raise KincheckError(
            f"--at: {text!r} is not a number with one of the units {', '.join(units)}, or in"
            f" {bare}. Give a value of the driver {driver}."
        ) from None


def with_references(
    cases: Sequence[Case], files: Sequence[Path], curve: CurveOptions, unused: list[str] | None
) -> tuple[list[Case], list[str]]:
    """Return the cases with the references in these files, and notes on how a curve was read.

    Raises:
        KincheckError: a file cannot be used, or a curve does not belong to one case.
    """
    from ..case.io.reference import PROVED
    from ..case.io.reference_curve import with_curve
    from ..case.io.reference_file import with_proved_references

    curves = [file for file in files if file.suffix.lower() != PROVED]
    proved = [file for file in files if file not in curves]
    if len(curves) > 1 or (curves and (proved or len(cases) != 1)):
        raise KincheckError(
            f"{curves[0]}: found {len(cases)} cases and {len(files)} references, expected a"
            " measured curve and its case alone. Run them one by one."
        )
    if not curves:
        return with_proved_references(cases, proved, unused), []
    case, notes = with_curve(cases[0], curves[0], curve)
    return [case], notes


RECORDINGS = "recordings"


@options
class WithRecordings(Command):
    """A command that judges results of other programs."""

    HEADINGS: ClassVar[Mapping[str, str]] = {
        RECORDINGS: "Results of other programs, beside the engines. --map and --accuracy say more."
    }
    recorded: Sequence[Path] = option(
        "results of the case as an engine with the file's name: a table, results of Adams"
        " (.res) or OpenSim (.mot, .sto), a MAT-file (.mat)",
        Path,
        "FILE",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    engine_command: Sequence[str] = option(
        'a program as an engine: "prog {case} {samples} {out}" reads the case (TOML) and its'
        " samples (CSV), and writes outputs or poses (CSV)",
        metavar="COMMAND",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    fmu: Sequence[Path] = option(
        "a functional mock-up unit (FMI 2 or 3) as an engine; --map VARIABLE=NAME says which"
        " variables are drivers and outputs of the case",
        Path,
        "FILE",
        several="repeated",
        heading=RECORDINGS,
        default=(),
    )
    analysis: str | None = option(
        "one of several analyses of results of Adams",
        metavar="NAME",
        heading=RECORDINGS,
        default=None,
    )


def foreign_engines(
    options: WithRecordings, cases: Sequence[Case], columns: Sequence[str]
) -> list[Engine]:
    """Return the programs of --engine-command and the FMUs of --fmu as engines.

    Raises:
        KincheckError: a command has another form, or an FMU cannot run.
    """
    if not (options.engine_command or options.fmu):
        return []
    from ..extensions.recorded.engine import ProgramEngine
    from ..extensions.recorded.fmu import read_fmu

    if options.fmu and len(cases) != 1:
        raise KincheckError(
            f"{options.fmu[0]}: found {len(cases)} cases, expected the one of the FMU. Name one."
        )
    return [
        *(ProgramEngine(command) for command in options.engine_command),
        *(read_fmu(file, cases[0], columns) for file in options.fmu),
    ]


def recorded_engines(
    files: Sequence[Path],
    case: Case,
    curve: CurveOptions,
    *,
    analysis: str | None = None,
    sheet: str | None = None,
) -> tuple[Case, list[Engine]]:
    """Return the case at the samples of its recordings, and the recordings as engines.

    Args:
        curve: meaning and accuracy of the columns.
        analysis: one of several in results of Adams.
        sheet: of a workbook.

    Raises:
        KincheckError: a recording cannot be read, or two have different samples.
    """
    import numpy as np

    from ..extensions.recorded.engine import RecordedEngine
    from ..extensions.recorded.meaning import Meaning, Reader, read_accuracy
    from ..extensions.recorded.readers import Head, read_recording
    from ..extensions.recorded.samples import samples_of
    from ..extensions.recorded.sweep import at_samples

    engines: list[Engine] = []
    found: Case | None = None
    for file in files:
        meanings: list[Meaning] = []

        def choose(
            heads: Sequence[Head], file: Path = file, meanings: list[Meaning] = meanings
        ) -> list[int]:
            meanings.append(Reader(file, case, heads).read(curve.columns))
            return sorted({use.column for use in meanings[-1].uses})

        recording = read_recording(file, choose, analysis=analysis, sheet=sheet)
        samples = samples_of(case, recording, meanings[-1])
        accuracy = read_accuracy(file, case, curve.accuracy)
        resampled = at_samples(case, samples)
        values = resampled.case.sweep.values
        if found is not None and not np.array_equal(values, found.sweep.values):
            raise KincheckError(
                f"{file}: found other samples than those of {files[0]}. Run recordings"
                " with different samples one by one."
            )
        found = found or resampled.case
        engines.append(RecordedEngine(file.stem, samples, resampled, accuracy))
    return found or case, engines
