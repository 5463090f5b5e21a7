"""Curves of many designs: outputs over the sweep of a case by offsets of its geometry, and their
slopes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...caches import cache_last
from ...case.case import Case
from ...dataset import Dataset, Variable
from ...driving import Driving, in_words
from ...errors import CaseError, number_of, unknown
from ...input_checks import names_of, real
from ...joints import Kind
from ...mechanism.motions import PointCoordinate
from ...tabular import Tabular
from ...trajectory import Array
from ..designs.outputs import DesignOutputs
from .varied_places import Geometry, Moves, PlaceError, by_place

# Cases kept ready: for an optimisation that asks again and again, with and without slopes.
READY = 8


@dataclass(frozen=True, eq=False, repr=False)
class DesignCurves(Tabular):
    """Outputs of V designs over n samples, in SI units and radians.

    Attributes:
        values: by output, shape (V, n); NaN where it has no value.
        solved: whether each sample of each design was reached, shape (V, n).
        slopes: derivatives of outputs by the places, drivers held, shape (V, n, places); NaN where
            an output has no value.
        units: of the outputs; of a slope, the output's by that of the place.
        places: the varied places and their units, m, rad, or that of a load.
        messages: by design, the reason of missing samples.
        reasons: by output without a value at some samples that were reached, the reason.
        drive: driver values, times and their units.
    """

    values: Mapping[str, Array]
    solved: NDArray[np.bool_]
    slopes: Mapping[str, Array]
    units: Mapping[str, str]
    places: Mapping[str, str]
    messages: Mapping[int, str]
    reasons: Mapping[str, str]
    drive: Driving

    def summary(self) -> str:
        """Return the driver's range, the numbers of designs, samples and outputs."""
        count, samples = self.solved.shape
        return (
            f"{in_words(self.drive)}, {number_of(count, 'design')} of"
            f" {number_of(samples, 'sample')}, {number_of(len(self.values), 'output')}"
        )

    def dataset(self) -> Dataset:
        """Return outputs and slopes by design, sample and place."""
        dims = ("design", "sample")
        coords = {**self.drive.coords(), "design": Variable("design", np.arange(len(self.solved)))}
        variables = {
            name: Variable(dims, values, self.units[name]) for name, values in self.values.items()
        }
        if self.slopes:
            coords["place"] = Variable("place", [*self.places])
        for name, slopes in self.slopes.items():
            by = dict.fromkeys(self.places.values())
            unit = f"{self.units[name]}/{next(iter(by))}" if len(by) == 1 else ""
            variables[f"{name}.slopes"] = Variable((*dims, "place"), slopes, unit)
        variables["solved"] = Variable(dims, self.solved)
        return Dataset(dims, coords, variables, next(iter(self.drive.values)))


