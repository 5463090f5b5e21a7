"""The driver of a wheel's travel, for derivatives by travel in a combined sweep."""

from __future__ import annotations

from pathlib import Path

from ...joints.base import unit
from ...mechanism.motions import PointCoordinate
from ..case import Case
from ..suspension import Rate, SuspensionOutput, Vehicle
from .document import fault, join, unknown_name

# A driver's direction so nearly horizontal is no travel.
LEVEL = 1e-8


def travel_driver(
    file: Path, key: str, named: str | None, vehicle: Vehicle, case: Case
) -> str | None:
    """Return the driver of the wheel's travel; None without such a driver.

    Args:
        key: key of the wheel's table.
        named: the driver's name in the file; None for the driver of the wheel centre.
        case: the case read so far.

    Raises:
        CaseError: there is no driver of this name.
    """
    drivers = case.mechanism.drivers
    if named is None:
        of_wheel = (
            each.name
            for each in drivers
            if isinstance(each, PointCoordinate)
            and each.point == vehicle.wheel_center
            and abs(unit(each.direction) @ unit(vehicle.up)) > LEVEL
        )
        named = next(of_wheel, None)
    elif named not in (names := [each.name for each in drivers]):
        raise unknown_name(file, join(key, "travel"), named, names, "a driver")
    return named


def require_travel(file: Path, key: str, output: SuspensionOutput, case: Case) -> None:
    """Require a driver of the wheel's travel for a derivative by travel, if several drivers move.

    Raises:
        CaseError: the output is such a derivative, and the driver is missing.
    """
    moving = list(case.sweep.path.motions)
    if isinstance(output, Rate) and len(moving) > 1 and not output.vehicle.travel:
        found = (
            f"found {output.type!r} while {', '.join(moving)} move, expected one of them to be the"
            " wheel's travel"
        )
        raise fault(
            file,
            join(key, "type"),
            f"{found}, for it is a derivative by that; name it by suspension.travel",
        )
