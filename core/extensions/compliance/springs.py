"""Springs that a study adds to a case: between the points of a motion ratio, or under the wheel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import msgspec

from ...case.case import Case
from ...case.io.document import measure
from ...case.units import FORCES, Unit
from ...errors import KincheckError
from ...mechanism.loads import ForceElement, SpringDamper
from ...mechanism.mechanism import Vector
from ..hardpoints.suspension import MotionRatio
from .rates import without_side
from .section import KEY, rig_of

TIRE = "tire"
TIRES = (TIRE, "tyre")
"""Name of the spring under each wheel, which makes a ride rate of the wheel rate."""
RATES: Mapping[str, Unit] = {
    name: Unit(name, size, size.__mul__)
    for name, size in {
        "N/m": 1.0,
        "N/mm": 1e3,
        "kN/m": 1e3,
        "kN/mm": 1e6,
        "lb/in": 175.126835,
    }.items()
}
EXAMPLE = '--spring "spring: 35 N/mm"'
Rate = float | tuple[float, float]


def springs_in(texts: Sequence[str]) -> dict[str, Rate]:
    """Return the springs of an option, "NAME: RATE" or "NAME: RATE, FORCE", in SI.

    Raises:
        KincheckError: a text is none.
    """
    found = dict[str, Rate]()
    for text in texts:
        name, _, rest = text.partition(":")
        rate, _, force = rest.partition(",")
        stiffness, preload = _size(rate, RATES), _size(force, FORCES) if force else 0.0
        if not 0.0 < stiffness < math.inf:
            wrong = f"{rate.strip()!r} is not a positive rate in {', '.join(RATES)}"
        elif not math.isfinite(preload):
            wrong = f"{force.strip()!r} is not a force at design in {', '.join(FORCES)}"
        else:
            found[name.strip()] = (stiffness, preload)
            continue
        raise KincheckError(
            f"--spring {text!r}: {wrong}. Decimals have a point. Say {EXAMPLE}, or"
            ' "spring: 35.5 N/mm, 3 kN"'
        )
    return found


def _size(text: str, units: Mapping[str, Unit]) -> float:
    """Return a measure in SI; NaN of what is none or has no unit."""
    try:
        size, unit = measure(text, units, next(iter(units)))
    except ValueError:
        return math.nan
    return size if unit else math.nan


def places_of(case: Case) -> dict[str, list[MotionRatio]]:
    """Return the motion ratios of a case by the names of their springs: of an axle, one name has
    both sides.
    """
    found = dict[str, list[MotionRatio]]()
    for output in case.outputs:
        if isinstance(output, MotionRatio):
            found.setdefault(without_side(output.name.removesuffix("_ratio")), []).append(output)
    return found


def written_names(case: Case) -> dict[str, str]:
    """Return the names of springs by what the table itself calls them: the name of one of the two
    points, or the words that both have, as Feder of Feder unten and Feder oben. A name of two
    springs is left out, as that of a point to which both are fixed. So is one that is also a name
    of `places_of`, which has precedence.
    """
    places, found = places_of(case), dict[str, set[str]]()
    for name, ratios in places.items():
        roles = {without_side(point) for ratio in ratios for point in ratio.between}
        rows = [
            each.name
            for each in case.hardpoints
            if roles & {*each.roles} and each.name not in each.roles
        ]
        words = [row.split() for row in rows]
        common = (word for word in words[0] if all(word in each for each in words)) if rows else ()
        for written in filter(None, (*rows, " ".join(common))):
            found.setdefault(written, set()).add(name)
    return {
        written: name
        for written, (name, *others) in found.items()
        if not others and written not in places
    }


def with_springs(case: Case, springs: Mapping[str, Rate]) -> Case:
    """Return the case with springs; they are compressed at design by their forces.

    Raises:
        KincheckError: the case has no points of such a spring.
    """
    places, mechanism, made = places_of(case), case.mechanism, list[SpringDamper]()
    written = written_names(case)
    for name, given in springs.items():
        rate, force = given if isinstance(given, tuple) else (given, 0.0)
        if name in TIRES:
            rig = msgspec.structs.replace(rig_of(case), tire_stiffness=rate)
            case = replace(case, tables={**case.tables, KEY: rig})
            continue
        if (there := written.get(name, name)) not in places:
            known = ", ".join([*places, *written, TIRE])
            raise KincheckError(
                f"{case.name}: --spring: there is no spring {name!r}, but {known}."
                f" {how_to_add(case)}"
            )
        for ratio in places[there]:
            first, second = (mechanism.point(point) for point in ratio.between)
            ends = first.position, second.position
            present = (*mechanism.forces, *made)
            if old := [each.name for each in present if {*ends} <= {*_ends(each)}]:
                raise KincheckError(
                    f"{case.name}: --spring: {old[0]!r} of the case is between {first.name} and"
                    f" {second.name} already. Leave out {name!r}"
                )
            label = f"{ratio.name.removesuffix('_ratio')} of --spring"
            free = math.dist(*ends) + force / rate
            bodies = first.body, second.body
            made.append(SpringDamper(label, *bodies, ends, rate, free_length=free))
    return replace(case, mechanism=replace(mechanism, forces=(*mechanism.forces, *made)))


def _ends(each: ForceElement) -> Sequence[Vector]:
    return each.points if isinstance(each, SpringDamper) else ()


def how_to_add(case: Case) -> str:
    """Return what to type for a spring: a sentence."""
    if places := [*places_of(case)]:
        name = "spring" if "spring" in places else places[0]
        return f"Add {EXAMPLE.replace('spring:', f'{name}:')} with your rate"
    if case.hardpoints:
        return (
            "Add the points spring_lower and spring_upper to the table, and"
            f" {EXAMPLE} with your rate"
        )
    return 'Add [forces.NAME] type = "spring_damper" to the case'
