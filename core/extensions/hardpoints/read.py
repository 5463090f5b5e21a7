"""Cases from a table of hardpoints and a template.

One wheel moves up and down while chassis and steering stand still, or both wheels of an axle and a
rack move.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...case.case import Case, Sweep, Truth
from ...case.io.document import (
    explained,
    fault,
    parse,
    read_text,
    require_known,
    shown,
    unknown_name,
)
from ...case.io.escape import visible
from ...case.io.readers import LEFT_OUT
from ...case.notes import SUSPENSIONS
from ...case.quantity import with_markers
from ...case.units import plain
from ...errors import MOST_NAMED, brief, shortened, similar
from ...mechanism.mechanism import Mechanism, Vector
from .design import (
    AxleMotion,
    far_out,
    hardpoints_of,
    mechanism_of,
    read_travels,
    sides_of,
    vehicle_of,
    with_axis,
    with_suspension_outputs,
)
from .options import WheelOptions
from .rubber import of_chrono, with_file, with_rubber
from .shims import shims
from .suspension import Side
from .table import AXES_IN_USE, Axes, HardpointTable, axes_of, positions_of, unit_of, wanted_corner
from .templates import (
    NAMES,
    TEMPLATE_NAMES,
    TEMPLATES,
    WHEEL_CENTER,
    WHEEL_CONTACT,
    Role,
    Template,
    agree,
    compact,
    corner_in,
    side_of,
)

# Inner joints of a rack near the middle may be a little beyond it. No point of a wheel's suspension
# is farther beyond the middle than this share of the half track.
ACROSS = 0.25
# Cars have some tens of hardpoints at a corner. A far larger table is refused, and not searched for
# missing names.
MOST_POINTS = 10_000
LARGEST_NAMES = 100_000
# Names as alike as this are taken for misspelt or abridged ones.
LIKE = 0.75
_SPELLINGS: Mapping[str, str] = {
    other: word for word, others in NAMES["spellings"].items() for other in others
}


def case_of_hardpoints(
    table: HardpointTable, supplied: WheelOptions, *, followed: bool = True
) -> Case:
    """Return the case of a suspension; it is consensus_only.

    Its outputs are all suspension outputs defined by its points, and the coordinates of three
    points of the knuckle.

    Args:
        followed: whether the case has its hardpoints, with what follows each row: half of the time.

    Raises:
        CaseError: the table lacks facts, or does not fill the roles of the template.
    """
    file = table.file
    if len(table.points) > MOST_POINTS:
        raise fault(
            file,
            "",
            f"found {len(table.points)} points, expected a suspension's, {MOST_POINTS} at most;"
            " take out the others",
        )
    if not (table.unit or supplied.units or table.axes or supplied.axes):
        raise fault(
            file,
            "",
            "says neither its unit nor where x, y and z point, expected both from you; add --units"
            f" mm or m, and --axes {AXES_IN_USE}",
        )
    unit, axes = unit_of(table, supplied.units), axes_of(table, supplied.axes)
    table = _of_corner(table, supplied.corner)
    template, of_names = _template(table, supplied)
    named, told = _fill_roles(table, template, supplied)
    told = [*of_names, *told]
    points = positions_of(table, unit, axes)
    at = {role: points[name] for role, name in named.items()}
    size = max(math.dist(a, b) for a in at.values() for b in at.values())
    if improbable := SUSPENSIONS.improbable(size, unit):
        problem = f"the points span {improbable} They are in another unit"
        raise fault(file, "", f"{problem}; correct --units, or the unit in the file")
    side, of_side = _side(table, named[WHEEL_CENTER], axes, supplied)
    if side is Side.RIGHT:  # a template describes the left side
        axes = [(k, -sign if k == 1 else sign) for k, sign in axes]
        at = {role: (x, -y, z) for role, (x, y, z) in at.items()}
    vehicle = vehicle_of(table, template, named, at, supplied, side)
    travels = read_travels(file, supplied.travel, supplied.rack)

    def written(role: str, k: int) -> str:
        column = next(column for column, (axis, _) in enumerate(axes) if axis == k)
        number = plain(table.points[named[role]].position[column])
        return f"{'xyz'[column]} = {number} {unit.name}"

    _require_one_side_and_upright(table, template, named, at, written)
    far = far_out(at)

    def design(at: Mapping[str, Vector]) -> tuple[Mechanism, Sweep]:
        return mechanism_of(file, supplied.axle, template, with_axis(at, far), travels, side)

    with explained(file, "", unit):
        mechanism, sweep = design(at)
    others = [*(name for name in points if name not in named.values()), *table.left_out]
    source = (
        f"{table.tool} hardpoints of {file.name} on the template {template.name},"
        f" {f'{side} side' if supplied.axle is None else 'both sides'}, x forward, y left, z up"
    )
    if vehicle.wheel_radius is None:
        source += "; without a wheel's radius (--wheel-radius) no outputs at the road"
    if lacking := _missing_outputs(template, at, supplied):
        source += f"; not computed: {', '.join(lacking)}"
    source += f"{LEFT_OUT}{_names(others)}"
    case = Case(file.stem, source, Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    case = replace(case, length_unit=unit.name, angle_unit="deg", assembly=(*told, *of_side))
    case = with_suspension_outputs(
        case, template, vehicle, at, supplied.axle, steered=supplied.rack is not None
    )
    if followed:
        turned, unsteered = shims(template, at, vehicle.static_toe, vehicle.static_camber)
        hardpoints = hardpoints_of(
            named, at, axes, lambda at: with_markers(design(at)[0], case.outputs), turned, unsteered
        )
        case = replace(case, hardpoints=hardpoints)
    sides = sides_of(supplied.axle, side)
    rubber, left_out = of_chrono(table, template, named)
    case = replace(case, assembly=(*case.assembly, *left_out))
    with explained(file, "", unit):
        case = with_rubber(case, template, at, sides, rubber)
    if supplied.bushings is not None:
        case = with_file(case, template, at, sides, supplied.bushings)
    return case


def _missing_outputs(
    template: Template, at: Mapping[str, Vector], supplied: WheelOptions
) -> list[str]:
    """Return the outputs of optional data that are not there, each with what to add."""
    axle = supplied.axle is not None
    across = template.across.items() if axle else ()
    wanted = dict([*template.springs.items(), *template.twists.items(), *across])
    found = [
        f"{name} (add {', '.join(role for role in dict.fromkeys(roles) if role not in at)})"
        for name, roles in wanted.items()
        if not {*roles} <= at.keys()
    ]
    steering = supplied.axle == AxleMotion.STEER
    found += ["Ackermann and turning circle (--wheelbase)"] * (steering and not supplied.wheelbase)
    found += ["steering_ratio (--rack-per-turn)"] * (steering and not supplied.rack_per_turn)
    return found


def _side(
    table: HardpointTable, center: str, axes: Axes, supplied: WheelOptions
) -> tuple[Side, list[str]]:
    """Return the side of the wheel, and a note if it follows from the points alone.

    Args:
        center: name of the wheel's centre.

    Raises:
        CaseError: the points lie on another side than file or user state, or in the middle, or
            their axes are left-handed and the wheel is then a right one.
    """
    column, sign = next((column, sign) for column, (k, sign) in enumerate(axes) if k == 1)
    y = table.points[center].position[column]
    found = Side.LEFT if sign * y > 0.0 else Side.RIGHT
    said = {"--side": supplied.side, "side": table.side}
    for where, text in said.items():
        if text is not None and text.strip().lower() not in list(Side):
            raise unknown_name(table.file, where, text, [*Side], "a side")
    stated = {where: Side(text.strip().lower()) for where, text in said.items() if text}
    number = f"{'xyz'[column]} = {plain(y)} {unit_of(table, supplied.units).name}"
    correct = "correct --axes" if table.axes is None else "correct the points"
    if len({*stated.values()}) > 1:
        problem = f"found {supplied.side}, but the points of this file are of the {table.side} side"
        raise fault(table.file, "--side", f"{problem}; leave out --side")
    for where, side in stated.items():
        if side is not found or y == 0.0:
            problem = f"found {number}, not {side} of the middle, but {where} says {side}"
            raise fault(table.file, center, f"{problem}, expected the same; {correct}, or the side")
    turned = np.zeros((3, 3))
    for row, (k, way) in enumerate(axes):
        turned[row, k] = way
    if y == 0.0 or (not stated and found is Side.RIGHT and np.linalg.det(turned) < 0.0):
        problem = f"found {number}, not left of the middle, expected the left side"
        why = "" if y == 0.0 else " in left-handed axes"
        raise fault(
            table.file, center, f"{problem}{why}; {correct}, or say --side right for a right wheel"
        )
    if stated or found is Side.LEFT:
        return found, []
    note = f"{center} has {number}, right of the middle: read as a right wheel"
    return found, [f"{note}; --side right, or a line # side: right, states it"]


def _of_corner(table: HardpointTable, said: str | None) -> HardpointTable:
    """Return the table with the points of one corner, if their names tell corners apart."""
    if said is None or table.corner is not None:
        return table
    wanted = wanted_corner(table.file, said)
    corners = {name: corner_in(name) for name in table.points}
    if not any(any(found) and agree(found, wanted) for found in corners.values()):
        raise fault(
            table.file,
            "--corner",
            f"found no point of {said}, expected a column, sheet, section or names that tell"
            " corners apart; leave out --corner for a table of one wheel",
        )
    kept = {name: each for name, each in table.points.items() if agree(corners[name], wanted)}
    left_out = [*table.left_out, f"{len(table.points) - len(kept)} points of other corners"]
    side = table.side or wanted[1] or None
    return replace(table, points=kept, left_out=left_out, side=side, corner=wanted)


def _template(table: HardpointTable, supplied: WheelOptions) -> tuple[Template, list[str]]:
    """Return the template that the user or the file states, or else the one whose roles the points
    fill by their names, with a note.
    """
    known, said = TEMPLATE_NAMES, supplied.template
    if said is not None and compact(said) not in known:
        raise unknown_name(table.file, "--template", said, TEMPLATES, "a template")
    names = ", ".join(TEMPLATES)
    if table.template is None:
        if said is not None:
            return known[compact(said)], []
        guessed = [each for each in TEMPLATES.values() if each.guessed and not supplied.ask_names]
        fitting = [each for each in guessed if _fills(table, each)]
        roles = max((len(each.roles) for each in fitting), default=0)
        largest = [each for each in fitting if len(each.roles) == roles]
        if len(largest) != 1:
            problem = "does not say what suspension it is of, expected it from you; add --template"
            names = " or ".join(each.name for each in largest) or f"one of {names}"
            raise fault(table.file, "", f"{problem} {names}")
        (found,) = largest
        return found, [f"template {found.name}, by the names of its points: --template states it"]
    if compact(table.template) not in known:
        problem = (
            f"found {shown(table.template)}, expected one of those that there is a template for;"
            f" known: {names}"
        )
        raise fault(table.file, "Template", problem)
    written = known[compact(table.template)]
    if said is not None and known[compact(said)] is not written:
        problem = (
            f"found {said}, but the file is of a {table.template}, expected {written.name}; leave"
            " out --template"
        )
        raise fault(table.file, "--template", problem)
    return written, []


def _fill_roles(
    table: HardpointTable, template: Template, supplied: WheelOptions
) -> tuple[dict[str, str], list[str]]:
    """Return the name of the point for each role of the template, and notes on the names. A file of
    names that does not exist yet is written.
    """
    own = supplied.names
    new = own is not None and not own.exists()
    named = _points_by_role(table)
    filled = dict[str, str]()
    if own is not None and not new:
        roles = [role.name for role in (*template.roles, *template.optional)]
        filled |= _read_own_names(own, roles, table.points)
    unnamed = own if not filled and not new else None
    for role in (*template.roles, *template.optional):
        if role.name in filled:
            continue
        found = named(role)
        if len(found) > 1:
            places = " and ".join(f"{name!r} ({table.points[name].where})" for name in found)
            raise fault(
                table.file,
                role.name,
                f"found {places}, expected one point; remove what {role.meaning} is not",
            )
        if found:
            filled[role.name] = found[0]
    missing = [role for role in template.roles if role.name not in filled]
    unused = {compact(name): name for name in table.points if name not in filled.values()}
    near = dict[str, str]()
    for role in missing:
        close = (found for each in role.names if (found := similar(each, unused, LIKE)))
        near[role.name] = unused.get(next(close, ""), "")
    told = list[str]()
    distinct = len({*near.values()}) == len(near)
    sure = distinct and all(_fits(role, name) for role, name in near.items())
    if missing and sure and not supplied.ask_names:
        filled |= near
        listed = ", ".join(f"{role} is {visible(name)!r}" for role, name in near.items())
        told.append(f"names guessed: {listed}; --names FILE states them, --ask-names refuses")
        missing = []
    if own is not None and new:
        _write_names(own, template, filled)
        told.append(f"{own}: written, with the names of the points by role")
    if not missing:
        return filled, told
    lines = list[str]()
    for role in missing:
        name = near[role.name]
        where = table.points[name].where if name else ""
        place = "" if where in (name, "") else f", {where}"
        lines.append(f"{role.name}, {role.meaning}" + f" (is it {name!r}{place}?)" * bool(name))
    if unnamed is not None:
        expected = f'expected lines such as {missing[0].name} = "NAME"'
        problem = f"found no names, all lines are comments, {expected}"
        raise fault(unnamed, "", f"{problem}; take the # away from lines that you fill in")
    problem = f"template {template.name}: missing {'; '.join(lines)}"
    advice = "say with --names FILE which point is which; a new FILE is written to be filled in"
    if new:
        advice = f"fill in {own}, which is written"
    raise fault(
        table.file,
        "",
        f"{problem}; found beside: {_names([*unused.values()])}; rename or add them, or {advice}",
    )


def _points_by_role(table: HardpointTable) -> Callable[[Role], list[str]]:
    """Return what gives the points with a name of a role, or else with one and their side."""
    by_compact_name = dict[str, list[str]]()
    by_side_name = dict[str, list[str]]()
    sides = [side for _, side in map(side_of, table.points)]
    wheel = table.side or ("right" if "left" not in sides else "left")
    for name in table.points:
        by_compact_name.setdefault(compact(name), []).append(name)
        plain, side = side_of(name)
        if side == wheel:
            by_side_name.setdefault(compact(plain), []).append(name)

    def points(role: Role) -> list[str]:
        names = dict.fromkeys(role.names)
        found = [name for each in names for name in by_compact_name.get(each, ())]
        return found or [name for each in names for name in by_side_name.get(each, ())]

    return points


def _fills(table: HardpointTable, template: Template) -> bool:
    """Return whether each role of a template has one point of its own by name."""
    named = _points_by_role(table)
    found = [named(role) for role in template.roles]
    return all(len(each) == 1 for each in found) and len({each[0] for each in found}) == len(found)


def _fits(role: str, name: str) -> bool:
    """Return whether a point's name says nothing else than a role: not lower for upper."""
    words, others = _words(role), _words(name)
    return bool(name) and all(
        not (words & kind and others & kind) or words & kind == others & kind
        for kind in map(frozenset, NAMES["opposites"].items())
    )


