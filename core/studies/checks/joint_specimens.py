"""Specimens of a joint type, made from the kinds of its fields; and the same specimen moved, scaled
or with longer axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass, replace
from typing import Any

import numpy as np

from ...errors import KincheckError, MechanismError
from ...joints import Joint, Kind
from ...trajectory import Array
from .traced_joint import BODIES, Place

# Usual size of a joint [m].
SIZE = 0.1
# Coordinates are whole multiples of this length [m], so a move by a thousand kilometres does not
# round them.
GRID = 2.0**-30
# Angles [degrees] of the two directions of a pair. First the cross of a universal joint, over a
# right angle by round-off, so that a joint with a positive cosine refuses it; then shafts that
# point in the same direction.
ANGLES = (90.0 + 1e-8, 40.0)


class SpecimenError(KincheckError):
    """No specimen of a joint type can be made."""


def specimens(joint_class: type[Joint], rng: np.random.Generator, count: int) -> list[Joint]:
    """Return instances of a joint type between bodies i and j: those of its classmethod
    `specimens`, or `count` random ones.

    Raises:
        SpecimenError: the class refuses geometry by the kinds of its fields, or a field
            has no kind.
    """
    offered: Callable[[], Sequence[Joint]] | None = getattr(joint_class, "specimens", None)
    if offered is not None:
        return list(offered())
    return [_random(joint_class, rng) for _ in range(count)]


def _random(joint_class: type[Joint], rng: np.random.Generator) -> Joint:
    remedy = f"offer some by a classmethod `specimens() -> list[{joint_class.__name__}]`"
    if not is_dataclass(joint_class) or getattr(joint_class, "__abstractmethods__", None):
        missing = ", ".join(sorted(getattr(joint_class, "__abstractmethods__", ()))) or "its fields"
        raise SpecimenError(f"{joint_class.__name__} is not complete: define {missing}")
    required = [
        each
        for each in fields(joint_class)
        if each.default is MISSING and each.default_factory is MISSING
    ]
    geometry = {
        each.name: each.metadata.get("kind")
        for each in required
        if each.name not in ("name", *BODIES)
    }
    unknown = [name for name, kind in geometry.items() if kind is None]
    if unknown:
        raise SpecimenError(
            f"{joint_class.__name__}: field {unknown[0]!r} has no kind; declare it by position(),"
            f" direction(), positions(), directions() or length(), or {remedy}"
        )
    refused = ""
    for angle in ANGLES:
        values = {name: _value(kind, rng, math.radians(angle)) for name, kind in geometry.items()}
        try:
            return joint_class(joint_class.__name__, *BODIES, **values)
        except MechanismError as error:
            refused = str(error)
    raise SpecimenError(
        f"{joint_class.__name__}: no specimen can be made of random geometry ({refused}); {remedy}"
    )


def _value(kind: Any, rng: np.random.Generator, angle: float) -> Any:
    centre = rng.uniform(-4.0 * SIZE, 4.0 * SIZE, 3)
    ends = [centre, centre + SIZE * _unit(rng.normal(size=3))]
    a, other = _unit(rng.normal(size=3)), rng.normal(size=3)
    b = math.cos(angle) * a + math.sin(angle) * _unit(other - (a @ other) * a)
    # directions may have any length
    stretch = rng.uniform(0.5, 2.0, 2)
    makers: Mapping[Kind, Callable[[], Any]] = {
        Kind.POSITION: lambda: _snapped(centre),
        Kind.POSITIONS: lambda: tuple(map(_snapped, ends)),
        Kind.DIRECTION: lambda: tuple((stretch[0] * a).tolist()),
        Kind.DIRECTIONS: lambda: (
            tuple((stretch[0] * a).tolist()),
            tuple((stretch[1] * b).tolist()),
        ),
        Kind.LENGTH: lambda: float(rng.uniform(0.5, 1.5) * SIZE),
    }
    return makers[kind]()


def place(joint: Joint, rng: np.random.Generator) -> Place:
    """Return body origins near the joint, but at none of its points, and a unit near its size."""
    points = np.array(joint.points_on()).reshape(-1, 3)
    lengths = [value for _, kind, value in joint.parts() if kind is Kind.LENGTH]
    size = (
        max(
            [
                float(np.ptp(points, axis=0).max()) if len(points) > 1 else 0.0,
                *(abs(x) for x in lengths if x),
            ]
        )
        or SIZE
    )
    centre = points.mean(axis=0) if len(points) else np.zeros(3)
    origins = (_snapped(centre + size * rng.uniform(-1.0, 1.0, 3)) for _ in BODIES)
    first, second = origins
    return Place((first, second), 2.0 ** round(math.log2(size)))


def between(joint: Joint) -> Joint:
    """Return the joint between the bodies i and j instead of its own, with its
    points on the grid.
    """
    return changed(replace(joint, i=BODIES[0], j=BODIES[1]), {Kind.POSITION: _snapped})


def moved(joint: Joint, offset: float) -> Joint:
    """Return the joint shifted along all three axes [m]."""
    return changed(joint, {Kind.POSITION: lambda point: tuple(x + offset for x in point)})


def stretched(joint: Joint, factor: float) -> Joint:
    """Return the joint with all directions longer by a factor."""
    return changed(joint, {Kind.DIRECTION: lambda axis: tuple(factor * x for x in axis)})


def changed(joint: Joint, ways: Mapping[Kind, Callable[[Any], Any]]) -> Joint:
    """Return the joint with its geometry mapped by the function for each kind,
    and validated again.
    """
    return replace(joint, **joint.mapped(ways))


def _unit(a: Array) -> Array:
    return np.asarray(a / np.linalg.norm(a))


def _snapped(point: Any) -> tuple[float, ...]:
    return tuple((np.round(np.asarray(point) / GRID) * GRID).tolist())
