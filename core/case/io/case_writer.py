"""Case files, written: a `Case` as TOML of the schema kincheck-case/1, in SI units, every number
with all its digits.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any, cast

import numpy as np

from ...errors import CaseError
from ...joints import Coupler
from ...mechanism.body import Body
from ...mechanism.motions import Absolute
from ..case import MARKER, TIME, Case, Output
from ..measures import Measure, key_of, own_keys
from ..suspension import PerTravel, SuspensionOutput
from .class_keys import own_fields
from .coordinates import AXES
from .schema import SCHEMA
from .suspension_writer import suspension_output, suspension_tables

# What a body has unless the file says otherwise.
PLAIN = Body("plain")


def case_text(case: Case, comments: Sequence[str] = ()) -> str:
    """Return the text of a case file that reads as the same case without its reference; samples
    agree to the last place.

    Args:
        comments: lines at the top.

    Raises:
        CaseError: no case file can express the case: samples on no even grid, or outputs of
            several axles.
    """
    lines = [f"# {line}" for line in comments]
    lines += _keys({"schema": SCHEMA, "name": case.name, "source": case.source})
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
    for joint in (*mechanism.joints, *mechanism.grounded, *mechanism.couplers):
        what = {"joints": joint.joints} if isinstance(joint, Coupler) else {"bodies": joint.bodies}
        lines += _table("joints", joint.name, {"type": joint.type, **what, **_own(joint)})
    for point in mechanism.points:
        if not point.name.startswith(MARKER):  # these are made anew when the file is read
            lines += _table("points", point.name, {"body": point.body, "position": point.position})
    for driver in mechanism.drivers:
        lines += _table("drivers", driver.name, {"type": driver.type, **_own(driver)})
        motion = case.sweep.motions.get(driver.name)
        if motion is not None:
            moved = motion.motion if isinstance(motion, Absolute) else motion
            lines += _table(
                f"drivers.{_key(driver.name)}", "motion", {"type": moved.type, **_own(moved)}
            )
    for force in mechanism.forces:
        ends = {"bodies": force.bodies} if len(force.bodies) == 2 else {}
        lines += _table("forces", force.name, {"type": force.type, **ends, **_own(force)})
    lines += ["", "[sweep]", *_keys(_sweep(case))]
    for name, keys in suspension_tables(case).items():
        lines += ["", f"[{name}]", *_keys(keys)]
    for output in case.outputs:
        if isinstance(output, PerTravel):  # follows from the output before it
            continue
        lines += _table("outputs", output.name, dict(_output(case, output)))
    return "\n".join(lines) + "\n"


def _sweep(case: Case) -> Mapping[str, Any]:
    sweep, values = case.sweep, case.sweep.values
    start, stop = float(values[0]), float(values[-1])
    # of start + k * step, once in the file's units and once here
    rounding = 4.0 * np.spacing(np.abs(values).max())
    if not (np.abs(np.linspace(start, stop, len(values)) - values) <= rounding).all():
        raise CaseError(
            f"case {case.name!r}: its samples are no even grid, which is all that [sweep] can say;"
            " give an even one"
        )
    rate = {} if sweep.driver == TIME else {"rate": sweep.rate}
    return {"driver": sweep.driver, "start": start, "stop": stop, "steps": len(values), **rate}


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
    """Return the fields that a file gives, without omitted optional ones."""
    described: Any = type(item)  # pyright: ignore[reportUnknownVariableType]
    return {
        f.name: value for f in own_fields(described) if (value := getattr(item, f.name)) is not None
    }


def _table(room: str, name: str, values: Mapping[str, Any]) -> list[str]:
    return ["", f"[{room}.{_key(name)}]", *_keys(values)]


def _keys(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in values.items()]


def _key(name: str) -> str:
    """Bare where TOML allows it."""
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
    return repr(float(value)) if not isinstance(value, int) else repr(value)
