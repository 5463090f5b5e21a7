"""What acts in a dataset: springs and dampers (SPRINGDAMPER, and SFORCE of linear form), its
motions, and joints driven or held by the user.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial

from ...case.case import TIME, Sweep
from ...case.io.document import decimal, fault, shown, unknown_name
from ...case.io.schema import MOST_SAMPLES
from ...errors import CaseError, MechanismError, shortened
from ...mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ...mechanism.mechanism import GROUND, Mechanism, Point
from ...mechanism.motions import (
    Absolute,
    Driver,
    JointAngle,
    JointDisplacement,
    Motion,
    PointCoordinate,
    Table,
)
from ..explain.rank import Ranks
from ..formulas.formula import CURVES, evaluate, polynomial
from ..formulas.motion import Formula
from ..trees.options import DrivingOptions
from .dataset import Statement
from .model import Coordinate, Model, coordinates

# Where a function is tried: a linear one is known from three points, and right at the others.
_TRIED = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.7, -1.3), (-2.1, 0.4), (13.7, 3.9))
_NONLINEAR = 1e-12
_PARALLEL = 1e-6


def linear(
    statement: Statement, length: str, rate: str, form: str
) -> tuple[float, float, float, tuple[int, int]]:
    """Return constant and slopes of a function of a length or angle and its rate, and its two
    markers.

    Args:
        length, rate: names of both; an angle changes its sign with the order of its markers.
        form: the known text, for messages.

    Raises:
        CaseError: it measures something else, or is not linear.
    """
    measured = list[tuple[float, float]]()

    def measure(value: float) -> Callable[..., float]:
        def of(i: float, j: float, *_: float) -> float:
            measured.append((i, j))
            first = measured[0]
            if sorted(first) != sorted((i, j)):
                raise MechanismError(f"found markers {i:g} and {j:g} beside others, expected two")
            return -value if length == "AZ" and (i, j) != first else value

        return of

    def value_of(values: tuple[float, float]) -> float:
        own = {name: measure(x) for name, x in zip((length, rate), values, strict=True)}
        return float(evaluate(statement.function, {"SQRT": CURVES["SQRT"], **own}))

    try:
        c, of_length, of_rate, *others = map(value_of, _TRIED)
        a, b = of_length - c, of_rate - c
        for (x, y), value in zip(_TRIED[3:], others, strict=True):
            parts = c, a * x, b * y
            if abs(value - sum(parts)) > _NONLINEAR * sum(map(abs, parts)):
                raise MechanismError("found a function that is not linear")
        if not measured:
            raise MechanismError("found a constant, expected a spring or damper")
    except MechanismError as error:
        leave = f"--without {statement.kind}/{statement.id}"
        problem = f"FUNCTION: {error}; write {form}, or leave it out by {leave}"
        raise statement.fault(problem) from None
    i, j = measured[0]
    return c, a, b, (int(i), int(j))


def read_forces(model: Model, driven: Sequence[Coordinate]) -> list[ForceElement]:
    """Read the springs and dampers.

    Raises:
        CaseError: a force is not linear in the length or angle of its own markers and its rate.
    """
    found = list[ForceElement]()
    for each in model.dataset.of("SFORCE", "SPRINGDAMPER"):
        i, j = model.ends(each)
        kind = each.choice("TRANSLATIONAL", "ROTATIONAL")
        if not kind or "ACTIONONLY" in each.flags:
            raise each.fault("expected TRANSLATIONAL or ROTATIONAL between two markers; state it")
        turns = kind == "ROTATIONAL"
        if each.kind == "SFORCE":
            form = "-KT*AZ(I,J)-CT*WZ(I,J,J)" if turns else "-K*(DM(I,J)-L)-C*VR(I,J)"
            names = ("AZ", "WZ") if turns else ("DM", "VR")
            constant, a, b, measured = linear(each, *names, form)
            ends = i.statement.id, j.statement.id
            if sorted(measured) != sorted(ends):
                listed = " and ".join(map(str, measured))
                raise each.fault(
                    f"FUNCTION: found markers {listed}, expected I and J; write {form}"
                )
            sign = 1.0 if turns and measured != ends else -1.0
            stiffness, damping = sign * a, sign * b
        else:
            names = ("KT", "CT", "ANGLE", "TORQUE") if turns else ("K", "C", "LENGTH", "FORCE")
            stiffness, damping, free, preload = (each.one(name, 0.0) for name in names)
            constant = stiffness * free + preload
        if (constant and not stiffness) or not (stiffness or damping):
            raise each.fault(
                "found a constant force, expected a spring or damper; leave it out by --without"
                f" {each.kind}/{each.id}"
            )
        free = constant / stiffness if stiffness else 0.0
        units = model.units
        unit = units.force * units.length if turns else units.force / units.length
        numbers = stiffness * unit, damping * unit * units.time
        try:
            if turns:
                joint, angle = _turning_joint(model, each, driven, free)
                angle = angle if stiffness else 0.0
                found.append(TorsionSpringDamper(each.name, joint, *numbers, angle))
            else:
                ends = coordinates(model.frame(j).origin), coordinates(model.frame(i).origin)
                length = units.length * free if stiffness else None
                # a positive SFORCE pushes I and J apart
                pair = model.body(j), model.body(i)
                found.append(SpringDamper(each.name, *pair, ends, *numbers, length))
        except MechanismError as error:
            leave = f"--without {each.kind}/{each.id}"
            raise each.fault(f"{error}; or leave it out by {leave}") from None
    return found


def _turning_joint(
    model: Model, statement: Statement, driven: Sequence[Coordinate], free: float
) -> tuple[str, float]:
    """Return the joint between the parts of two markers that turns about their z axis, and its free
    angle [rad].
    """
    i, j = model.ends(statement)
    model.require_x(statement, i, j)
    axis, bodies = model.frame(j).z, [model.body(j), model.body(i)]
    for each in driven:
        along = float(each.axis @ axis)
        if not each.turns or sorted(each.joint.bodies) != sorted(bodies):
            continue
        if abs(along) < 1.0 - _PARALLEL:
            continue
        sense = math.copysign(1.0, along) * (1.0 if [*each.joint.bodies] == bodies else -1.0)
        return each.joint.name, sense * (free - model.turn(i, j))
    raise statement.fault(
        f"found no joint that turns {' against '.join(bodies)} about the z axis of {j}, expected"
        f" one; leave it out by --without {statement.kind}/{statement.id}"
    )


_FORM = (
    "JOINT:START:STOP[:SAMPLES] [rad, m] or time:START:STOP[:SAMPLES] [s], 2 to"
    f" {MOST_SAMPLES} samples"
)
_SAMPLES, _SECOND = 41, (0.0, 1.0, 101)
# Of motions of length one: less of a coordinate is rounding, or at rest within the digits.
_AT_REST = 1e-6
# A motion that begins off the place of its markers by less is rounded [rad, m].
_THERE = 1e-9
_MOST_NAMED = 8


@dataclass(frozen=True)
class Drive:
    """A driver, its value in the start [rad, m], and its motion if it has one."""

    driver: Driver
    start: float
    motion: Motion | None = None

    @staticmethod
    def of(name: str, coordinate: Coordinate, motion: Motion | None = None) -> Drive:
        """Return the drive of a joint's coordinate."""
        cls = JointAngle if coordinate.turns else JointDisplacement
        return Drive(cls(name, coordinate.joint.name), coordinate.value, motion)