def _words(name: str) -> set[str]:
    """Return those of the opposite words that a name has."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)
    return {word for part in parts if (word := _SPELLINGS.get(part.lower()))}


def _write_names(file: Path, template: Template, filled: Mapping[str, str]) -> None:
    """Write a file of names, with a comment for each role without a point."""
    lines = [
        f"{role.name} = {json.dumps(filled[role.name], ensure_ascii=False)}"
        if role.name in filled
        else f'# {role.name} = ""  # {role.meaning}'
        for role in (*template.roles, *template.optional)
    ]
    try:
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise fault(file, "--names", f"cannot be written ({error}); choose another file") from None


def _names(names: Sequence[str]) -> str:
    """Return names as text, abridged if there are more than a suspension has."""
    return shortened([brief(visible(name)) for name in names], MOST_NAMED) or "nothing"


def _require_one_side_and_upright(
    table: HardpointTable,
    template: Template,
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    written: Callable[[str, int], str],
) -> None:
    """Refuse points on both sides and points upside down: the stated axes are wrong.

    Args:
        written: returns x, y or z (0, 1, 2) of a role as in the file: "y = 750 mm".
    """
    advice = "correct --axes" if table.axes is None else "correct the points"
    across = [role for role, (_, y, _) in at.items() if y < -ACROSS * at[WHEEL_CENTER][1]]
    for role in across[:1]:
        raise fault(
            table.file,
            named[role],
            f"found {written(role, 1)}, on the other side than {named[WHEEL_CENTER]} with"
            f" {written(WHEEL_CENTER, 1)}, expected all points on one side; correct its sign",
        )
    arms = [(f"{role.removesuffix('_rear')}_front", role) for role in at if role.endswith("_rear")]
    for front, rear in (*arms, *template.ahead):
        if front in at and at[front][0] <= at[rear][0]:
            raise fault(
                table.file,
                named[front],
                f"found {written(front, 0)}, and {named[rear]} with {written(rear, 0)}, expected it"
                f" in front of that; {advice}",
            )
    for high, low in (*template.above, (WHEEL_CENTER, WHEEL_CONTACT)):
        if low in at and at[high][2] <= at[low][2]:
            raise fault(
                table.file,
                named[high],
                f"found {written(high, 2)}, not above {named[low]} with {written(low, 2)}, expected"
                f" it above; {advice}",
            )


def _read_own_names(file: Path, roles: Iterable[str], points: Iterable[str]) -> Mapping[str, str]:
    """Return the names of points by role, for the roles in a file of `role = "own name"`.

    Args:
        roles: roles of the template.
        points: names of the points of the table.

    Raises:
        CaseError: the file cannot be read, or a role or point is unknown.
    """
    text = read_text(file, LARGEST_NAMES, "it holds a name for each role of a template")
    found = dict[str, str]()
    for role, name in parse(file, text).items():
        require_known(file, role, role, roles, "a role")
        if not isinstance(name, str):
            raise fault(
                file, role, f"found {shown(name)}, expected the name of a point; write it in quotes"
            )
        require_known(file, role, name, points, "a point of the table")
        found[role] = name
    return found
