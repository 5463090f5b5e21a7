"""A measured curve as the reference of a case: a table of a rig or of another program, with its own
names of columns, units and grid.

A column without a unit is in metres or radians.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...case.case import TIME, Case, Origin, Quantity, Truth
from ...case.io.document import fault, number_or_nan, require_known, shown
from ...case.io.reader_options import CurveOptions
from ...case.io.reference import compare_at_samples
from ...case.io.reference_file import sha256
from ...case.io.reference_samples import (
    Column,
    Columns,
    Samples,
    column_of,
    driver_unit,
    known_columns,
    layout_of,
    read_table,
    require_positions,
    samples_of,
)
from ...case.io.schema import MOST_SAMPLES
from ...case.io.table import folded, require_unit, split_head, unit_of_head
from ...case.quantity import Convention, TypedQuantity
from ...case.units import METRE, RADIAN, SECOND, Convert, FileUnits, Unit
from ...errors import MOST_NAMED, brief, remedy, shortened
from ...trajectory import Array

MAP = "--map"
_WRITTEN = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
_OUTPUTS = {other: name for name, others in tomllib.loads(_WRITTEN).items() for other in others}
_SIDES = {
    side: re.compile(rf"^(?:{words})_(?=..)|_(?:{words})$")
    for side, words in (("left", "left|l|fl|rl|lf"), ("right", "right|r|fr|rr|rf"))
}
# A rig may go farther than the sweep. Millimetres taken for metres are 1000 times as far, degrees
# for radians 57 times.
FARTHER = 20.0


def with_curve(case: Case, file: Path, options: CurveOptions) -> tuple[Case, list[str]]:
    """Return the case with a measured curve as its reference, and notes on how it was read.

    Raises:
        CaseError: the curve cannot be read, an option is wrong, no column is of the driver or of an
            output, or the signs are not the case's.
    """
    driver, known = case.sweep.driver, known_columns(case.outputs)
    stated = read_stated(file, options.columns, driver, known)
    table = read_table(file, options.sheet, "--reference-sheet NAME")
    layout = layout_of(table)
    where, heads = layout.where, layout.heads
    found = match(file, where, heads, driver, known, stated, _side(case))
    left_out = [head for k, head in enumerate(heads) if head and k not in found]
    targets = [*found.values()]
    samples, equal = _without_equal_rows(samples_of(table, [*found], remarks=True, gaps=True))
    columns = zip(samples.columns, targets, strict=True)
    samples = replace(
        samples, columns=[f"{text} [{each.unit}]" if each.unit else text for text, each in columns]
    )
    unit, of = _columns(case, samples, targets)
    outputs = _with_accuracy(file, case.outputs, of, options.accuracy)
    compared_outputs: list[Any] = [each for each in outputs if each.name in of and each.signs]
    convention = str(compared_outputs[0].vehicle.convention) if compared_outputs else ""
    signs = _signs(file, samples.signs, options.signs)
    if signs and convention not in ("", signs):
        raise fault(
            file,
            "signs",
            f"found {shown(signs)}, expected {convention!r} as in the case; turn columns with the"
            f' opposite sign by {MAP} "COLUMN=-OUTPUT", and say --signs {convention}',
        )
    bare = [text for text in samples.columns if not unit_of_head(file, "", text, known)[1]]
    driven = np.array([unit(x) for x in samples.numbers[:, 0].tolist()])
    if samples.columns[0] in bare:
        _require_size(samples, unit, driven, case)
    values = driven if options.own_samples else case.sweep.values
    if len(values) > MOST_SAMPLES:
        problem = f"found {len(values)} rows, expected {MOST_SAMPLES} at most"
        raise fault(file, "--at-reference", f"{problem}; thin them out")
    assumed = bool(convention) and not signs
    case = replace(
        case,
        truth=Truth.THIRD_PARTY_DATA,
        sweep=replace(case.sweep, values=values),
        outputs=outputs,
        origin=Origin(
            (options.citation or "").strip(),
            file.name,
            sha256(file),
            by_option=True,
            signs=convention + " (assumed: the file names none)" * assumed,
        ),
    )
    case = compare_at_samples(samples, Columns(unit, driver, of), case, own=options.own_samples)
    assert case.origin is not None
    rows = [*samples.left_out, *equal]
    return case, _notes(file, case.origin, left_out, rows, bare, convention if assumed else "")


def _side(case: Case) -> str:
    """Return the side of the wheel of a case; left for an axle or a case without wheels."""
    sides = {each.side for each in case.outputs if isinstance(each, TypedQuantity) and each.side}
    return "right" if sides == {"right"} else "left"


def _without_equal_rows(samples: Samples) -> tuple[Samples, list[str]]:
    """Return the samples, of equal rows one, such as those before and after an event, and the
    places of the others.

    Raises:
        CaseError: a driver value is missing.
    """
    before = dict[bytes, str]()
    kept = list[int]()
    equal = list[str]()
    for k, (place, row) in enumerate(zip(samples.places, samples.numbers, strict=True)):
        if np.isnan(row[0]):
            where = f"{place}, column {samples.columns[0]}"
            raise fault(
                samples.file, where, "found no driver value, expected one; complete the row"
            )
        first = before.setdefault(row.tobytes(), place)
        if first is place:
            kept.append(k)
        else:
            equal.append(f"{place} (equal to {first})")
    places = [samples.places[k] for k in kept]
    return replace(samples, places=places, numbers=samples.numbers[kept]), equal


def _columns(
    case: Case, samples: Samples, targets: Sequence[Target]
) -> tuple[Unit, dict[str, Column]]:
    """Return the unit of the driver values, and the columns of outputs."""
    driver, known = case.sweep.driver, known_columns(case.outputs)
    turns = driver != TIME and case.mechanism.driver(driver).turns
    _, unit = driver_unit(samples, SECOND if driver == TIME else RADIAN if turns else METRE)
    if targets[0].opposite:
        unit = Unit(unit.name, unit.size, _negate(unit.convert))
    of = dict[str, Column]()
    for k, (text, target) in enumerate(zip(samples.columns, targets, strict=True)):
        if k == 0:
            continue
        name, written = unit_of_head(samples.file, samples.header, text, known)
        found = column_of(samples, k, written, known[target.name], FileUnits())
        words = found.unit
        if name != target.name:
            words += f", column {shown(text)}"
        if target.opposite:
            words += ", with the opposite sign"
            found = replace(found, convert=_negate(found.convert))
        of[target.name] = replace(found, unit=words)
    for name in of:
        require_positions(samples, name, of)
    return unit, of


def _negate(convert: Convert) -> Convert:
    return lambda number: -convert(number)


def _with_accuracy(
    file: Path,
    outputs: Sequence[Quantity],
    columns: Mapping[str, Column],
    texts: Sequence[str],
) -> tuple[Quantity, ...]:
    """Return outputs with the tolerances that the user states, as "OUTPUT=NUMBER UNIT". Without a
    unit the number is in that of the output's column; without an output it holds for all of them.

    Raises:
        CaseError: no such output, no such unit, or a number alone for columns of several units.
    """
    stated = dict[str, float]()
    units = {output.name: output.unit for output in outputs if output.name in columns}
    for text in texts:
        name, equals, right = (part.strip() for part in text.partition("="))
        names, alone = [name], not equals and name not in units
        if alone:
            names, right = [*units], name
        if alone and len({*units.values()}) > 1:
            raise fault(
                file,
                "--accuracy",
                f"found {shown(text)}, and columns of several units: {', '.join(units)}, expected"
                f' the output it is of; say --accuracy "{names[0]}={text}"',
            )
        for name in names:
            require_known(file, "--accuracy", name, units, "an output with a column")
            bare = columns[name].convert
            stated[name] = size_of(file, "--accuracy", name, right, units[name], bare)
    why = f"the accuracy of {file.name}, as its user states it"
    found: list[Any] = [*outputs]
    for k, output in enumerate(found):
        if output.name in stated:  # what is derived has the other tolerances of its output
            own = [each.name for each in fields(output)]
            rest = {"rtol": 0.0, "why": why} if "rtol" in own else {}
            found[k] = replace(output, atol=stated[output.name], **rest)
    return tuple(found)


def size_of(file: Path, option: str, name: str, text: str, unit: str, bare: Convert) -> float:
    """Return a positive size of an output in SI, of an option OUTPUT=NUMBER UNIT.

    Args:
        text: "0.02 deg", or a number alone.
        unit: the output's, in SI.
        bare: conversion of a number without a unit.

    Raises:
        CaseError: another text, or a unit of something else.
    """
    _, number, stated = re.split(r"^([-+.\deE]*)", text.strip(), maxsplit=1)
    size = number_or_nan(number)
    if not 0.0 < size < float("inf"):
        raise fault(
            file,
            option,
            f"found {shown(text)}, expected a positive number with or without a unit; say {option}"
            f' "{name}=0.02 {"deg" if unit == "rad" else unit}"',
        )
    if stated := stated.strip():
        bare = require_unit(file, option, name, stated, unit).convert
    return abs(bare(size) - bare(0.0))


def _signs(file: Path, written: str, stated: str | None) -> str:
    """Return the convention of signs that the file or the user states; empty without any."""
    require_known(file, "--signs", stated, Convention, "a convention")
    if stated is not None and written not in ("", stated):
        raise fault(
            file,
            "--signs",
            f"found {stated}, but the file names {shown(written)}, expected the same; leave out"
            " --signs, or correct the file",
        )
    return stated or written


def _require_size(samples: Samples, unit: Unit, driven: Array, case: Case) -> None:
    """Refuse driver values without a unit in their head, if they go much farther than the sweep."""
    most, sweep = float(np.abs(driven).max()), case.sweep
    if sweep.driver == TIME or most <= FARTHER * float(np.abs(sweep.values).max()):
        return
    small = "deg" if unit.name == RADIAN.name else "mm"
    raise fault(
        samples.file,
        samples.header,
        f"found driver values up to {most:g} in column {shown(samples.columns[0])} without a unit,"
        f" expected them within the sweep, up to {float(np.abs(sweep.values).max()):g} {unit.name};"
        f" write the unit into the head, {samples.columns[0]} [{small}], or say {MAP}"
        f' "{samples.columns[0]}={sweep.driver} [{small}]"',
    )


def _notes(
    file: Path,
    origin: Origin,
    left_out: Sequence[str],
    rows: Sequence[str],
    bare: Sequence[str],
    assumed: str,
) -> list[str]:
    """Return what the user should know of how a curve was read."""
    read = ", ".join(f"{name} [{unit}]" for name, unit in origin.units.items())
    notes = [f"{file}: read {read}"]
    columns, units = ([brief(shown(head)) for head in heads] for heads in (left_out, bare))
    for told, found in (
        ("left out the columns", columns),
        ("left out the rows", rows),
        ("without a unit, taken in SI units:", units),
    ):
        if found:
            notes.append(f"{file}: {told} {shortened(found, MOST_NAMED)}")
    if assumed:
        notes.append(
            f"{file}: names no convention of signs, {assumed} is assumed; state it: --signs"
        )
    return notes


@dataclass(frozen=True)
class Target:
    """What a column holds.

    Attributes:
        name: the driver, or OUTPUT, OUTPUT.velocity or OUTPUT.acceleration.
        unit: unit stated by the user; empty for that of the head.
        opposite: whether the numbers have the opposite sign.
    """

    name: str
    unit: str = ""
    opposite: bool = False


def read_stated(
    file: Path, texts: Sequence[str], driver: str, known: Mapping[str, str]
) -> dict[str, Target]:
    """Return what columns hold, by their heads, as the user states it: "COLUMN=[-]NAME [UNIT]".

    Args:
        known: names of the columns of outputs.

    Raises:
        CaseError: a text has another form, or names no output.
    """
    stated = dict[str, Target]()
    for text in texts:
        head, equals, right = (part.strip() for part in text.rpartition("="))
        opposite = right.startswith("-")
        name, unit = split_head(right.removeprefix("-").strip(), known)
        if not equals or not head or not name:
            raise fault(
                file,
                MAP,
                f"found {shown(text)}, expected COLUMN=OUTPUT, COLUMN=-OUTPUT or"
                f' COLUMN="OUTPUT [UNIT]"; say {MAP} "Toe Angle=toe [deg]"',
            )
        expected = f"the driver {driver} or an output"
        require_known(file, MAP, name, [driver, *known], expected)
        if head in stated or name in [target.name for target in stated.values()]:
            raise fault(
                file,
                MAP,
                f"found {shown(head)} or {shown(name)} twice, expected once; leave out one",
            )
        stated[head] = Target(name, unit, opposite)
    return stated


def match(
    file: Path,
    where: str,
    heads: Sequence[str],
    driver: str,
    known: Mapping[str, str],
    stated: Mapping[str, Target],
    side: str = "left",
) -> dict[int, Target]:
    """Return what columns hold, by their indices, the driver first. Other columns are left out.

    Args:
        side: that of the wheel.

    Raises:
        CaseError: two columns hold the same, a stated column is missing, or none holds an output.
    """
    names = [_without_units(head, known) for head in heads]
    found = dict[int, Target]()
    for head, target in stated.items():
        places = [k for k, each in enumerate(heads) if head in (each, names[k])]
        if len(places) != 1:
            problem = "no column" if not places else "several columns"
            raise fault(
                file,
                MAP,
                f"found {problem} {shown(head)}, expected one of the file;"
                f" {remedy(head, filter(None, heads))}",
            )
        if places[0] in found:
            raise fault(
                file,
                MAP,
                f"found the column {shown(heads[places[0]])} twice, expected it once; leave one"
                " out",
            )
        found[places[0]] = target
    taken = {target.name for target in found.values()}
    by_name = {_normal(name): name for name in (*known, driver)}
    matches = dict[str, list[int]]()
    for k, name in enumerate(names):
        wanted = _column_of_name(name, by_name, side)
        if k not in found and wanted and wanted not in taken:
            matches.setdefault(wanted, []).append(k)
    for name, places in matches.items():
        exact = [k for k in places if names[k] == name] or places
        if len(exact) > 1:
            both = " and ".join(shown(heads[k]) for k in exact)
            raise fault(
                file,
                where,
                f"found the columns {both}, expected one for {name}; say which by {MAP}"
                f' "COLUMN={name}"',
            )
        found[exact[0]] = Target(name)
    if driver not in [target.name for target in found.values()]:
        found.setdefault(0, Target(driver))
    drives = [k for k, target in found.items() if target.name == driver]
    outputs = sorted(k for k in found if k not in drives)
    if not drives or not outputs:
        missing = (
            f"an output of the case, such as {shortened([*map(brief, known)][:6], MOST_NAMED)}"
            if drives
            else f"the driver {driver}"
        )
        listed = shortened([brief(shown(head)) for head in heads if head], MOST_NAMED)
        raise fault(
            file,
            where,
            f"found the columns {listed}, expected one of {missing}; name it so, or say {MAP}"
            f' "COLUMN={next(iter(known), "OUTPUT") if drives else driver}"',
        )
    return {k: found[k] for k in (*drives, *outputs)}


def _without_units(head: str, known: Mapping[str, str]) -> str:
    """Return a head without its units."""
    name, unit = split_head(head, known)
    return _without_units(name, known) if unit else name


def _column_of_name(name: str, by_name: Mapping[str, str], side: str) -> str:
    """Return the driver or column of an output of a name, of a rig's name for it, or of one of
    these of a side; empty if there is none.

    Args:
        side: that of names without one.
    """
    plain = _normal(name)
    said = next((each for each, words in _SIDES.items() if words.search(plain)), side)
    bare = _SIDES[said].sub("", plain)
    for each in (plain, bare):
        also = _normal(_OUTPUTS.get(each, ""))
        own = (each, also) if said == side or each != bare else ()
        for other in (*own, f"{said}_{each}", f"{said}_{also}"):
            if other in by_name:
                return by_name[other]
    return ""


def _normal(name: str) -> str:
    """Return a name without differences in case, separators and the spelling of centre."""
    return folded(name).replace("centre", "center")