@dataclass(frozen=True, eq=False)
class ReadyCurves:
    """A case made ready for designs with offsets of its places.

    Attributes:
        varied: moves of the geometry by the named places.
        units: of the named places.
    """

    outputs: DesignOutputs
    varied: Moves
    units: Mapping[str, str]
    with_slopes: tuple[str, ...] = ()

    @property
    def drive(self) -> Driving:
        """Driver values and times of the samples."""
        case = self.outputs.case
        turning = {each.name: each.turns for each in case.mechanism.drivers}
        moved, unit = case.sweep.moved, {None: "s", True: "rad", False: "m"}
        units = {name: unit[turning.get(name)] for name in moved}
        return Driving(case.sweep.path.times, moved, units)

    def solve(self, offsets: Array, tol: float) -> DesignCurves:
        """Return the curves of designs; see `curves`."""
        (count, places), n = offsets.shape, len(self.outputs.path.times)
        # in memory designs stand side by side, as they are solved
        values = {name: np.empty((n, count)).T for name in self.outputs.outputs}
        slopes = {name: np.empty((places, n, count)).T for name in self.with_slopes}
        solved, messages = np.empty((n, count), dtype=np.bool_).T, dict[int, str]()
        for first in range(0, count, at_once := self.outputs.at_once):
            here = slice(first, min(first + at_once, count))
            part = self.outputs.solve(self.varied.geometry(offsets[here].T), tol)
            solved[here] = part.solved.T
            messages |= {first + k: why for k, why in part.found.messages.items()}
            for name, each in values.items():
                each[here] = part.values(name).T
            for name, _, by in part.slopes(self.varied.moves):
                slopes[name][here] = by.T
        outputs = self.outputs.outputs
        return DesignCurves(
            values,
            solved,
            slopes,
            {name: each.unit for name, each in outputs.items()},
            self.units,
            messages,
            {
                name: each.undefined
                for name, each in outputs.items()
                if each.undefined and np.isnan(values[name][solved]).any()
            },
            self.drive,
        )


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
        tol: as for `solve`.

    Raises:
        CaseError: there is no such place or output, or the case drives the absolute position of a
            point that varies.
        SolveError: offsets have a wrong shape or are not finite, or the nominal design cannot be
            solved.
    """
    return next(curves_by_chunk(case, places, [offsets], outputs, slopes, tol=tol))


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
    ready = prepare_curves(case, places, outputs, slopes)
    return (ready.solve(_offsets(ready, each), tol) for each in offsets)


def prepare_curves(
    case: str | Path | Case,
    places: Sequence[str],
    outputs: Sequence[str] | None = None,
    slopes: Sequence[str] = (),
) -> ReadyCurves:
    """Return a case made ready for `curves`; the last few are kept."""
    if not isinstance(case, Case):
        from ...cli.main import registry

        case = registry().find_case(case, driven=False)
    given = None if outputs is None else names_of("curves", "outputs", outputs)
    varied = names_of("curves", "places", places)
    return _ready(case, varied, names_of("curves", "slopes", slopes), given)


@cache_last(READY)
def _ready(
    case: Case, names: tuple[str, ...], slopes: tuple[str, ...], outputs: tuple[str, ...] | None
) -> ReadyCurves:
    known = {each.name: each for each in case.outputs}
    wanted = tuple(known) if outputs is None else outputs
    for name in (*wanted, *slopes):
        if name not in known:
            raise CaseError(f"curves: {unknown('output', name, known)}")
    chosen = [known[name] for name in dict.fromkeys((*wanted, *slopes))]
    case = replace(case, outputs=tuple(chosen))
    varied, units = moved_by(case, names, shared=True)
    designs = DesignOutputs.of(case, varied.places, slopes=dict.fromkeys(slopes, 1))
    return ReadyCurves(designs, varied, units, slopes)


def moved_by(
    case: Case, names: Sequence[str], *, shared: bool = False
) -> tuple[Moves, Mapping[str, str]]:
    """Return the moves of the geometry by named numbers, and the units of these.

    Args:
        shared: whether all rows of a table are among its places: programs with these as inputs
            serve any numbers of a template.

    Raises:
        CaseError: there is no such place, or the case drives the absolute position of a point that
            varies.
    """
    if not names:
        raise CaseError("curves: places names nothing to vary, expected 'lca_front z' or the like")
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise CaseError(f"curves: places names {twice!r} twice; add its offsets in one column")
    geometry = Geometry(case)
    found = [_number(geometry, name) for name in names]
    moves = by_place([moved for moved, _ in found])
    still = geometry.moves([*geometry.rows.values()]) if shared else {}
    every = {place: np.zeros((len(each), len(names))) for place, each in still.items()}
    varied = Moves.of(geometry.values, every | moves)
    for driver in case.mechanism.drivers:
        if not isinstance(driver, PointCoordinate) or driver.relative:
            continue
        if (point := f"points.{driver.point}.position") in moves:
            raise CaseError(
                f"curves: driver {driver.name!r} gives the absolute position of a point that"
                f" varies, {point}; drive it with relative = true, or leave the point"
            )
    return varied, {name: unit for name, (_, unit) in zip(names, found, strict=True)}


def _number(geometry: Geometry, name: str) -> tuple[dict[str, Array], str]:
    """Return the derivatives of the numbers of each place that follows a named number, and its
    unit.

    Raises:
        CaseError: there is none of the name, or it is three numbers.
    """
    whole, _, axis = name.rpartition(" ")
    component = whole != "" and axis in ("x", "y", "z")
    try:
        variable = geometry.variable(whole if component else name)
    except PlaceError as error:
        raise CaseError(f"curves: place {name!r}, {error}") from None
    alone = len(variable.numbers) == 1
    if alone == component:
        what = "one number" if alone else "three numbers"
        remedy = f"give {variable.name!r}" if alone else f"give {f'{variable.name} x'!r}, y or z"
        raise CaseError(f"curves: place {name!r} is one of {what}; {remedy}")
    column = 0 if alone else "xyz".index(axis)
    number = variable.kind is Kind.NUMBER
    unit = geometry.dimensions[variable.name].of("m", "rad") if number else "m"
    return variable.columns[column], "rad" if variable.kind is Kind.DIRECTION else unit


def _offsets(ready: ReadyCurves, given: ArrayLike) -> Array:
    found = real("curves", "offsets", given, "a row for each design, a column for each place")
    expected = ready.varied.moves.shape[1]
    if found.shape[1:] != (expected,):
        raise CaseError(
            f"curves: offsets have shape {found.shape}, expected (designs, {expected}): a column"
            " for each place"
        )
    if not np.isfinite(found).all():
        raise CaseError("curves: offsets are not finite everywhere; give finite numbers")
    return found
