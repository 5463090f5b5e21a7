"""Springs and dampers of a dataset: SPRINGDAMPER, and SFORCE of linear form."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ....errors import MechanismError
from ....mechanism.formula import CURVES, evaluate
from ....mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from .dataset import Statement
from .model import Coordinate, Model
from .parts import Marker, coordinates

# Where a function is tried: a linear one is known from three points, and right at the others.
_TRIED = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.7, -1.3), (-2.1, 0.4), (13.7, 3.9))
_ROUNDED = 1e-12
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
    measured: list[tuple[float, float]] = []

    def measure(value: float) -> Callable[..., float]:
        def of(i: float, j: float, *_: float) -> float:
            measured.append((i, j))
            first = measured[0]
            if sorted(first) != sorted((i, j)):
                raise MechanismError(f"found markers {i:g} and {j:g} beside others, expected two")
            return -value if length == "AZ" and (i, j) != first else value

        return of

    def tried(values: tuple[float, float]) -> float:
        own = {name: measure(x) for name, x in zip((length, rate), values, strict=True)}
        return float(evaluate(statement.function, {"SQRT": CURVES["SQRT"], **own}))

    try:
        c, of_length, of_rate, *others = map(tried, _TRIED)
        a, b = of_length - c, of_rate - c
        for (x, y), value in zip(_TRIED[3:], others, strict=True):
            parts = c, a * x, b * y
            if abs(value - sum(parts)) > _ROUNDED * sum(map(abs, parts)):
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
    found: list[ForceElement] = []
    for each in (*model.dataset.of("SFORCE"), *model.dataset.of("SPRINGDAMPER")):
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
        try:
            make = _torsion if turns else _spring
            found.append(make(model, each, (i, j), (stiffness, damping, free), driven))
        except MechanismError as error:
            leave = f"--without {each.kind}/{each.id}"
            raise each.fault(f"{error}; or leave it out by {leave}") from None
    return found


def _spring(
    model: Model,
    statement: Statement,
    ends: tuple[Marker, Marker],
    numbers: tuple[float, float, float],
    _: Sequence[Coordinate],
) -> ForceElement:
    """Return a spring between two markers; a positive SFORCE pushes them apart."""
    (i, j), (stiffness, damping, free) = ends, numbers
    units = model.units
    per_length = units.force / units.length
    points = coordinates(model.frame(j).origin), coordinates(model.frame(i).origin)
    return SpringDamper(
        *(statement.name, model.body(j), model.body(i), points),
        stiffness * per_length,
        damping * per_length * units.time,
        units.length * free if stiffness else None,
    )


def _torsion(
    model: Model,
    statement: Statement,
    ends: tuple[Marker, Marker],
    numbers: tuple[float, float, float],
    driven: Sequence[Coordinate],
) -> ForceElement:
    """Return a torsion spring about the joint between the parts of two markers."""
    (i, j), (stiffness, damping, free) = ends, numbers
    model.require_x(statement, i, j)
    axis, bodies = model.frame(j).z, [model.body(j), model.body(i)]
    for each in driven:
        along = float(each.axis @ axis)
        if not each.turns or sorted(each.joint.bodies) != sorted(bodies):
            continue
        if abs(along) < 1.0 - _PARALLEL:
            continue
        sense = math.copysign(1.0, along) * (1.0 if [*each.joint.bodies] == bodies else -1.0)
        torque = model.units.force * model.units.length
        return TorsionSpringDamper(
            *(statement.name, each.joint.name, stiffness * torque),
            damping * torque * model.units.time,
            sense * (free - model.turn(i, j)) if stiffness else 0.0,
        )
    raise statement.fault(
        f"found no joint that turns {' against '.join(bodies)} about the z axis of {j}, expected"
        f" one; leave it out by --without {statement.kind}/{statement.id}"
    )
