"""Options that commands share, and what they mean for cases, references and engines."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ..case.io.reader_options import Supplied
from ..doors import offers
from ..errors import KincheckError
from ..harness.resource_limits import MEMORY, MOST, TIMEOUT, Limits
from ..options import (
    ONE_CASE,
    argument,
    asked,
    group,
    joint_types,
    option,
    option_fields,
    options,
    positive,
    whole,
)
from .engine_source import WORKERS, options_for, sources
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


@options
class OfCase(Command):
    """A command on one case."""

    LAST = ("joint_type", "supplied")
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)


ISOLATION = "isolation"
_Workers: Any = options_for(WORKERS)


def limit(text: str) -> float:
    """Return the number in the text of a limit."""
    number = positive(text)
    if number > MOST:
        raise KincheckError(f"{text!r} is too large. Give {MOST:g} at most.")
    return number


@options
class Isolated(_Workers):  # pyright: ignore[reportUntypedBaseClass]
    """A command for pairs of case and engine, each solved in a worker process."""

    LAST = tuple(each.name for each, *_ in option_fields(_Workers))

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


def contradictions(options: Isolated) -> list[str]:
    """Return the contradictions between the options."""
    found = asked(sources(WORKERS), options)
    problems = [line for each in found for line in each.contradictions(options)]
    if options.jobs == 0 and (options.timeout or options.memory):
        problems.append(
            "--jobs 0 solves in this process, which cannot be limited. Leave out --timeout and"
            " --memory, or --jobs."
        )
    return problems


def unreachable(options: Isolated) -> list[str]:
    """Return why requested workers cannot be reached. This takes time, so it is the last check
    before the work.
    """
    return [line for each in asked(sources(WORKERS), options) for line in each.unreachable(options)]


def solver(options: Isolated, engines: Sequence[Engine]) -> tuple[Solver, dict[str, Any]]:
    """Return the solver of the pairs, and its settings for the results."""
    from ..harness.workers.pool import solver_for

    limits = Limits(options.timeout or TIMEOUT, options.memory or MEMORY)
    limited = {"timeout": limits.timeout, "memory_gb": limits.memory}
    for source in asked(sources(WORKERS), options):
        if elsewhere := source.solver(options, limits):
            return elsewhere[0], elsewhere[1] | limited
    wanted = limits if options.timeout or options.memory else None
    found, jobs = solver_for(engines, options.jobs, wanted)
    if jobs:
        from ..program.disk_cache import ready

        ready()  # its note would not be seen from a worker
    return found, {"jobs": jobs, **(limited if jobs else {})}


def return_cases(cases: Sequence[T], supplied: Supplied) -> tuple[list[T | str], Supplied]:
    """Return cases and facts with the files among the names of options such as --hold among the
    cases: these take several names, and in `run --hold knee hip model.xml` also the file.
    """
    given = {
        each.name: getattr(supplied, each.name)
        for each, meaning, _ in option_fields(type(supplied))
        if meaning and meaning.action == "extend"
    }
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
    for reader in offers("references").values():
        case, notes = reader.load()(cases[0], curves[0], curve)
        return [case], notes
    raise KincheckError(
        f"{curves[0]}: found no reader of it, expected a proved reference ({PROVED})."
    )
