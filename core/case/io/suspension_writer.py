"""Writer of the [suspension] table and the suspension outputs of a case file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import Any

from ...errors import CaseError
from ..case import Case
from ..quantity import own_keys
from ..suspension import AxleOutput, PerTravel, SuspensionOutput, Vehicle

_OWN = (
    "wheel_center",
    "kingpin",
    "static_toe",
    "static_camber",
    "wheel_axis",
    "wheel_contact",
)
"""Attributes of a vehicle with a value for each wheel of an axle, in addition to the side."""


def suspension_tables(case: Case) -> Mapping[str, Mapping[str, Any]]:
    """Return the keys of [suspension] and [suspension.other], in SI, by table name; empty without
    suspension outputs.

    Raises:
        CaseError: the outputs belong to wheels of several axles.
    """
    wheels = _wheels(case)
    if not wheels:
        return {}
    first, *others = wheels
    per_travel = any(isinstance(each, PerTravel) for each in case.outputs)
    tables = {"suspension": _keys(first, 0) | {"per_travel": per_travel}}
    if not others:
        return tables
    other, *more = others
    own = (*_OWN, "wheel_radius") if other.wheel_contact is not None else _OWN
    alike = replace(other, side=first.side, **{name: getattr(first, name) for name in own})
    if more or alike != first or other.side is first.side:
        raise CaseError(
            f"case {case.name!r}: its outputs are of several axles, and [suspension] is of one;"
            " leave out the others"
        )
    names = {*_OWN, "kingpin_links", "travel"}
    of_other = {key: value for key, value in _keys(other, -1).items() if key in names}
    angles = {name: getattr(other, name) for name in ("static_toe", "static_camber")}
    return tables | {"suspension.other": {"wheel_center": other.wheel_center, **angles, **of_other}}


def suspension_output(case: Case, output: SuspensionOutput) -> Iterator[tuple[str, Any]]:
    """Yield the type of an output, its side if the case has two, and the fields of its type."""
    yield "type", output.type
    if len(_wheels(case)) > 1 and not isinstance(output, AxleOutput):
        yield "side", output.vehicle.side
    yield from ((each.name, getattr(output, each.name)) for each in own_keys(type(output)))


def _wheels(case: Case) -> list[Vehicle]:
    """Return the wheels of the outputs; the first belongs in [suspension]."""
    outputs = [each for each in case.outputs if isinstance(each, SuspensionOutput)]
    first = [each.vehicle for each in outputs if isinstance(each, AxleOutput)]
    return [*dict.fromkeys([*first, *(wheel for each in outputs for wheel in each.vehicles)])]


def _keys(wheel: Vehicle, place: int) -> dict[str, Any]:
    """Return the keys of a vehicle unequal to their defaults.

    Args:
        place: index of the wheel's driver of travel among the axle's drivers of travel.
    """
    keys = {
        _key(each.name, value): value
        for each in fields(Vehicle)
        if (value := getattr(wheel, each.name)) != each.default
    }
    if wheel.wheel_contact is not None:
        del keys["wheel_radius"]
    if names := keys.pop("travel", ()):
        keys["travel"] = names[place]
    return keys


def _key(name: str, value: Any) -> str:
    """Return the key of an attribute of a vehicle."""
    if name == "kingpin" and not isinstance(value[0], str):
        return "kingpin_links"
    return "center_plane" if name == "middle" else name
