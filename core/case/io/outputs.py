"""[outputs.NAME] of a case file: coordinates of points, measures and suspension outputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..case import PER_TRAVEL, Case, Output, Quantity, size
from ..measures import Measure
from .coordinates import AXES
from .document import fault, join, unknown_name
from .in_si import direction
from .measures import read_measure
from .reference_columns import DERIVATIVES, Convert
from .schema import COORDINATE, CaseKeys, OutputKeys
from .tolerance import tolerance
from .typed_tables import as_table, class_of, typed

if TYPE_CHECKING:
    from .suspension_table import SuspensionTable


def read_outputs(
    file: Path,
    keys: CaseKeys,
    table: SuspensionTable | None,
    case: Case,
    units: Mapping[str, Convert],
) -> tuple[Quantity, ...]:
    """Return the outputs named in the file."""
    return tuple(
        _output(file, name, value, keys, table, case, units) for name, value in keys.outputs.items()
    )


def _output(
    file: Path,
    name: str,
    value: object,
    keys: CaseKeys,
    table: SuspensionTable | None,
    case: Case,
    units: Mapping[str, Convert],
) -> Quantity:
    key = join("outputs", name)
    if name.endswith((*DERIVATIVES, PER_TRAVEL)):
        raise fault(
            file,
            key,
            "a name with this ending is a derivative in reference tables; give the output another"
            " name",
        )
    if as_table(file, key, value).get("type", COORDINATE) != COORDINATE:
        from .suspension import SuspensionOutput, read_output

        known = {COORDINATE: Output, **Measure.registry, **SuspensionOutput.registry}
        cls = class_of(file, key, "output", value, known)
        if issubclass(cls, Measure):
            return read_measure(file, key, cls, name, value, case, units)
        if issubclass(cls, SuspensionOutput):
            return read_output(file, key, cls, name, value, table, case, units)
    return _coordinate(file, key, name, value, keys, case, units["m"])


def _coordinate(
    file: Path, key: str, name: str, value: object, keys: CaseKeys, case: Case, length: Convert
) -> Output:
    output = typed(file, key, value, OutputKeys)
    if output.point not in keys.points:
        raise unknown_name(file, join(key, "point"), output.point, keys.points, "a point")
    match output.component, output.direction:
        case str(axis), None:
            along = AXES[axis]
        case None, (_, _, _) as found:
            along = direction(file, join(key, "direction"), found)
        case component, _:
            what = (
                "neither component nor direction"
                if component is None
                else "both component and direction"
            )
            raise fault(
                file,
                key,
                f'found {what}, expected one of them; give component = "x" or direction = [x,'
                " y, z]",
            )
    return Output(
        name,
        output.point,
        along,
        output.relative,
        *tolerance(file, key, output, length, size(case)),
    )
