"""Case files, schema kincheck-case/1: TOML, or JSON with the same keys, to a `Case`."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from ..drivers import Driver, JointAngle, JointDisplacement, PointCoordinate
from ..errors import MechanismError
from ..joints import Joint, Kind
from ..mechanism import Body, Mechanism, Point, Vector
from .case import Case, Output, Sweep, Truth
from .document import as_table, fault, join, parse, read_text, remedy, shown, typed
from .reference import Convert, ReferenceKeys, is_derivative, read_reference
from .schema import (
    SCHEMA,
    BodyKeys,
    CaseKeys,
    OutputKeys,
    PointKeys,
    SweepKeys,
    UnitsKeys,
    driver_keys,
    geometry,
    joint_keys,
)

LARGEST_FILE = 4_000_000

# Hardpoints are measured to about a micrometre; double precision rounds coordinates of metre-sized mechanisms at 1e-16 m.
DEFAULT_ATOL = 1e-9
DEFAULT_WHY = (
    "the default of 1e-9 m: a thousandth of the micrometre that hardpoints are measured to, and millions of times the round-off "
    "of metre-sized coordinates in double precision"
)

LENGTHS: Mapping[str, Convert] = {"m": float, "mm": lambda x: x / 1000.0}
ANGLES: Mapping[str, Convert] = {"rad": float, "deg": math.radians}
DRIVERS: Mapping[str, type[Driver]] = {cls.type: cls for cls in (PointCoordinate, JointAngle, JointDisplacement)}
AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def load_case(path: str | Path) -> Case:
    """The case in a file, in SI units. Without a [reference] it is consensus_only, whatever it claims.

    Raises:
        CaseError: the file, or its reference, cannot be read or does not make sense; the message names file, key and remedy.
    """
    file = Path(path)
    tables = parse(file, read_text(file, LARGEST_FILE, "a case holds hardpoints; samples belong into a reference file"))
    if tables.get("schema") != SCHEMA:
        found = shown(tables["schema"]) if "schema" in tables else "none"
        raise fault(file, "schema", f'found {found}, expected "{SCHEMA}"; write schema = "{SCHEMA}"')
    keys = typed(file, "", tables, CaseKeys)
    units = typed(file, "units", keys.units, UnitsKeys)
    length, angle = LENGTHS[units.length], ANGLES[units.angle]
    mechanism = _mechanism(file, keys, length)
    sweep, driver_unit = _sweep(file, keys, mechanism, length, angle)
    outputs = _outputs(file, keys, mechanism, length)
    case = Case(keys.name, keys.source, Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)
    if keys.reference is None:
        return case
    if keys.truth in (None, Truth.CONSENSUS_ONLY):
        found = "nothing" if keys.truth is None else shown(str(keys.truth))
        kinds = ", ".join(kind for kind in Truth if kind is not Truth.CONSENSUS_ONLY)
        raise fault(file, "truth", f"found {found} beside a [reference], expected where that comes from; give one of {kinds}")
    columns = typed(file, "reference", keys.reference, ReferenceKeys)
    series = read_reference(file, columns, driver_unit, length, sweep.values, [output.name for output in outputs])
    return replace(case, truth=keys.truth, reference=series)


@contextmanager
def _explained(file: Path, key: str = "") -> Generator[None]:
    """What a description refuses becomes an error of the file."""
    try:
        yield
    except MechanismError as error:
        raise fault(file, key, str(error)) from None


def _scaled(kind: Kind, value: Any, length: Convert) -> Any:
    """A geometry field in SI; directions have no unit, and what may be left out is None then."""
    if value is None:
        return None
    match kind:
        case Kind.LENGTH:
            return length(value)
        case Kind.POSITION:
            return tuple(map(length, value))
        case Kind.POSITIONS:
            return tuple(tuple(map(length, each)) for each in value)
        case Kind.DIRECTION | Kind.DIRECTIONS:
            return value


def _mechanism(file: Path, keys: CaseKeys, length: Convert) -> Mechanism:
    bodies: list[Body] = []
    for name, value in keys.bodies.items():
        body = typed(file, key := join("bodies", name), value, BodyKeys)
        with _explained(file, key):
            bodies.append(Body(name, _scaled(Kind.POSITION, body.origin, length), body.euler_parameters, body.fixed))
    points: list[Point] = []
    for name, value in keys.points.items():
        point = typed(file, join("points", name), value, PointKeys)
        points.append(Point(name, point.body, _scaled(Kind.POSITION, point.position, length)))
    joints = [_joint(file, join("joints", name), name, value, length) for name, value in keys.joints.items()]
    drivers = [_driver(file, join("drivers", name), name, value) for name, value in keys.drivers.items()]
    if not drivers:
        raise fault(file, "drivers", "found no driver, expected at least the swept one; add [drivers.NAME]")
    with _explained(file):
        return Mechanism(keys.name, bodies, joints, points, drivers)


_Class = TypeVar("_Class", bound=type)


def _class(file: Path, key: str, what: str, value: object, known: Mapping[str, _Class]) -> _Class:
    """The class that the key `type` of a table names."""
    name = as_table(file, key, value).get("type", "")
    if not isinstance(name, str) or name not in known:
        raise fault(file, join(key, "type"), f"found {shown(name)}, expected a {what} type; {remedy(str(name), known)}")
    return known[name]


def _joint(file: Path, key: str, name: str, value: object, length: Convert) -> Joint:
    cls = _class(file, key, "joint", value, Joint.registry)
    keys: Any = typed(file, key, value, joint_keys(cls))
    given = {each.name: _scaled(each.metadata["kind"], getattr(keys, each.name), length) for each in geometry(cls)}
    with _explained(file, key):
        return cls(name, *keys.bodies, **given)


def _driver(file: Path, key: str, name: str, value: object) -> Driver:
    cls = _class(file, key, "driver", value, DRIVERS)
    keys = msgspec.structs.asdict(typed(file, key, value, driver_keys(cls)))
    del keys["type"]
    with _explained(file, key):
        return cls(name, **keys)


def _unit(direction: Vector) -> Vector:
    length = math.hypot(*direction)
    x, y, z = direction
    return x / length, y / length, z / length


def _sweep(file: Path, keys: CaseKeys, mechanism: Mechanism, length: Convert, angle: Convert) -> tuple[Sweep, Convert]:
    """The sweep, and what makes SI of its driver's values."""
    sweep = typed(file, "sweep", keys.sweep, SweepKeys)
    if sweep.driver not in keys.drivers:
        raise fault(file, "sweep.driver", f"found {shown(sweep.driver)}, expected a driver; {remedy(sweep.driver, keys.drivers)}")
    if sweep.rate == 0.0:
        raise fault(file, "sweep.rate", "found 0, expected driver units per second; give 1 to differentiate by the driver's value")
    if sweep.start == sweep.stop and sweep.steps > 1:
        problem = f"found the start {sweep.start!r} again with {sweep.steps} steps, expected another value"
        raise fault(file, "sweep.stop", f"{problem}; give steps = 1 for a single sample")
    driver, design = mechanism.driver(sweep.driver), 0.0
    unit = angle if isinstance(driver, JointAngle) else length
    if isinstance(driver, PointCoordinate) and not driver.relative:
        design = float(np.dot(_unit(driver.direction), mechanism.point(driver.point).position))
    grid = np.linspace(sweep.start, sweep.stop, sweep.steps).tolist()
    return Sweep(sweep.driver, np.array([unit(value) for value in grid]), unit(sweep.rate), design), unit


