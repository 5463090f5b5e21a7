"""What measured curves determine: combinations of moves, and moves without any effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...case.case import Case
from ...trajectory import Array
from .likely import Estimate

NULL = 2e-15
"""A combination whose singular value is this part of the largest has no effect: exact slopes leave
1e-16 of those that have none, and over the travel of a table 5e-14 or more of all others."""
# An effect that is named differs from none by round-off; directions are of size one.
_SAME, _OWN = 1e-6, 1e-3
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


def without_effect(slopes: Array) -> Array:
    """Return orthonormal combinations of the columns without effect, as rows."""
    _, sizes, rows = np.linalg.svd(slopes)
    sizes = np.append(sizes, np.zeros(len(rows) - len(sizes)))
    return rows[sizes <= NULL * sizes[0]]


def in_words(null: Array, case: Case, moves: Mapping[str, float], box: Array) -> list[str]:
    """Return names of combinations without effect, as many as there are: places, points that slide
    along the line to another one, all points together, and else their terms.

    Args:
        null: orthonormal combinations of the moves over their boxes, as rows.
        moves: by place [m].
    """
    names, left = list[str](), null
    for name, direction in _candidates(case, moves):
        u = direction / box
        u /= np.linalg.norm(u) or 1.0
        part = left @ u
        whole = np.linalg.norm(u - null.T @ (null @ u)) < _SAME
        if whole and len(left) and np.linalg.norm(part) > _OWN:
            names.append(name)
            # the rest of the space, without this direction
            basis = np.linalg.svd(part[None])[2][1:]
            left = basis @ left
    for row in left:
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