def read_motions(
    model: Model, driven: Sequence[Coordinate], *, recorded: bool
) -> tuple[list[Drive], list[Point]]:
    """Read the motions of a dataset, and their driven points.

    Args:
        recorded: unreadable motions follow a recording.

    Raises:
        CaseError: a motion is not of a joint's coordinate, or its function is not read.
    """
    drives = list[Drive]()
    points = list[Point]()
    for each in model.dataset.of("MOTION"):
        if "JOINT" in each.values:
            drive = Drive.of(each.name, _of_joint(model, each, driven))
        else:
            drive = _of_markers(model, each, driven, points)
        unit = 1.0 if drive.driver.turns else model.units.length
        try:
            motion = _motion(each, drive.start, unit, model.units.time)
        except CaseError:
            if not recorded:
                raise
            note = f"{each.name}: its function is not read; it follows the recording"
            model.note(note)
            drives.append(drive)
            continue
        begins = float(motion.at(np.zeros(1))[0][0])
        if abs(begins) > _THERE:
            model.note(
                f"{each.name} begins {begins:.6g} {'rad' if drive.driver.turns else 'm'} from where"
                " its markers stand: parts start there, and the motion is the one of the function"
            )
        drives.append(replace(drive, motion=motion))
    return drives, points


def _motion(statement: Statement, start: float, unit: float, second: float) -> Formula:
    """Return the motion of a coordinate from the start; rates are integrated.

    Args:
        start: the coordinate of the parts as placed [m, rad].
        unit: unit of the function [m, rad].
        second: unit of time of the dataset [s].
    """
    order = statement.choice("DISPLACEMENT", "VELOCITY", "ACCELERATION")
    text, language = statement.function, "+ - * /, SIN, COS, STEP, POLY and numbers"
    try:
        if order in ("", "DISPLACEMENT"):
            return Formula(text, unit, -start, second)
        language = "POLY and numbers, as it is a rate"
        time = Polynomial([0.0, 1.0])
        rate = evaluate(text, {"TIME": lambda: time, "POLY": polynomial}) + 0.0 * time
        if order == "ACCELERATION":
            rate = rate.integ(k=statement.one("ICVEL", 0.0))
        path = rate.integ(k=statement.one("ICDISP", start / unit))
        text = f"POLY(TIME, 0, {', '.join(repr(float(c)) for c in path.coef)})"
        return Formula(text, unit, -start, second)
    except MechanismError as error:
        problem = str(error).removeprefix("formula motion: ")
        raise statement.fault(
            f"FUNCTION: {problem}; write it over TIME by {language}, or give --recorded FILE, whose"
            " motion is followed"
        ) from None


