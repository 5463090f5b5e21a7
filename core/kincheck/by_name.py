"""Functions on cases and engines by name, as on the command line."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ParamSpec, Protocol, TypeVar

from kincheck.core import KincheckError
from kincheck.core.case.case import Case
from kincheck.core.case.io.reader_options import NOTHING, Supplied
from kincheck.core.cli.checks import CheckEngine
from kincheck.core.cli.compare import Compare
from kincheck.core.cli.examine import Explain, MoveFreely
from kincheck.core.cli.main import registry
from kincheck.core.cli.registry import Registry
from kincheck.core.cli.run import Run
from kincheck.core.cli.serve import Serve
from kincheck.core.cli.sweep import Sweep
from kincheck.core.harness.engine import Engine
from kincheck.core.harness.record import Results
from kincheck.core.options import function_of, several
from kincheck.core.report.report import write_report
from kincheck.core.studies import curves as studied
from kincheck.core.studies.compliance import study
from kincheck.core.studies.compliance.study import ComplianceResults
from kincheck.core.studies.curves import DesignCurves
from numpy.typing import ArrayLike

_Options = ParamSpec("_Options")
_Answer = TypeVar("_Answer")
_Answer_co = TypeVar("_Answer_co", covariant=True)


class _Command(Protocol[_Answer_co]):
    def answer(self, registry: Registry) -> _Answer_co: ...


def _function(
    name: str, command: Callable[_Options, _Command[_Answer]]
) -> Callable[_Options, _Answer]:
    """Return the function of a command: its arguments are the options."""

    found: Any = function_of(name, command, lambda options: options.answer(registry()))
    return found


run = _function("run", Run)
explain = _function("explain", Explain)
sweep = _function("sweep", Sweep)
free = _function("free", MoveFreely)
compare = _function("compare", Compare)
check_engine = _function("check_engine", CheckEngine)
live = _function("live", Serve)


def load(name: str | Path, supplied: Supplied = NOTHING) -> Case:
    """Return the built-in case of a name, or the case in a file.

    Args:
        name: name of the case, or path to a case file, hardpoint table or model.
        supplied: facts missing in a file of another tool.

    Raises:
        KincheckError: there is no such case, or its file is invalid.
    """
    return registry().find_case(name, supplied, driven=False)


def compliance(
    case: str | Path | Case,
    travel: Sequence[float] | None = None,
    loads: Mapping[str, float | Sequence[float]] | None = None,
    axle: str = "heave",
    *,
    engines: str | Engine | Sequence[str | Engine] = (),
    jobs: int | None = None,
) -> ComplianceResults:
    """Return the kinematics and compliance of a suspension, as the command `kincheck kc` does.

    Args:
        case: name, path or case.
        travel: of the wheel from design [m], by default 60 mm up and down; of the steering if
            `axle` is "steer".
        loads: values by load, "lateral", "longitudinal", "braking" or "aligning" [N, N m], each
            applied at design; one number acts over all travel.
        axle: motion of both wheels: "heave", "roll" or "steer".
        engines: names or engines that find the equilibria by themselves; `checked` has their
            records, judged against native.
        jobs: number of worker processes, as of `run`.

    Raises:
        KincheckError: the case lacks facts, or a sample has no equilibrium; the message gives the
            last load with one.
    """
    found = study.compliance(case if isinstance(case, Case) else load(case), travel, loads, axle)
    if found.failures:
        raise KincheckError("\n".join(found.failures))
    if not (team := several(engines)):
        return found
    return replace(found, checked=run(found.cases, ("native", *team), jobs=jobs))


def curves(
    case: str | Path | Case,
    places: Sequence[str],
    offsets: ArrayLike,
    outputs: Sequence[str] | None = None,
    slopes: Sequence[str] = (),
    *,
    tol: float = 1e-12,
) -> DesignCurves:
    """Return outputs of many designs over the sweep of a case, and their slopes by the places.

    The outputs are part of the compiled program, which is made at the first call for a case; the
    last few are kept: give the case itself, not its name, to ask again and again. Slopes are exact
    derivatives at each design, not differences.

    Args:
        case: name, path or case; the nominal design.
        places: numbers of the geometry as `kincheck explain` names them: row and axis of a table of
            hardpoints ("tierod_inner z"), else the place of a case file and its axis
            ("joints.tie_rod.points.0 z"), or a length ("joints.tie_rod.length").
        offsets: of the places from the nominal design, shape (designs, places) [m or rad], along
            the axes of the table; of the axis of a joint, the angle by which it turns.
        outputs: names of outputs; all by default.
        slopes: names of those outputs whose slopes are wanted.
        tol: largest accepted residual, relative to the mechanism's size.

    Raises:
        CaseError: there is no such place or output, or the case drives the absolute position of a
            point that varies.
        SolveError: offsets are no numbers, or the nominal design cannot be solved.
    """
    known = case if isinstance(case, Case) else load(case)
    return studied.curves(known, places, offsets, outputs, slopes, tol=tol)


def curves_by_chunk(
    case: str | Path | Case,
    places: Sequence[str],
    offsets: Iterable[ArrayLike],
    outputs: Sequence[str] | None = None,
    slopes: Sequence[str] = (),
    *,
    tol: float = 1e-12,
) -> Iterator[DesignCurves]:
    """Yield the curves of one chunk of designs after the other: the memory of millions of designs
    is that of one chunk.

    Args:
        offsets: of each chunk; all other arguments are those of `curves`.

    Raises:
        CaseError, SolveError: as `curves`.
    """
    known = case if isinstance(case, Case) else load(case)
    return studied.curves_by_chunk(known, places, offsets, outputs, slopes, tol=tol)


def report(results: Results, file: str | Path) -> None:
    """Write results as the report of `kincheck run --out`: one HTML file, worst first.

    Raises:
        KincheckError: these are no results.
        OSError: the file cannot be written.
    """
    if not isinstance(results, Results):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise KincheckError(f"report: found {results!r}, expected what kincheck.run returns")
    write_report(results, Path(file))
