"""Writer of case files: a `Case` as TOML of the schema kincheck-case/1, in SI units, with all
digits of every number.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, cast

import numpy as np

from ...errors import LONGEST_NAME, CaseError, brief, with_article
from ...joints import Coupler
from ...mechanism.body import Body
from ...mechanism.motions import Absolute, Motion, Table
from ...trajectory import QUANTITIES, Array
from ..case import MARKER, TIME, Case, Output
from ..measures import Measure, key_of
from ..quantity import own_keys
from ..suspension import PerTravel, SuspensionOutput
from .class_keys import own_fields
from .coordinates import AXES
from .document import LONGEST_TEXT, SMALLEST
from .reference_columns import DERIVATIVES
from .schema import SCHEMA
from .suspension_writer import suspension_output, suspension_tables

# Defaults of a body.
PLAIN = Body("plain")


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
    if not case.mechanism.drivers:
        raise CaseError(f"case {case.name!r}: nothing drives it; drive a joint or a point")
    values = _values(case)
    reference = reference_table(case, values)
    lines = [f"# {line}" for line in comments]
    if case.reference and not reference:
        lines += [f"# The reference is left out, because {reason_against(case)}."]
    lines += _keys({"schema": SCHEMA, "name": case.name, "source": _short(case.source)})
    if reference:
        lines += _keys({"truth": str(case.truth)})
    mechanism = case.mechanism
    if any(mechanism.gravity):
        lines += _keys({"gravity": mechanism.gravity})
    for body in mechanism.bodies:
        lines += _table(
            "bodies",
            body.name,
            {
                f.name: value
                for f in fields(body)
                if f.name != "name" and (value := getattr(body, f.name)) != getattr(PLAIN, f.name)
            },
        )
    for joint in (*mechanism.given_joints, *mechanism.grounded, *mechanism.couplers):
        what = {"joints": joint.joints} if isinstance(joint, Coupler) else {"bodies": joint.bodies}
        lines += _table("joints", joint.name, {"type": joint.type, **what, **_own(joint)})
    for point in mechanism.points:
        if not point.name.startswith(MARKER):  # the reader of the file creates markers anew
            lines += _table("points", point.name, {"body": point.body, "position": point.position})
    for driver in mechanism.drivers:
        lines += _table("drivers", driver.name, {"type": driver.type, **_own(driver)})
        motion = case.sweep.motions.get(driver.name)
        if motion is not None:
            moved = _from_design(motion, mechanism.design_value(driver.name))
            lines += _table(
                f"drivers.{_key(driver.name)}", "motion", {"type": moved.type, **_own(moved)}
            )
    for force in mechanism.forces:
        ends = {"bodies": force.bodies} if len(force.bodies) == 2 else {}
        lines += _table("forces", force.name, {"type": force.type, **ends, **_own(force)})
    lines += ["", "[sweep]", *_keys(_sweep(case, values, own_grid=bool(reference)))]
    if closing := _closing(case):
        lines += ["", "[closure]", *_keys(closing)]
    for name, keys in suspension_tables(case).items():
        lines += ["", f"[{name}]", *_keys(keys)]
    for output in case.outputs:
        if isinstance(output, PerTravel):  # the reader derives it from the output before it
            continue
        lines += _table("outputs", output.name, dict(_output(case, output)))
    if reference:
        lines += ["", "[reference]", *_keys(reference)]
    return "\n".join(lines) + "\n"


def _from_design(motion: Motion, design: float) -> Motion:
    """Return a motion with the given design value, as a case file needs it.

    Raises:
        CaseError: the motion has another design value, and is no table; only the values of a table
            can be shifted.
    """
    if not isinstance(motion, Absolute):
        return motion
    if (shift := motion.design - design) == 0.0:
        return motion.motion
    if not isinstance(motion.motion, Table):
        raise CaseError(
            f"{with_article(motion.motion.type)} motion of values that are {motion.design!r} at"
            f" design, expected {design!r} as in a case file; give a table"
        )
    return replace(motion.motion, values=tuple(x - shift for x in motion.motion.values))


def _short(text: str) -> str:
    """Return a text within the limit of a case file, with a mark at a cut end."""
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 6]} [...]"


def _values(case: Case) -> Array:
    """Return the swept values in the form of a case file, shape (n,)."""
    sweep = case.sweep
    if sweep.driver == TIME:
        return sweep.values
    return sweep.values - (sweep.design - case.mechanism.design_value(sweep.driver))


def _closing(case: Case) -> Mapping[str, Any]:
    """Return the keys of [closure]. Joints are written as given, and reduced again on reading."""
    closure, notes = case.closure, case.assembly
    if closure is None:
        return {"notes": notes} if notes else {}
    notes = tuple(note for note in notes if note != closure.note)
    keys = {"tolerance": closure.tolerance, "carrying": closure.carrying, "notes": notes}
    return {key: value for key, value in keys.items() if value}


def _sweep(case: Case, values: Array, *, own_grid: bool) -> Mapping[str, Any]:
    """Return the keys of [sweep].

    Args:
        own_grid: the case has a reference; an uneven grid can then be the reference's samples.
    """
    sweep, start, stop = case.sweep, float(values[0]), float(values[-1])
    rate = {} if sweep.driver == TIME else {"rate": sweep.rate}
    # round-off of start + k * step, once in the file's units and once here
    rounding = 4.0 * np.spacing(np.abs([*sweep.values, *values]).max())
    if (np.abs(np.linspace(start, stop, len(values)) - values) <= rounding).all():
        return {"driver": sweep.driver, "start": start, "stop": stop, "steps": len(values), **rate}
    if own_grid and case.origin and not case.origin.grid:
        return {"driver": sweep.driver, "at": "reference", **rate}
    raise CaseError(
        f"case {case.name!r}: its samples are no even grid, which is all that [sweep] can say;"
        " give an even one"
    )


def _output(case: Case, output: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(output, Measure):
        yield "type", output.type
        for each in own_keys(type(output)):
            if (value := getattr(output, each.name)) is not None:
                yield key_of(each), value
    elif isinstance(output, Output):
        component = next((name for name, axis in AXES.items() if axis == output.direction), None)
        yield "point", output.point
        yield from (
            [("direction", output.direction)] if component is None else [("component", component)]
        )
        yield "relative", output.relative
    elif isinstance(output, SuspensionOutput):
        yield from suspension_output(case, output)
    else:
        raise CaseError(
            f"case {case.name!r}: output {output.name!r} is a derivative, which the file cannot"
            " name; leave it out"
        )
    yield from (("atol", output.atol), ("rtol", output.rtol), ("why", output.why))


def _own(item: Any) -> Mapping[str, Any]:
    """Return the fields for a file, without optional fields at their defaults."""
    described: Any = type(item)  # pyright: ignore[reportUnknownVariableType]
    return {
        f.name: value for f in own_fields(described) if (value := getattr(item, f.name)) is not None
    }


def _table(room: str, name: str, values: Mapping[str, Any]) -> list[str]:
    return ["", f"[{room}.{_key(name)}]", *_keys(values)]


def _keys(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in values.items()]


def _key(name: str) -> str:
    """Return a name as a key, without quotes if TOML allows it."""
    if not (name and name.isprintable() and len(name) <= LONGEST_NAME):
        raise CaseError(
            f"name {brief(name)!r}: found {len(name)} characters, expected 1 to {LONGEST_NAME}"
            " printable ones, which a case file can hold; rename it"
        )
    return (
        name
        if name.replace("_", "a").replace("-", "a").isalnum() and name.isascii()
        else json.dumps(name)
    )


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # a JSON string is a basic string of TOML
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_value, cast('Sequence[Any]', value)))}]"
    if isinstance(value, int):
        return repr(value)
    # the reader refuses smaller numbers; they are the round-off of zeros
    return repr(float(value) if abs(value) >= SMALLEST else 0.0)


def reference_table(case: Case, driver_values: Array) -> Mapping[str, Any]:
    """Return the keys of [reference]; empty without a reference, or if rows cannot hold it.

    Args:
        driver_values: swept values in the form of the file, shape (n,).
    """
    if reason_against(case):
        return {}
    columns = _columns(case)
    known = np.isfinite(np.array([*columns.values()])).all(axis=0)
    table = np.column_stack([driver_values, *columns.values()])[known]
    keys = {"columns": ["driver", *columns], "rows": table.tolist()}
    if case.origin and case.origin.citation and not case.origin.own:
        keys["citation"] = case.origin.citation
    return keys


def reason_against(case: Case) -> str:
    """Return the reason why rows cannot hold the reference of a case; empty if they can."""
    if not case.reference:
        return "there is none"
    if any(series.uncertainty for series in case.reference.values()):
        return "its values have uncertainties, from printed digits or interpolation"
    known = np.isfinite(np.array([*_columns(case).values()]))
    if (known != known[0]).any() or not known.any():
        return "its outputs are known at different samples"
    return ""


def _columns(case: Case) -> dict[str, Array]:
    """Return the columns of the known quantities, by name, shape (n,) each."""
    found: dict[str, Array] = {}
    for name, series in case.reference.items():
        quantities: Sequence[Array | None] = [getattr(series, each) for each in QUANTITIES]
        for ending, values in zip(("", *DERIVATIVES), quantities, strict=True):
            if values is not None:
                found[name + ending] = values
    return found
