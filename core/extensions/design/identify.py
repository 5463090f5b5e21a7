"""Combinations of moves by measured curves, and moves without any effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...case.case import Case
from ...trajectory import Array
from .likely import Estimate

NAMED = 100.0
"""Moves that can be named may have so many times the effect of round-off: no others have little
more than none."""
# Directions of size one are another, if so much is left beside those known.
_OWN = 1e-3
MOST_TERMS, LEAST_TERM = 4, 0.1
BETTER = 0.5**0.5
"""What is left of the drawing's deviation, where the rig tells as much."""


@dataclass(frozen=True, eq=False)
class Combination:
    """A combination of moves, with the largest coefficient one.

    Attributes:
        terms: coefficients by place.
        value, deviation, drawing: its size, and its deviations by the rig and by the drawing [m].
    """

    terms: Mapping[str, float]
    value: float
    deviation: float
    drawing: float

    @property
    def source(self) -> str:
        """Who tells more of it."""
        return source(self.deviation, self.drawing)

    @property
    def words(self) -> str:
        """The largest terms as a sum."""
        order = sorted(self.terms.items(), key=lambda each: -abs(each[1]))
        shown = [each for each in order[:MOST_TERMS] if abs(each[1]) >= LEAST_TERM]
        text = " ".join(
            f"{'-' if x < 0.0 else '+'} {'' if abs(x) > 0.995 else f'{abs(x):.2f} '}{place}"
            for place, x in shown
        )
        more = any(abs(x) >= LEAST_TERM for _, x in order[len(shown) :])
        return text.removeprefix("+ ") + " ..." * more


def source(deviation: float, drawing: float) -> str:
    """Return who tells more of a number: the rig, or the drawing."""
    return "from the rig" if deviation < BETTER * drawing else "from the drawing"


def combinations(estimate: Estimate, boxes: Mapping[str, float]) -> list[Combination]:
    """Return the combinations of moves, the best known first."""
    found = list[Combination]()
    for size, row in zip(*estimate.decomposed, strict=True):
        terms = row / np.array([*boxes.values()])
        largest = terms[np.abs(terms).argmax()]
        drawing = 1.0 / abs(float(largest))
        found.append(
            Combination(
                dict(zip(boxes, (terms / largest).tolist(), strict=True)),
                float(row @ estimate.u / largest),
                float(drawing / np.hypot(1.0, size)),
                drawing,
            )
        )
    return found


def without_effect(
    slopes: Array,
    null: float,
    case: Case,
    boxes: Mapping[str, float],
    moves: Mapping[str, float],
) -> list[str]:
    """Return names of combinations of moves without effect, as many as there are: places, points
    along the line to another one, all points together, and else their terms.

    Args:
        slopes: by the moves over their boxes, rows of size one.
        null: round-off, over the largest effect.
        boxes, moves: by place [m].
    """
    box = np.array([*boxes.values()])
    largest = np.linalg.norm(slopes, 2)
    names, known = list[str](), np.empty((0, len(box)))
    for name, direction in _candidates(case, moves):
        u = direction / box
        u /= np.linalg.norm(u)
        own = u - known.T @ (known @ u)
        if np.linalg.norm(own) > _OWN and np.linalg.norm(slopes @ u) <= NAMED * null * largest:
            names.append(name)
            known = np.vstack([known, own / np.linalg.norm(own)])
    others = np.linalg.svd(known)[2][len(known) :] if len(known) else np.eye(len(box))
    _, sizes, rows = np.linalg.svd(slopes @ others.T)
    sizes = np.append(sizes, np.zeros(len(rows) - len(sizes)))
    for row in rows[sizes <= null * largest] @ others:
        terms = row * box
        places = zip(moves, (terms / terms[np.abs(terms).argmax()]).tolist(), strict=True)
        names.append(Combination(dict(places), 0.0, 0.0, 0.0).words)
    return names


def _candidates(case: Case, moves: Mapping[str, float]) -> Iterator[tuple[str, Array]]:
    """Yield names and directions of moves [m] with possibly no effect, the plainest first."""
    places = [*moves]
    for place in places:
        yield f"{place} alone", np.array([float(each == place) for each in places])
    rows = {each.name: each for each in case.hardpoints}
    at = {
        name: np.array([sign * each.position[axis] for axis, sign in each.axes])
        + [moves.get(f"{name} {axis}", 0.0) for axis in "xyz"]
        for name, each in rows.items()
    }
    moving = dict.fromkeys(place.rpartition(" ")[0] for place in places)
    for one in moving:
        own = [f"{one} {axis}" for axis in "xyz"]
        for other in at:
            along = at[other] - at[one]
            if along.any() and all(
                place in moves for place, x in zip(own, along, strict=True) if x
            ):
                parts = dict(zip(own, along.tolist(), strict=True))
                direction = np.array([parts.get(place, 0.0) for place in places])
                yield f"{one} along the line to {other}", direction
    for axis in "xyz":
        along = np.array([float(place.endswith(f" {axis}")) for place in places])
        if along.any():
            yield f"all points together along {axis}", along
