"""Units of a table of hardpoints or another file, for numbers in SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..case.case import TIME, Case
from ..case.units import ANGLES, LENGTHS

DRIVER_UNITS = {
    "point_coordinate": "m",
    "joint_displacement": "m",
    "joint_angle": "rad",
    "time": "s",
}
"""SI unit of the values of a driver, by its type."""


def driver_unit(facts: Mapping[str, Any]) -> str:
    """Return the SI unit of the swept driver, from the facts of a case; empty if unknown."""
    return DRIVER_UNITS.get(facts.get("driver", {}).get("type", ""), "")


def table_facts(case: Case) -> Mapping[str, Any]:
    """Return the units of a table of hardpoints, or of another file that is not in SI, and the type
    of its driver, as a part of the facts of its case; empty for a file in SI.
    """
    driver = case.sweep.driver
    kind = TIME if driver == TIME else case.mechanism.driver(driver).type
    units = {"length": case.length_unit, "angle": case.angle_unit}
    is_table, is_si = bool(case.hardpoints), [*units.values()] == ["m", "rad"]
    if is_si and not is_table:
        return {}
    return {"units": units, "is_table": is_table, "driver": {"type": kind}}


def is_table(facts: Mapping[str, Any]) -> bool:
    """Return whether a case is of a table of hardpoints; stored facts of old had units of tables
    only.
    """
    return bool(facts.get("units")) and facts.get("is_table", True)


def in_table_units(unit: str, facts: Mapping[str, Any]) -> tuple[str, float]:
    """Return the name of an SI unit in the units of the file of a case, and its size [SI]. Rates
    of change per metre stay per metre, and forces and torques in N and N m.
    """
    measure, *per = unit.split("/", 1)
    if "units" not in facts or measure not in ("m", "rad"):
        return unit, 1.0
    of = facts["units"]
    found = LENGTHS[of["length"]] if measure == "m" else ANGLES[of["angle"]]
    return "/".join([found.name, *per]), found.size
