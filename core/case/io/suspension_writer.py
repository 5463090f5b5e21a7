"""The [suspension] table and the suspension outputs of a case file, written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from ...errors import CaseError
from ..case import Case
from ..suspension import PerTravel, SuspensionOutput, Vehicle, own_keys


def _key(name: str, value: Any) -> str:
    """Return the key of an attribute of a vehicle."""
    if name == "kingpin" and not isinstance(value[0], str):
        return "kingpin_links"
    return "center_plane" if name == "middle" else name


def suspension_keys(case: Case) -> Mapping[str, Any]:
    """Return the keys of [suspension], in SI; empty without suspension outputs.

    Raises:
        CaseError: the outputs are of several wheels.
    """
    wheels = [each.vehicle for each in case.outputs if isinstance(each, SuspensionOutput)]
    if not wheels:
        return {}
    if any(wheel != wheels[0] for wheel in wheels):
        raise CaseError(
            f"case {case.name!r}: its outputs are of several wheels, and [suspension] is of one;"
            " leave out the others"
        )
    given = {
        _key(each.name, value): value
        for each in fields(Vehicle)
        if (value := getattr(wheels[0], each.name)) != each.default
    }
    return given | {"per_travel": any(isinstance(each, PerTravel) for each in case.outputs)}


def suspension_output(output: SuspensionOutput) -> Iterator[tuple[str, Any]]:
    """Yield the type of an output and the fields of its type."""
    yield "type", output.type
    yield from ((each.name, getattr(output, each.name)) for each in own_keys(type(output)))
