"""What measured curves determine: combinations of moves, and moves without any effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...case.case import Case
from ...trajectory import Array
from .likely import Estimate

NULL = 3e-15
"""A combination whose singular value is this part of the largest has no effect: exact slopes leave
some 1e-16 of those that have none."""
# Directions of size one are another, if so much is left beside those known.
_OWN = 1e-3
MOST_TERMS, LEAST_TERM = 4, 0.1


@dataclass(frozen=True, eq=False)
class Combination:
    """A combination of moves, with the largest coefficient one.

    Attributes:
        terms: coefficients by place.
        value, deviation, drawing: its size, its deviation, and that by the drawing [m].
    """

    terms: Mapping[str, float]
    value: float
    deviation: float
    drawing: float

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


def combinations(estimate: Estimate, boxes: Mapping[str, float]) -> list[Combination]:
    """Return the combinations of moves that the numbers tell apart, the best known first."""
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


def without_effect(slopes: Array, case: Case, moves: Mapping[str, float], box: Array) -> list[str]:
    """Return names of combinations of moves without effect, as many as there are: places, points
    that slide along the line to another one, all points together, and else their terms.

    Args:
        slopes: by the moves over their boxes, rows of size one.
        moves: by place [m].
    """
    _, sizes, rows = np.linalg.svd(slopes)
    sizes = np.append(sizes, np.zeros(len(rows) - len(sizes)))
    null = rows[sizes <= NULL * sizes[0]]
    names, known = list[str](), np.empty((0, len(box)))
    for name, direction in _candidates(case, moves):
        u = direction / box
        u /= np.linalg.norm(u)
        own = u - known.T @ (known @ u)
        new = np.linalg.norm(own) > _OWN and len(names) < len(null)
        if new and np.linalg.norm(slopes @ u) <= NULL * sizes[0]:
            names.append(name)
            known = np.vstack([known, own / np.linalg.norm(own)])
    rest = null - (null @ known.T) @ known
    for row in np.linalg.svd(rest)[2][: len(null) - len(names)]:
        terms = row * box
        places = zip(moves, (terms / terms[np.abs(terms).argmax()]).tolist(), strict=True)
        names.append(Combination(dict(places), 0.0, 0.0, 0.0).words)
    return names


def _candidates(case: Case, moves: Mapping[str, float]) -> Iterator[tuple[str, Array]]:
    """Yield names and directions of moves [m] that may have no effect, the plainest first."""
    places = [*moves]

    def direction(parts: Mapping[str, Sequence[float]]) -> Array | None:
        found = np.zeros(len(places))
        for name, vector in parts.items():
            for axis, x in zip("xyz", vector, strict=True):
                if f"{name} {axis}" in moves:
                    found[places.index(f"{name} {axis}")] = x
                elif abs(x) > 0.0:
                    return None
        return found

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
        for other in at:
            along = at[other] - at[one]
            if (found := direction({one: along.tolist()})) is not None and along.any():
                yield f"{one} along the line to {other}", found
    for axis, vector in zip("xyz", np.eye(3).tolist(), strict=True):
        if (found := direction(dict.fromkeys(moving, vector))) is not None:
            yield f"all points together along {axis}", found
