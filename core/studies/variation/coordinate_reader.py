"""Reader of the coordinates of one hardpoint: their distributions, or their listed offsets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...case.io.document import fault, join, shown
from ...mechanism.body import ANGLE, Dimension
from .distributions import Law
from .modes import Mode
from .variation import Coordinate
from .variation_schema import HardpointKeys

# A normal offset exceeds this number of standard deviations about once in a thousand million draws.
FARTHEST = 6.0

_BOTH = frozenset(("sigma", "half_width"))
_DRAWN: Mapping[str | None, Sequence[frozenset[str]]] = {
    None: (frozenset({"sigma"}), frozenset({"half_width"})),
    Law.NORMAL: (frozenset({"sigma"}),),
    Law.UNIFORM: (frozenset({"half_width"}),),
    Law.TRUNCATED_NORMAL: (_BOTH,),
    Law.TRIANGULAR: (frozenset({"half_width"}),),
}
_LISTED: Mapping[Mode, Sequence[frozenset[str]]] = {
    Mode.GRID: (frozenset({"values"}), frozenset({"half_width", "steps"})),
    Mode.ONE_AT_A_TIME: tuple(
        map(frozenset, ({"values"}, {"half_width"}, {"half_width", "steps"}, {"sigma"}))
    ),
}


@dataclass(frozen=True)
class CoordinateReader:
    """Reads the coordinates of a hardpoint.

    Attributes:
        key: key of the hardpoint in the file.
        name: name of the hardpoint.
        unit, scale: SI unit of the offsets, and the file's unit in this unit.
    """

    file: Path
    key: str
    name: str
    mode: Mode
    unit: str
    scale: float

    def read(self, keys: HardpointKeys, count: int) -> list[tuple[int, Coordinate]]:
        """Return the varied coordinates, each with its index in the hardpoint.

        Args:
            count: number of coordinates: one, or three for a position or direction.

        Raises:
            CaseError: keys are missing or superfluous, or a value makes no sense.
        """
        self._check_keys(keys)
        axes = ("",) if count == 1 else ("x", "y", "z")
        if keys.values is not None:
            lists = self._lists(keys.values, count)
            return [
                each
                for row, offsets in enumerate(lists)
                for each in self._listed(row, axes[row], [self.scale * x for x in offsets])
            ]
        sigma, half_width = self._sizes(keys.sigma, count), self._sizes(keys.half_width, count)
        law = Law.UNIFORM if keys.sigma is None else Law.NORMAL
        if keys.distribution is not None:
            law = Law(keys.distribution)
        found: list[tuple[int, Coordinate]] = []
        for row, axis in enumerate(axes):
            sizes = [self.scale * each[row] for each in (sigma, half_width) if each]
            if 0.0 in sizes:
                continue
            if self.mode is Mode.MONTE_CARLO:
                bound = sizes[1] if law is Law.TRUNCATED_NORMAL else 0.0
                each = Coordinate(self.name, axis, self.unit, law, sizes[0], bound=bound)
                found.append((row, each))
            else:
                steps = sizes[0] * np.linspace(-1.0, 1.0, keys.steps or 2)
                found += self._listed(row, axis, steps.tolist())
        return found

    def require_physical(self, value: float, each: Coordinate, dimension: Dimension) -> None:
        """Raise CaseError if a mass or another size of a load may become negative.

        Args:
            value: value at the nominal design [SI].
        """
        if each.law is Law.VALUES:
            lowest = min(each.values)
        else:
            lowest = -(FARTHEST if each.law is Law.NORMAL else 1.0) * (each.bound or each.scale)
        if dimension is ANGLE or value + lowest >= 0.0:
            return
        remedy = "vary it less"
        if each.law is Law.NORMAL:
            remedy += ', or give distribution = "truncated_normal" with a half_width'
        raise self._fault(
            f"found offsets down to {lowest:g} {self.unit} from {value:g} {self.unit}, expected"
            f" zero or more of every variant; {remedy}"
        )

    def _check_keys(self, keys: HardpointKeys) -> None:
        given = frozenset(
            each
            for each in ("sigma", "half_width", "values", "steps")
            if getattr(keys, each) is not None
        )
        if keys.distribution is not None and self.mode is not Mode.MONTE_CARLO:
            raise fault(
                self.file,
                join(self.key, "distribution"),
                f"found {shown(keys.distribution)}, expected none, for {self.mode} draws"
                " nothing; leave it out",
            )
        takes = _LISTED.get(self.mode) or _DRAWN[keys.distribution]
        if given in takes:
            return
        there = " and ".join(sorted(given)) or "none of them"
        choices = ", or ".join(" and ".join(sorted(each)) for each in takes)
        what = self.mode if keys.distribution is None else f"distribution {keys.distribution}"
        if keys.distribution is None and given == _BOTH:
            choices += ', or both with distribution = "truncated_normal"'
        raise self._fault(f"found {there}, expected for {what}: {choices}; correct the keys")

    def _sizes(self, given: float | list[float] | None, count: int) -> list[float]:
        """Return the size of the offsets of each coordinate; empty if the file gives none."""
        if given is None:
            return []
        if not isinstance(given, list):
            return [given] * count
        if count == 1:
            raise self._fault(
                f"found {shown(given)}, expected one number, for it is {self._single}; give one"
            )
        return given

    def _listed(self, row: int, axis: str, values: Sequence[float]) -> list[tuple[int, Coordinate]]:
        """Return the coordinate with its values.

        One at a time, the values omit zero: it is the nominal design.
        """
        if self.mode is Mode.ONE_AT_A_TIME:
            values = [value for value in values if value]
        if not any(values):
            return []
        largest = max(map(abs, values))
        return [(row, Coordinate(self.name, axis, self.unit, Law.VALUES, largest, tuple(values)))]

    def _lists(self, given: list[float | list[float]], count: int) -> list[list[float]]:
        """Return the offsets of each coordinate: one list for all, or a list for each."""
        key = join(self.key, "values")
        flat: list[float] = [each for each in given if not isinstance(each, list)]
        lists = [each for each in given if isinstance(each, list)]
        found: list[list[float]] = [flat] * count if len(flat) == len(given) else lists
        if len(found) != count or (flat and lists) or not all(found):
            expected = "a list of offsets" + (
                ", or three of them" if count == 3 else f", for it is {self._single}"
            )
            what = f"found {shown(given)}, expected {expected}"
            raise fault(self.file, key, f"{what}; correct the lists")
        if any(len(set(each)) < len(each) for each in found):
            raise fault(self.file, key, "found an offset twice, expected each once; remove one")
        return found

    @property
    def _single(self) -> str:
        return "a length" if self.unit == "m" else "a number"

    def _fault(self, problem: str) -> Exception:
        return fault(self.file, self.key, problem)
