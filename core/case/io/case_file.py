"""Case files, schema kincheck-case/1: TOML, or JSON with the same keys, to a `Case`; and a `Case`
to TOML, in SI units, with all digits of every number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from ...doors import offers
from ...errors import CaseError, MechanismError, unknown
from ..case import Case, Truth
from ..quantity import with_markers
from ..units import ANGLES, LENGTHS, FileUnits
from .document import LONGEST_TEXT, Section, explained, read_tables, shown
from .mechanism_sections import (
    mechanism_lines,
    read_mechanism,
    read_sweep,
    sweep_lines,
    values_in_file,
)
from .outputs import output_lines, read_output, with_all_coordinates
from .readers import LARGEST_FILE
from .reference import read_reference, reason_against, reference_lines
from .schema import SCHEMA, ClosureKeys, ReferenceKeys, UnitsKeys
from .sections import CaseSection, case_keys, sections, undriven
from .toml_text import toml_table

# Twice the bodies of the largest measured mechanism; the same limit for joints and points.
MOST_PARTS = 60_000
_PARTS = ("bodies", "joints", "couplers", "points", "drivers", "forces", "outputs")


def load_case(path: str | Path, closure: float | None = None) -> Case:
    """Read a case from a file, in SI units. Without a [reference] it is consensus_only, even if the
    file states another truth.

    Args:
        closure: tolerance of rows redundant but for the digits of the file [m]; None for the
            file's tolerance, if any.

    Raises:
        CaseError: the file or its reference is unreadable or inconsistent; the message names file,
            key and remedy.
    """
    file = Path(path)
    advice = "a case holds hardpoints; samples belong into a reference file"
    root = Section(file, "", _with_defaults(read_tables(file, LARGEST_FILE, advice, SCHEMA)))
    keys = root.typed(case_keys())
    for what in _PARTS:
        if (count := len(getattr(keys, what))) > MOST_PARTS:
            raise root.at(what).fault(
                f"found {count}, expected {MOST_PARTS} at most; divide the mechanism into several"
                " cases"
            )
    written = Section(file, "units", keys.units).typed(UnitsKeys)
    units = FileUnits(LENGTHS[written.length], ANGLES[written.angle])
    root = replace(root, units=units)
    every = [(each, root.at(each.key)) for each in sections()]
    added = [(each, table) for each, table in every if table.value is not None]
    for each, table in added:
        table.typed(each.keys)
    mechanism = read_mechanism(root, keys)
    columns = None
    if keys.reference is not None:
        columns = root.at("reference").typed(ReferenceKeys)
    sweep, driver, own_grid = read_sweep(root, mechanism, columns)
    case = Case(
        *(keys.name, keys.source, Truth.CONSENSUS_ONLY, mechanism, sweep, ()),
        length_unit=units.length.name,
        angle_unit=units.angle.name,
        formerly=tuple(keys.formerly),
    )
    case = _with_outputs(root, case, added)
    with explained(file, "closure", units.length):
        closing = Section(file, "closure", keys.closure).typed(ClosureKeys)
        case = _within_digits(case, closing, closure)
    if columns is None:
        return case
    if keys.truth in (None, Truth.CONSENSUS_ONLY):
        found = "nothing" if keys.truth is None else shown(str(keys.truth))
        kinds = ", ".join(kind for kind in Truth if kind is not Truth.CONSENSUS_ONLY)
        raise root.at("truth").fault(
            f"found {found} beside a [reference], expected where that comes from; give one of"
            f" {kinds}"
        )
    convention = next(filter(None, (each.convention(table) for each, table in added)), "")
    case = replace(case, truth=keys.truth)
    return read_reference(file, columns, driver, units, case, convention, own_grid=own_grid)


def _with_defaults(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a file with those of a driven motion that others let it leave out."""
    for each in sections():
        if isinstance(table := tables.get(each.key), dict):
            tables = {**each.defaults(cast("dict[str, Any]", table)), **tables}
    return tables


