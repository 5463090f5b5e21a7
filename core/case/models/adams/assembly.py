"""Assembly of a dataset: both markers of each joint brought together.

Adams Solver moves parts to agreement. So do these steps: the least motion of all parts that
closes the rows, by Gauss-Newton, from the parts as the dataset places them.
"""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....errors import shortened
from ....trajectory import Array
from ...curves import EXACT
from .dataset import Dataset, Statement
from .parts import Frame, Marker, Places, rotations

_POINT, _LINE, _PLANE = ("dx", "dy", "dz"), ("dx", "dy"), ("dz",)
_AXIS, _FRAME = ("zx", "zy"), ("zx", "zy", "xy")
ROWS: Mapping[str, Sequence[str]] = {
    "REVOLUTE": (*_POINT, *_AXIS),
    "TRANSLATIONAL": (*_LINE, *_FRAME),
    "CYLINDRICAL": (*_LINE, *_AXIS),
    "SPHERICAL": _POINT,
    "UNIVERSAL": (*_POINT, "zz"),
    "HOOKE": (*_POINT, "xy"),
    "FIXED": (*_POINT, *_FRAME),
    "PLANAR": (*_PLANE, *_AXIS),
    "SCREW": (*_LINE, *_AXIS),
    "CONVEL": (*_POINT, "xy-yx"),
    "ATPOINT": _POINT,
    "INLINE": _LINE,
    "INPLANE": _PLANE,
    "ORIENTATION": _FRAME,
    "PARALLEL_AXES": _AXIS,
    "PERPENDICULAR": ("zz",),
    "DISTANCE": ("d",),
}
"""Rows of each kind: dx is what I is off J along J's x axis, zy the product of I's z and J's y."""
MOST_STEPS, LONGEST_STEP = 100, 0.3
# As in the assembly of other models: rounding of composed frames, what is too far, and gaps of
# several joints that add up.
CLOSED, FAR, ADDED_UP = 1e-12, 0.1, 10.0
# Singular values of rows redundant within rounding.
WEAK = 1e-9
# What prints numbers writes six digits and more.
FEWEST = 6
_PLACED = ("QP", "QG", "ZP", "XP", "ZG", "XG", "REULER")
MOST_TOLD = 8


@dataclass(frozen=True, eq=False)
class Link:
    """A constraint of two markers.

    Attributes:
        length: of a DISTANCE [m].
    """

    statement: Statement
    kind: str
    i: Marker
    j: Marker
    length: float = 0.0

    def frames(self, places: Places) -> tuple[Frame, Frame]:
        """Return the frames of I and J, global."""
        return self.i.place.seen_from(places[self.i.part]), self.j.place.seen_from(
            places[self.j.part]
        )

    @property
    def rows(self) -> Sequence[str]:
        """Its rows; without the x axes if one of them is not known."""
        known = self.i.place.turned and self.j.place.turned
        return [row for row in ROWS[self.kind] if known or not row.startswith("xy")]


def tolerance_of(dataset: Dataset, size: float) -> tuple[float, str]:
    """Return the gaps that the digits of a dataset leave [m], and why.

    Numbers of six digits and more count, half of which have as many or more; without any, those
    that somebody set are exact.
    """
    placed = (
        statement.values.get(name, "")
        for statement in (*dataset.of("PART"), *dataset.of("MARKER"))
        for name in _PLACED
    )
    numbers = re.findall(r"[\d.]+", " ".join(placed))
    counts = [len(each.replace(".", "").strip("0")) for each in numbers]
    counts = [count for count in counts if count >= FEWEST]
    digits = int(statistics.median(counts)) if counts else EXACT
    limit = size * min(1e-5, max(CLOSED, 10.0 ** (1 - digits)))
    return limit, f"the file's digits, {digits}: {limit:.2g} m"


def size_of(markers: Collection[Marker], places: Places) -> float:
    """Return the largest extent of the markers along an axis [m]."""
    points = [each.place.seen_from(places[each.part]).origin for each in markers]
    extent = float(np.ptp(np.array(points), axis=0).max()) if points else 0.0
    return extent if extent > 1e-9 else 1.0


def assembled(
    dataset: Dataset,
    links: Sequence[Link],
    places: Places,
    moving: Collection[int],
    size: float,
    tolerance: float,
) -> tuple[dict[int, Frame], str]:
    """Return the frames of parts with both markers of each link together, and a note on how far
    they were apart; an empty one if they agreed.

    Raises:
        CaseError: axes point in opposite directions, the markers are too far apart, or cannot be
            brought together.
    """
    for link in links:
        _require_same_sense(link, places)
    gaps = {link.statement.name: _gap(link, places) for link in links}
    opened = {name: gap for name, gap in gaps.items() if max(gap[0], size * gap[1]) > CLOSED * size}
    if not opened:
        return {**places}, ""
    for link in links:
        shift, turn = gaps[link.statement.name]
        if shift > FAR * size or turn > FAR:
            raise link.statement.fault(
                f"its markers {link.i} and {link.j} are {_apart(shift, turn)} apart at the start,"
                f" expected {FAR * size:.3g} m and {math.degrees(FAR):.2g} degrees at most; Adams"
                " assembles them first: save the dataset after its assembly, or correct a marker"
            )
    weak = max(WEAK, ADDED_UP * tolerance / size)
    columns = {part: 6 * k for k, part in enumerate(sorted(moving))}
    free = np.ones(6 * len(columns))
    for part, first in columns.items():
        exact = dataset.statements["PART"][part].values.get("EXACT", "").upper()
        held = {word.strip() for word in re.split(r"[:,\x1f]", exact)}
        free[first : first + 3] = [letter not in held for letter in "XYZ"]
        free[first + 3 : first + 6] = held.isdisjoint(("PSI", "THETA", "PHI"))
    found = _closed(links, places, columns, free, size, weak)
    for link in links:
        shift, turn = _gap(link, found)
        if max(shift, size * turn) > max(ADDED_UP * tolerance, CLOSED * ADDED_UP * size):
            raise link.statement.fault(
                f"its markers {link.i} and {link.j} cannot be brought together: they are"
                f" {_apart(*gaps[link.statement.name])} apart as the dataset places them, and"
                f" {_apart(shift, turn)} in the nearest assembly; correct a marker or a part"
            )
    told = sorted(opened.items(), key=lambda each: -max(each[1][0], size * each[1][1]))
    moves = shortened([f"{name} by {_apart(*gap)}" for name, gap in told], MOST_TOLD)
    return found, f"markers that were apart at the start are assembled: {moves}"


