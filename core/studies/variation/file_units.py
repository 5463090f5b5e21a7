"""Units of a variation file, for offsets and for the outputs of its study."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...case.case import Case
from ...case.io.document import fault
from ...case.units import ANGLES, LENGTHS, RADIAN
from ...joints import Kind
from ...mechanism.body import ANGLE, LENGTH, Dimension
from .variation_schema import VaryUnits


@dataclass(frozen=True)
class FileUnits:
    """Names of the units of a study's outputs, for their display and limits."""

    length: str = "m"
    angle: str = "rad"

    @classmethod
    def of(cls, units: VaryUnits, case: Case) -> FileUnits:
        """Return the units of a variation file; for an omitted unit, the unit of the case."""
        return cls(units.length or case.length_unit, units.angle or case.angle_unit)


SI = FileUnits()


def unit_of_offsets(
    file: Path, key: str, units: VaryUnits, kind: Kind, dimension: Dimension | None
) -> tuple[str, float]:
    """Return the SI unit of the offsets of a place, and the file's unit in this unit.

    Raises:
        CaseError: the file names no unit of length, and needs one.
    """
    needed = ANGLE if kind is Kind.DIRECTION else dimension or LENGTH
    if needed.length and units.length is None:
        raise fault(
            file,
            "units.length",
            f'missing, expected "m" or "mm" for {key}; say which unit it is in',
        )
    length = LENGTHS[units.length or "m"]
    angle = RADIAN if units.angle is None else ANGLES[units.angle]
    size = angle.power(length.power(1.0, needed.length), needed.angle)
    return str(needed), size
