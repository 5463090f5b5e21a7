"""JSON Schemas of kincheck's files, made from the types of their readers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias, cast

import msgspec

from ...joints import Coupler, Joint
from ...mechanism.loads import ELEMENTS
from ...mechanism.motions import Motion
from ..measures import Measure
from ..suspension import SuspensionOutput
from .class_keys import driver_keys, joint_keys, motion_keys
from .compliance import RestingKeys, RigKeys
from .driving import DRIVERS
from .loads import force_keys
from .measures import measure_keys
from .reference_samples import ReferenceKeys
from .schema import (
    COORDINATE,
    SCHEMA,
    BodyKeys,
    CaseKeys,
    ClosureKeys,
    OutputKeys,
    PointKeys,
    SweepKeys,
    UnitsKeys,
)
from .suspension import output_keys
from .suspension_table import SuspensionKeys

Keys: TypeAlias = type[msgspec.Struct]
Tables: TypeAlias = Mapping[str, Keys | Mapping[str, Keys]]
"""Keys of a table in a table of tables, by the name of the outer table; or keys by `type`."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"
TEMPLATE = "#/$defs/{name}"


def case_schema() -> dict[str, Any]:
    """Return the schema of case files, with all joint types registered so far."""
    joints: Mapping[str, type[Joint | Coupler]] = {**Joint.registry, **Coupler.registry}
    measures = {name: measure_keys(cls) for name, cls in Measure.registry.items()}
    outputs = {name: output_keys(cls) for name, cls in SuspensionOutput.registry.items()}
    tables: Tables = {
        "bodies": BodyKeys,
        "joints": {name: joint_keys(cls) for name, cls in joints.items()},
        "couplers": {name: joint_keys(cls) for name, cls in Coupler.registry.items()},
        "points": PointKeys,
        "drivers": {name: driver_keys(cls) for name, cls in DRIVERS.items()},
        "forces": {name: force_keys(cls) for name, cls in ELEMENTS.items()},
        "outputs": {COORDINATE: OutputKeys, **measures, **outputs},
    }
    single = {
        "units": UnitsKeys,
        "closure": ClosureKeys,
        "sweep": SweepKeys,
        "suspension": SuspensionKeys,
        "reference": ReferenceKeys,
        "compliance": RigKeys,
        "equilibrium": RestingKeys,
    }
    motions = {name: motion_keys(cls) for name, cls in Motion.registry.items()}
    found = document_schema(SCHEMA, CaseKeys, tables, single, {"motion": motions})
    for name in DRIVERS:
        keys = found["$defs"][f"drivers.{name}"]["properties"]
        keys["motion"] = any_of([f"motion.{name}" for name in motions])
    return found


def document_schema(
    name: str,
    keys: Keys,
    tables: Tables,
    single: Mapping[str, Keys],
    further: Tables | None = None,
) -> dict[str, Any]:
    """Return the schema of a file of tables.

    Args:
        name: name of the schema, as in the key `schema` of the file.
        keys: the keys at the top of the file.
        tables: the keys of each table in a table of tables.
        single: the keys of a table.
        further: definitions used by other definitions.
    """
    structs = {"": keys, **single}
    for table, each in {**tables, **(further or {})}.items():
        kinds = each if isinstance(each, Mapping) else {"": each}
        structs |= {f"{table}.{kind}".rstrip("."): struct for kind, struct in kinds.items()}
    definitions = {label: _definition(label, struct) for label, struct in structs.items()}
    whole = definitions.pop("")
    properties = whole["properties"] | {"schema": {"const": name}}
    for table, each in tables.items():
        labels = [f"{table}.{kind}" for kind in each] if isinstance(each, Mapping) else [table]
        properties[table] = {"type": "object", "additionalProperties": any_of(labels)}
    properties |= {table: any_of([table]) for table in single}
    return whole | {"$schema": DIALECT, "properties": properties, "$defs": definitions}


def any_of(labels: list[str]) -> dict[str, Any]:
    """Return the schema of a value of any of the definitions."""
    refs = [{"$ref": TEMPLATE.format(name=label)} for label in labels]
    return refs[0] if len(refs) == 1 else {"anyOf": refs}


def _definition(label: str, struct: Keys) -> dict[str, Any]:
    """Return the schema of one struct; the type in the label is the only value of `type`."""
    found = struct_schema(struct)
    _, _, kind = label.partition(".")
    if kind:
        found["properties"]["type"] = {"const": kind}
    return found


def struct_schema(struct: Keys) -> dict[str, Any]:
    """Return the schema of a struct, with all references replaced by their definitions."""
    (ref,), parts = msgspec.json.schema_components([struct], ref_template=TEMPLATE)

    def written_out(value: Any) -> Any:
        if isinstance(value, dict):
            table = cast("dict[str, Any]", value)
            if "$ref" in table:
                return written_out(parts[table["$ref"].rpartition("/")[2]])
            return {key: written_out(each) for key, each in table.items()}
        if isinstance(value, list):
            return [written_out(each) for each in cast("list[Any]", value)]
        return value

    return written_out(ref)
