"""Units as every table, page, message and notebook writes them."""

from __future__ import annotations

FORCES = ("N", "N m")
"""Units of forces and torques, which come first where there are any."""


def unit_text(unit: str) -> str:
    """Return a unit as it is printed: m/s² for m/s^2; empty for a ratio."""
    return "" if unit == "1" else unit.replace("^2", "²")


def with_unit(name: str, unit: str) -> str:
    """Return a heading with its unit in brackets, such as toe [°]; a ratio has none."""
    shown = unit_text(unit)
    return f"{name} [{shown}]" if shown else name


def motion_word(motion: str, unit: str) -> str:
    """Return the word for a motion of an output of this unit: a force has a value, no position."""
    return "value" if motion == "position" and unit.startswith("N") else motion


def value_text(value: str, unit: str) -> str:
    """Return a printed number with its unit, such as 12 mm or 12°; a ratio has none."""
    shown = unit_text(unit)
    return f"{value}{'' if shown in ('', '°') else ' '}{shown}"