def _outputs(file: Path, keys: CaseKeys, mechanism: Mechanism, length: Convert) -> tuple[Output, ...]:
    if not keys.points:
        raise fault(file, "points", "found no point, expected one whose motion is compared; add [points.NAME]")
    if keys.outputs:
        return tuple(_output(file, join("outputs", name), name, value, keys, length) for name, value in keys.outputs.items())
    return tuple(
        Output(f"{point.name}.{axis}", point.name, along, False, DEFAULT_ATOL, 0.0, DEFAULT_WHY)
        for point in mechanism.points
        for axis, along in AXES.items()
    )


def _output(file: Path, key: str, name: str, value: object, keys: CaseKeys, length: Convert) -> Output:
    output = typed(file, key, value, OutputKeys)
    if is_derivative(name):
        raise fault(file, key, "a name with this ending is a derivative in reference tables; give the output another name")
    if output.point not in keys.points:
        raise fault(file, join(key, "point"), f"found {shown(output.point)}, expected a point; {remedy(output.point, keys.points)}")
    match output.component, output.direction:
        case str(axis), None:
            direction = AXES[axis]
        case None, (_, _, _) as found:
            if not any(found):
                raise fault(file, join(key, "direction"), "found zero, expected a direction; give one of any other length")
            direction = _unit(found)
        case component, _:
            what = "neither component nor direction" if component is None else "both component and direction"
            raise fault(file, key, f'found {what}, expected one of them; give component = "x" or direction = [x, y, z]')
    return Output(name, output.point, direction, output.relative, *_tolerance(file, key, output, length))


def _tolerance(file: Path, key: str, output: OutputKeys, length: Convert) -> tuple[float, float, str]:
    """atol [m], rtol [-] and the reason for them."""
    if output.atol is None and output.rtol is None:
        if output.why is not None:
            raise fault(file, join(key, "why"), "found a reason without a tolerance, expected both; add atol or rtol")
        return DEFAULT_ATOL, 0.0, DEFAULT_WHY
    if output.why is None:
        raise fault(file, join(key, "why"), "missing, expected the reason for the tolerance; add the key 'why'")
    return length(output.atol or 0.0), output.rtol or 0.0, output.why
