"""Cases from a table of hardpoints and a template.

One wheel moves up and down while chassis and steering stand still, or both wheels of an axle and a
rack move.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ...case.case import Case, Sweep, Truth
from ...case.io.document import (
    explained,
    fault,
    unknown_name,
)
from ...case.io.readers import LEFT_OUT
from ...case.notes import Range
from ...case.quantity import with_markers
from ...case.units import plain
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
from .guess import guess_of
from .options import WheelOptions
from .roles import fill_roles, listed, template_of
from .rubber import of_chrono, with_file, with_rubber
from .shims import shims
from .suspension import Side
from .table import Axes, HardpointTable, axes_of, positions_of, unit_of, wanted_corner
from .templates import (
    WHEEL_CENTER,
    WHEEL_CONTACT,
    Template,
    agree,
    corner_in,
)

SUSPENSIONS = Range(0.03, 10.0, "a suspension of ")
"""From model cars to haulage trucks. A wrong unit is an error by a factor of 1000, or at least 40.
"""
# Inner joints of a rack near the middle may be a little beyond it. No point of a wheel's suspension
# is farther beyond the middle than this share of the half track.
ACROSS = 0.25
# Cars have some tens of hardpoints at a corner. A far larger table is refused, and not searched for
# missing names.
MOST_POINTS = 10_000


def case_of_hardpoints(
    table: HardpointTable, supplied: WheelOptions, *, followed: bool = True
) -> Case:
    """Return the case of a suspension; it is consensus_only.

    Its outputs are all suspension outputs defined by its points, and the coordinates of three
    points of the knuckle.

    Args:
        followed: whether the case has its hardpoints, with the moves by each row: half of the time.

    Raises:
        OpenError: the table leaves facts open, and here is a guess.
        CaseError: the table lacks facts, or does not fill the roles of the template.
    """
    file = table.file
    if len(table.points) > MOST_POINTS:
        raise fault(
            file,
            "",
            f"found {len(table.points)} points, expected a suspension's, {MOST_POINTS} at most."
            " Take out the others",
        )
    table = _of_corner(table, supplied.corner)
    if guess := guess_of(table, supplied, case_of_hardpoints):
        raise guess.question()
    template, of_names = template_of(table, supplied)
    named, told = fill_roles(table, template, supplied)
    told = [*of_names, *told]
    unit, axes = unit_of(table, supplied.units), axes_of(table, supplied.axes)
    points = positions_of(table, unit, axes)
    at = {role: points[name] for role, name in named.items()}
    size = max(math.dist(a, b) for a in at.values() for b in at.values())
    if improbable := SUSPENSIONS.improbable(size, unit):
        problem = f"the points span {improbable} They are in another unit"
        raise fault(file, "", f"{problem}. Correct --units, or the unit in the file")
    side, of_side = _side(table, named[WHEEL_CENTER], axes, supplied)
    if side is Side.RIGHT:  # a template describes the left side
        axes = [(k, -sign if k == 1 else sign) for k, sign in axes]
        at = {role: (x, -y, z) for role, (x, y, z) in at.items()}
    if WHEEL_CONTACT not in named and table.wheel_radius and supplied.wheel_radius is None:
        bare = table.wheel_radius[-1].isdigit()
        radius = f"{table.wheel_radius}{unit.name if bare else ''}"
        supplied = replace(supplied, wheel_radius=radius)
        told.append(f"wheel radius {radius}, of the file")
    if table.static_toe or table.static_camber:
        angles = (f"{math.degrees(x):.6g} deg" for x in (table.static_toe, table.static_camber))
        told.append("static toe {} and camber {}, of the file".format(*angles))
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
    source += f"{LEFT_OUT}{listed(others)}"
    case = Case(file.stem, source, Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    case = replace(case, length_unit=unit.name, angle_unit="deg", assembly=(*told, *of_side))
    case = with_suspension_outputs(
        case,
        template,
        vehicle,
        at,
        supplied.axle,
        steered=supplied.rack is not None,
        swing_arms=supplied.swing_arms,
    )
    if followed:
        turned, unsteered = shims(template, at, vehicle)
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
    correct = "Correct --axes" if table.axes is None else "Correct the points"
    if len({*stated.values()}) > 1:
        problem = f"found {supplied.side}, but the points of this file are of the {table.side} side"
        raise fault(table.file, "--side", f"{problem}. Leave out --side")
    for where, side in stated.items():
        if side is not found or y == 0.0:
            problem = f"found {number}, not {side} of the middle, but {where} says {side}"
            raise fault(table.file, center, f"{problem}, expected the same. {correct}, or the side")
    turned = np.zeros((3, 3))
    for row, (k, way) in enumerate(axes):
        turned[row, k] = way
    if y == 0.0 or (not stated and found is Side.RIGHT and np.linalg.det(turned) < 0.0):
        problem = f"found {number}, not left of the middle, expected the left side"
        why = "" if y == 0.0 else " in left-handed axes"
        raise fault(
            table.file, center, f"{problem}{why}. {correct}, or say --side right for a right wheel"
        )
    if stated or found is Side.LEFT:
        return found, []
    note = f"{center} has {number}, right of the middle: read as a right wheel"
    return found, [f"{note}. --side right, or a line # side: right, states it"]


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
            " corners apart. Leave out --corner for a table of one wheel",
        )
    kept = {name: each for name, each in table.points.items() if agree(corners[name], wanted)}
    left_out = [*table.left_out, f"{len(table.points) - len(kept)} points of other corners"]
    side = table.side or wanted[1] or None
    return replace(table, points=kept, left_out=left_out, side=side, corner=wanted)


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
    advice = "Correct --axes" if table.axes is None else "Correct the points"
    across = [role for role, (_, y, _) in at.items() if y < -ACROSS * at[WHEEL_CENTER][1]]
    for role in across[:1]:
        raise fault(
            table.file,
            named[role],
            f"found {written(role, 1)}, on the other side than {named[WHEEL_CENTER]} with"
            f" {written(WHEEL_CENTER, 1)}, expected all points on one side. Correct its sign",
        )
    for front, rear in template.ahead:
        if {front, rear} <= at.keys() and at[front][0] <= at[rear][0]:
            raise fault(
                table.file,
                named[front],
                f"found {written(front, 0)}, and {named[rear]} with {written(rear, 0)}, expected it"
                f" in front of that. {advice}",
            )
    for high, low in template.above:
        if low in at and at[high][2] <= at[low][2]:
            raise fault(
                table.file,
                named[high],
                f"found {written(high, 2)}, not above {named[low]} with {written(low, 2)}, expected"
                f" it above. {advice}",
            )