def _of_joint(model: Model, statement: Statement, driven: Sequence[Coordinate]) -> Coordinate:
    """Return the coordinate of the joint of a motion."""
    name = model.dataset.member(statement, "JOINT", "JOINT").name
    kind = statement.choice("TRANSLATION", "ROTATION").lower()
    own = [each for each in driven if each.joint.name == name]
    chosen = [each for each in own if kind in ("", each.freedom)]
    if len(chosen) != 1:
        known = ", ".join(each.freedom for each in own) or "none that a motion drives"
        raise statement.fault(
            f"found {kind or 'neither TRANSLATION nor ROTATION'} of {name}, expected one of its"
            f" freedoms: {known}; correct it"
        )
    return chosen[0]


def _of_markers(
    model: Model, statement: Statement, driven: Sequence[Coordinate], points: list[Point]
) -> Drive:
    """Return the drive of a motion between markers: of a point along an axis of the ground, or of
    the coordinate of a joint about or along z.
    """
    i, j = model.ends(statement)
    along = statement.choice("X", "Y", "Z", "B1", "B2", "B3")
    if not along:
        raise statement.fault("found no direction, expected X, Y, Z, B1, B2 or B3; state one")
    one, other = model.frame(i), model.frame(j)
    if along in "XYZ" and model.body(j) == GROUND:
        axis = other.axes[:, "XYZ".index(along)]
        points.append(Point(f"MARKER_{i.statement.id}", model.body(i), coordinates(one.origin)))
        driver = PointCoordinate(statement.name, points[-1].name, coordinates(axis))
        return Drive(driver, float((one.origin - other.origin) @ axis))
    for each in driven:
        same = each.joint.bodies == (model.body(j), model.body(i))
        if not same or along != ("B3" if each.turns else "Z") or one.z @ other.z < 1.0 - _PARALLEL:
            continue
        if each.axis @ other.z > 1.0 - _PARALLEL:
            value = model.turn(i, j) if each.turns else model.slide(i, j)
            return Drive.of(statement.name, replace(each, value=value))
    raise statement.fault(
        f"found a motion along {along} that is neither a displacement from the ground nor Z or B3"
        " along the axis of a joint between its parts, from J's to I's; name a joint by JOINT ="
        f" ..., or leave it out by --without MOTION/{statement.id}"
    )


def read_drives(
    model: Model,
    mechanism: Mechanism,
    driven: Sequence[Coordinate],
    moved: Sequence[Drive],
    supplied: DrivingOptions,
    weak: float,
) -> tuple[Mechanism, Sweep, list[str]]:
    """Return the mechanism with its drivers, the sweep, and the drivers without a force: those for
    a recording or a held joint, unknown to the dataset.

    Args:
        moved: the motions of the dataset.
        weak: singular values below this belong to rows redundant within the digits.

    Raises:
        CaseError: an option names no joint, or freedoms are left.
    """
    file = model.dataset.file
    known = {each.name: each for each in driven}
    ranges = {
        name: _range(model, text, known)
        for text in supplied.drive
        for name in [text.partition(":")[0]]
    }
    if (
        len(ranges) < len(supplied.drive)
        or len({n for k, (_, _, n) in ranges.items() if k != TIME}) > 1
    ):
        raise fault(
            file,
            "--drive",
            "found a joint twice, or different samples; give one range each, of as many samples",
        )
    span = ranges.pop(TIME, _SECOND)
    held = [*dict.fromkeys(supplied.hold)]
    for name in held:
        if name not in known or name in ranges:
            raise unknown_name(file, "--hold", name, known, "a joint that is not driven")
    named = [*ranges, *held]
    free = [name for name in known if name not in named]
    every = [*moved, *(Drive.of(name, known[name]) for name in (*named, *free))]
    taken, left = _independent(mechanism, [each.driver for each in every], weak)
    for k in {*range(len(moved) + len(named))} - {*taken}:
        problem = "found it locked, or driven by others already, expected a freedom of its own"
        raise fault(file, every[k].driver.name, f"{problem}; leave it out")
    rest = [every[k].driver.name for k in taken if k >= len(moved) + len(named)]
    moving = bool(ranges) or any(each.motion for each in moved)
    if not supplied.recorded and (left or not moving or (rest and not supplied.hold_rest)):
        raise _undriven_error(model, mechanism, rest, left, moving=moving)
    drives = [every[k] for k in taken]
    if supplied.recorded and (rest or not all(each.motion for each in moved)):
        if any(each.motion for each in moved):
            note = "freedoms are left without a motion that is read: all follow the recording"
            model.note(note)
        drives = [replace(each, motion=None) for each in drives]
    if left:
        model.note(
            f"{left} freedom{'s' * (left > 1)} of {_bodies(mechanism)} of no joint that could be"
            " driven: no engine follows the recording, which is judged by its joints and loads"
        )
    mechanism = replace(mechanism, drivers=[each.driver for each in drives])
    return mechanism, _sweep(drives, ranges, span), rest