def _apart(shift: float, turn: float) -> str:
    parts = [f"{shift:.3g} m"] if shift or not turn else []
    return " and ".join([*parts, *([f"{math.degrees(turn):.3g} degrees"] if turn else [])])


def _require_same_sense(link: Link, places: Places) -> None:
    if link.kind == "PARALLEL_AXES":
        return
    i, j = link.frames(places)
    pairs = {"zx": ("z", i.z, j.z), "xy": ("x", i.x, j.x)}
    for row in link.rows:
        if row in pairs and link.kind != "HOOKE":
            axis, one, other = pairs[row]
            if one @ other <= 0.0:
                angle = math.degrees(math.acos(max(-1.0, float(one @ other))))
                raise link.statement.fault(
                    f"the {axis} axes of its markers {link.i} and {link.j} are {angle:.3g} degrees"
                    " apart, expected the same direction; turn one of the markers"
                )


def _gap(link: Link, places: Places) -> tuple[float, float]:
    """Return how far the markers of a link are apart [m, rad]."""
    i, j = link.frames(places)
    values = {row: _residual(row, i, j, link.length) for row in link.rows}
    shift = math.hypot(*(x for row, x in values.items() if row[0] == "d"), 0.0)
    sine = math.hypot(*(x for row, x in values.items() if row[0] != "d"), 0.0)
    return shift, math.asin(min(1.0, sine))


def _products(row: str, i: Frame, j: Frame) -> list[tuple[float, Array, Array]]:
    """Return sign, axis of I and axis of J of the products of a row."""
    terms = [(1.0, row[:2]), (-1.0, row[3:])] if "-" in row else [(1.0, row)]
    return [(sign, getattr(i, a), getattr(j, b)) for sign, (a, b) in terms]


def _residual(row: str, i: Frame, j: Frame, length: float) -> float:
    apart = i.origin - j.origin
    if row == "d":
        return float(np.linalg.norm(apart)) - length
    if row[0] == "d":
        return float(apart @ getattr(j, row[1]))
    return float(sum(sign * (a @ b) for sign, a, b in _products(row, i, j)))


def _slopes(row: str, i: Frame, j: Frame, arms: Sequence[Array]) -> tuple[Array, Array]:
    """Return the derivatives of a row by shift and turn of I's part and of J's, shape (6,) each."""
    if row[0] == "d":
        apart = i.origin - j.origin
        e = apart / (np.linalg.norm(apart) or 1.0) if row == "d" else getattr(j, row[1])
        of_i = np.concatenate([e, np.cross(arms[0], e)])
        return of_i, -np.concatenate([e, np.cross(arms[1] + apart, e)])
    turn = sum((s * np.cross(a, b) for s, a, b in _products(row, i, j)), np.zeros(3))
    of_i = np.concatenate([np.zeros(3), turn])
    return of_i, -of_i


def _rows(
    links: Sequence[Link], places: Places, columns: Mapping[int, int], size: float
) -> Iterator[tuple[float, Array]]:
    """Yield residual and derivatives of all rows, lengths over the size."""
    for link in links:
        i, j = link.frames(places)
        arms = [f.origin - places[m.part].origin for f, m in ((i, link.i), (j, link.j))]
        for row in link.rows:
            unit = size if row[0] == "d" else 1.0
            slope = np.zeros(6 * len(columns))
            for marker, part in zip((link.i, link.j), _slopes(row, i, j, arms), strict=True):
                if marker.part in columns:
                    first = columns[marker.part]
                    scaled = np.concatenate([size * part[:3], part[3:]]) / unit
                    slope[first : first + 6] += scaled
            yield _residual(row, i, j, link.length) / unit, slope


def _closed(
    links: Sequence[Link],
    places: Places,
    columns: Mapping[int, int],
    free: Array,
    size: float,
    weak: float,
) -> dict[int, Frame]:
    """Return the frames of the nearest assembly found.

    Args:
        columns: first unknown of each part.
        free: one for the unknowns that may change, else zero.
        weak: singular values below this are of rows redundant within the digits.
    """
    found, best, least = {**places}, {**places}, math.inf
    for _ in range(MOST_STEPS):
        residuals, slopes = map(np.array, zip(*_rows(links, found, columns, size), strict=True))
        left = float(np.abs(residuals).max())
        if left < least:
            best, least = {**found}, left
        elif left < 1e-9:
            break
        step = -free * np.linalg.lstsq(slopes * free, residuals, rcond=weak)[0]
        step *= min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        for part, first in columns.items():
            shift, turn = size * step[first : first + 3], step[first + 3 : first + 6]
            old = found[part]
            found[part] = Frame(
                old.origin + shift, rotations().from_rotvec(turn).as_matrix() @ old.axes, old.turned
            )
    return best
