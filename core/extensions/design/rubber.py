"""Rates of bushings in doubt: curves of `kincheck kc` over the travel, by logarithms of rates.

A place "lca_front y" is the stiffness of this bushing along y of its own axes, on both sides of an
axle. Slopes are central differences.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...caches import cache_last
from ...case.case import Case
from ...case.io.toml_text import toml_table
from ...case.quantity import Output
from ...case.units import Unit
from ...driving import Driving
from ...mechanism.loads import Bushing
from ...trajectory import Array
from ..compliance.study import compliance
from ..sweep.curves import DesignCurves
from .goals import Movable

PERCENT = Unit("%", 0.01, lambda number: 0.01 * number)
STEP = 1e-3
"""Step of a logarithm: curvature changes slopes by 1e-7 of themselves, round-off by less."""
NULL = 1e-6
# Studies kept: those of a slope of twenty rates.
_KEPT = 64


@dataclass(frozen=True, eq=False)
class OnRubber(Output):
    """A curve of `kincheck kc`, for its name and unit."""


def rates_of(case: Case) -> Movable:
    """Return the rates of the bushings of a case."""
    names = {(name := _role(each)): name for each in case.mechanism.bushings}
    return Movable(names, {PERCENT.name: PERCENT}, PERCENT.name)


def on_rubber(case: Case) -> Case:
    """Return the case with the curves of `kincheck kc` as outputs.

    Raises:
        KincheckError: the case has no wheel on a rig, or no equilibrium.
    """
    known = {each.name for each in case.outputs}
    axis = (1.0, 0.0, 0.0)
    others = [
        OnRubber(name, "", axis, False, 0.0, 0.0, "", each.unit.replace("(N m)", "N/m"))
        for name, each in compliance(case, case.sweep.change).travel.outputs.items()
        if name not in known
    ]
    return replace(case, outputs=(*case.outputs, *others))


def rubber_curves(
    case: Case,
    places: Sequence[str],
    offsets: ArrayLike,
    outputs: Sequence[str],
    slopes: Sequence[str] = (),
) -> DesignCurves:
    """Return curves and their slopes as `kincheck.curves` does, of one design.

    Args:
        case: of `on_rubber`.
        offsets: of the logarithms of the rates, shape (1, places).
    """
    moves = np.asarray(offsets, dtype=np.float64)[0]

    def at(where: Array) -> tuple[Mapping[str, Array], NDArray[np.bool_]]:
        return _study(case, tuple(places), tuple(where.tolist()))

    here, reached = at(moves)
    steps: list[Array] = [*(STEP * np.eye(len(moves)))] if slopes else []
    ends = [(at(moves + step)[0], at(moves - step)[0]) for step in steps]
    by = {
        name: np.stack([(a[name] - b[name]) / (2.0 * STEP) for a, b in ends], axis=-1)[None]
        for name in slopes
    }
    values = {name: here[name][None] for name in outputs}
    solved = reached[None]
    drive = Driving(case.sweep.path.times, case.sweep.moved, {})
    return DesignCurves(values, solved, by, {}, {}, {}, {}, drive)


@cache_last(_KEPT)
def _study(
    case: Case, places: tuple[str, ...], moves: tuple[float, ...]
) -> tuple[Mapping[str, Array], NDArray[np.bool_]]:
    """Return the curves, and whether there is an equilibrium."""
    rates = dict(zip(places, np.exp(moves).tolist(), strict=True))
    mechanism = case.mechanism
    soft = [replace(each, stiffness=_scaled(each, rates)) for each in mechanism.bushings]
    outputs = tuple(each for each in case.outputs if not isinstance(each, OnRubber))
    case = replace(case, mechanism=replace(mechanism, bushings=soft), outputs=outputs)
    found = compliance(case, case.sweep.change).travel
    return {name: each.values for name, each in found.outputs.items()}, found.reached


def _role(bushing: Bushing) -> str:
    """Return the name of a bushing without that of its joint."""
    return bushing.name.rpartition(".")[2]


def _scaled(bushing: Bushing, rates: Mapping[str, float]) -> tuple[float, float, float]:
    x, y, z = (
        k * rates.get(f"{_role(bushing)} {axis}", 1.0)
        for k, axis in zip(bushing.stiffness, "xyz", strict=True)
    )
    return x, y, z


def new_bushings(file: Path, case: Case, moves: Mapping[str, float]) -> str:
    """Return a file of bushings with other rates.

    Args:
        moves: of the logarithms of the rates, by place.
    """
    rates = {place: float(np.exp(move)) for place, move in moves.items()}
    stiff = {_role(each): list(_scaled(each, rates)) for each in case.mechanism.bushings}
    lines = list[str]()
    for role, keys in tomllib.loads(file.read_text("utf-8"))["bushings"].items():
        lines += toml_table(keys | {"stiffness": stiff.get(role, keys)}, "bushings", role)
    return "\n".join(lines).lstrip() + "\n"