def _within_digits(case: Case, keys: ClosureKeys, closure: float | None) -> Case:
    """Return the case without rows redundant within its tolerance, if it has a tolerance."""
    case, why = replace(case, assembly=(*keys.notes, *case.assembly)), "--closure"
    if closure is None and keys.tolerance is not None:
        closure, why = LENGTHS[case.length_unit](keys.tolerance), "[closure] tolerance"
    known = [joint.name for joint in case.mechanism.joints]
    for name in keys.carrying:
        if name not in known:
            raise MechanismError(unknown("joint", name, known), "closure.carrying")
    if closure is None:
        return case
    for each in offers("closings").values():
        return each.load()(case, closure, why, keys.carrying)
    raise MechanismError(
        f"{why}: no extension here leaves redundant rows out; write all digits", "closure"
    )


def _with_outputs(root: Section, case: Case, added: Sequence[tuple[CaseSection, Section]]) -> Case:
    """Return the case with its outputs and the additional points they need.

    Args:
        added: the tables of extensions in the file.
    """
    if not (root.at("points").value or root.at("outputs").value):
        raise root.at("points").fault(
            "found no point, expected one whose motion is compared; add [points.NAME], or an output"
            " of a joint or body, [outputs.NAME]"
        )
    tables: dict[str, Any] = {}
    for each, table in added:
        case, tables[each.key] = each.read(table, case)
    named = root.at("outputs").each()
    outputs = tuple(read_output(name, section, tables, case) for name, section in named)
    outputs = outputs or with_all_coordinates(case).outputs
    case = replace(case, mechanism=with_markers(case.mechanism, outputs), outputs=outputs)
    for each, _ in added:
        case = each.with_derived(case, tables[each.key])
    return case


def case_text(case: Case, comments: Sequence[str] = ()) -> str:
    """Return the text of a case file. It reads as the same case; samples agree to the last digit.

    The text gives the values of a joint's driver relative to the design, also if the case does not.
    If rows cannot hold the reference, the text omits it, and a comment gives the reason.

    Args:
        comments: comment lines at the top.

    Raises:
        CaseError: no case file can express the case: nothing drives it, samples on no even grid,
            outputs of several axles, or names and texts beyond their limits.
    """
    if not case.mechanism.drivers and not undriven(case.tables):
        raise CaseError(f"case {case.name!r}: nothing drives it; drive a joint or a point")
    values = values_in_file(case)
    reference = reference_lines(case, values)
    lines = [f"# {line}" for line in comments]
    if case.reference and not reference:
        lines += [f"# The reference is left out, because {reason_against(case)}."]
    source = case.source
    if len(source) > LONGEST_TEXT:
        source = f"{source[: LONGEST_TEXT - 6]} [...]"
    top = {"schema": SCHEMA, "name": case.name, "source": source}
    top |= {"formerly": [*case.formerly]} if case.formerly else {}
    top |= {"truth": str(case.truth)} if reference else {}
    lines += toml_table(top)
    if any(case.mechanism.gravity):
        lines += toml_table({"gravity": case.mechanism.gravity})
    lines += mechanism_lines(case)
    lines += sweep_lines(case, values, own_grid=bool(reference))
    lines += _closure_lines(case)
    for each in sections():
        lines += each.lines(case)
    lines += output_lines(case)
    return "\n".join([*lines, *reference]) + "\n"


def _closure_lines(case: Case) -> list[str]:
    """Return the lines of [closure]. Joints are written as given, and reduced again on reading."""
    closure, notes = case.closure, case.assembly
    if closure is None:
        return toml_table({"notes": notes}, "closure") if notes else []
    notes = tuple(note for note in notes if note != closure.note)
    keys = {"tolerance": closure.tolerance, "carrying": closure.carrying, "notes": notes}
    return toml_table({key: value for key, value in keys.items() if value}, "closure")