def _sweep(
    drives: Sequence[Drive],
    ranges: Mapping[str, tuple[float, float, int]],
    span: tuple[float, float, int],
) -> Sweep:
    """Return the sweep: of time if the dataset has motions, else of the first driven joint, with
    which the others move straight.
    """
    motions = {each.driver.name: each.motion for each in drives if each.motion is not None}
    starts = {each.driver.name: each.start for each in drives}
    swept, design = TIME, 0.0
    if not motions and drives:
        swept = next(iter(ranges), drives[0].driver.name)
        design = starts[swept]
        span = ranges.get(swept, (design, design + 1.0, 2))
    for name in ranges:
        if name != swept:
            ends = zip((span[0] - design, span[1] - design), ranges[name][:2], strict=True)
            at, values = zip(*sorted(ends), strict=True)
            motions[name] = Absolute(Table(at, values), starts[name])
    return Sweep(swept, np.linspace(*span), design=design, motions=motions)


def _range(model: Model, text: str, known: Mapping[str, Coordinate]) -> tuple[float, float, int]:
    """Return start, stop and samples of a joint, or of time."""
    name, *parts = text.split(":")
    if name not in (TIME, *known):
        raise unknown_name(model.dataset.file, "--drive", name, [*known, TIME], f"{_FORM}")
    try:
        start, stop = map(decimal, parts[:2])
        count = int(parts[2]) if len(parts) == 3 else _SECOND[2] if name == TIME else _SAMPLES
    except ValueError:
        start, stop, count = math.nan, math.nan, 0
    if len(parts) > 3 or not 0.0 < abs(stop - start) < 1e6 or not 1 < count <= MOST_SAMPLES:
        raise fault(
            model.dataset.file, "--drive", f"found {shown(text)}, expected {_FORM}; correct it"
        )
    return start, stop, count


def _independent(
    mechanism: Mechanism, drivers: Sequence[Driver], weak: float
) -> tuple[list[int], int]:
    """Return which drivers are independent of the joints and of those before them, and how many
    freedoms are left by these.
    """
    ranks = Ranks(replace(mechanism, drivers=drivers))
    joints, rows = ranks.matrix[: ranks.joint_rows], ranks.matrix[ranks.joint_rows :]
    free = np.eye(ranks.matrix.shape[1])
    if len(joints):
        _, sizes, right = np.linalg.svd(joints, full_matrices=True)
        free = right[int((sizes > weak * sizes[0]).sum()) :]
    taken = list[int]()
    for k, row in enumerate(rows):
        along = free @ row
        if np.linalg.norm(along) > _AT_REST:
            taken.append(k)
            free = np.linalg.svd(along[None], full_matrices=True)[2][1:] @ free
    return taken, len(free)


def _bodies(mechanism: Mechanism) -> str:
    return shortened([body.name for body in mechanism.moving], _MOST_NAMED)


def _undriven_error(
    model: Model, mechanism: Mechanism, rest: Sequence[str], left: int, *, moving: bool
) -> Exception:
    """Return the error of a dataset with undriven freedoms."""
    count = len(rest) + left
    if not count:
        problem = "nothing moves: joints lock all parts, or motions stand still"
        return fault(model.dataset.file, "", f"{problem}; free a part, or add a MOTION")
    named = [f"of the joints {shortened(rest, _MOST_NAMED)}"] if rest else []
    if left:
        named.append(f"{left} of {_bodies(mechanism)} that no joint's coordinate drives")
    advice = [f"--drive {rest[0]}:START:STOP [rad, m]"] if rest and not moving else []
    advice += [f"--hold {rest[-1]}, or --hold-rest"] if rest and (moving or len(rest) > 1) else []
    plural = "s" * (count != 1)
    return fault(
        model.dataset.file,
        "",
        f"{count} freedom{plural} left without a motion, {' and '.join(named)}, expected none; say"
        f" {', or '.join([*advice, '--recorded FILE, whose motion is followed'])}",
    )
