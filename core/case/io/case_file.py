"""Case files, schema kincheck-case/1: TOML, or JSON with the same keys, to a `Case`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ...errors import MechanismError, unknown
from ...joints import Kind
from ...mechanism.dimension import ACCELERATION
from ...mechanism.mechanism import Body, Mechanism, Point
from ..case import Case, Truth, size
from ..quantity import with_markers
from ..units import ANGLES, LENGTHS, Unit
from .compliance import read_resting, read_rig
from .coordinates import with_all_coordinates
from .document import explained, fault, join, shown
from .driving import read_drivers, read_sweep
from .in_si import geometry_in_si, load_in_si
from .joints import read_joints
from .loads import inertia_in_si, read_bushings, read_forces
from .outputs import read_outputs
from .reference import read_reference
from .reference_columns import Convert
from .reference_samples import ReferenceKeys
from .schema import (
    SCHEMA,
    BodyKeys,
    CaseKeys,
    ClosureKeys,
    PointKeys,
    UnitsKeys,
)
from .typed_tables import as_table, read_tables, typed

LARGEST_FILE = 4_000_000
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
    keys = typed(file, "", read_tables(file, LARGEST_FILE, advice, SCHEMA), CaseKeys)
    for what in _PARTS:
        if (count := len(getattr(keys, what))) > MOST_PARTS:
            raise fault(
                file,
                what,
                f"found {count}, expected {MOST_PARTS} at most; divide the mechanism into several"
                " cases",
            )
    units = typed(file, "units", keys.units, UnitsKeys)
    length, angle = LENGTHS[units.length], ANGLES[units.angle]
    mechanism = _mechanism(file, keys, length, angle)
    columns = None
    if keys.reference is not None:
        columns = typed(file, "reference", keys.reference, ReferenceKeys)
    sweep, driver_unit, own_grid = read_sweep(file, keys, mechanism, length, angle, columns)
    by_unit: dict[str, Convert] = {"m": length, "rad": angle, "1": float, "N": float, "N m": length}
    case = Case(keys.name, keys.source, Truth.CONSENSUS_ONLY, mechanism, sweep, ())
    if keys.equilibrium is not None:
        from .resting import at_rest  # it takes the solver, and few cases need it

        resting = read_resting(file, keys.equilibrium, mechanism)
        with explained(file, "equilibrium", length):
            case = at_rest(case, resting)
    case = _with_outputs(
        file, keys, replace(case, length_unit=length.name, angle_unit=angle.name), length, by_unit
    )
    if keys.compliance is not None:
        case = replace(case, rig=read_rig(file, keys.compliance, case.mechanism, length))
    with explained(file, "closure", length):
        case = _within_digits(case, typed(file, "closure", keys.closure, ClosureKeys), closure)
    if columns is None:
        return case
    if keys.truth in (None, Truth.CONSENSUS_ONLY):
        found = "nothing" if keys.truth is None else shown(str(keys.truth))
        kinds = ", ".join(kind for kind in Truth if kind is not Truth.CONSENSUS_ONLY)
        raise fault(
            file,
            "truth",
            f"found {found} beside a [reference], expected where that comes from; give one of"
            f" {kinds}",
        )
    convention = (
        ""
        if keys.suspension is None
        else str(as_table(file, "suspension", keys.suspension)["convention"])
    )
    series, origin = read_reference(
        file,
        columns,
        driver_unit,
        by_unit,
        sweep.values,
        case.outputs,
        convention,
        keys.truth,
        own_grid=own_grid,
    )
    return replace(case, truth=keys.truth, reference=series, origin=origin)


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
    from ..closing import within_digits  # it imports the solver, and few cases need it

    return within_digits(case, closure, why, keys.carrying)


def _mechanism(file: Path, keys: CaseKeys, length: Unit, angle: Unit) -> Mechanism:
    bodies: list[Body] = []
    for name, value in keys.bodies.items():
        body = typed(file, key := join("bodies", name), value, BodyKeys)
        with explained(file, key):
            bodies.append(
                Body(
                    name,
                    geometry_in_si(Kind.POSITION, body.origin, length),
                    body.euler_parameters,
                    body.fixed,
                    body.mass,
                    geometry_in_si(Kind.POSITION, body.center_of_mass, length),
                    inertia_in_si(name, body.inertia, length),
                )
            )
    points: list[Point] = []
    for name, value in keys.points.items():
        point = typed(file, join("points", name), value, PointKeys)
        points.append(
            Point(name, point.body, geometry_in_si(Kind.POSITION, point.position, length))
        )
    joints, couplers = read_joints(file, keys, length, angle)
    drivers = read_drivers(file, keys.drivers)
    forces = read_forces(file, keys.forces, length, angle)
    bushings = read_bushings(file, keys.joints, joints, length, angle)
    gravity = load_in_si(ACCELERATION, keys.gravity, length, angle)
    with explained(file, "", length):
        return Mechanism(
            *(keys.name, bodies, joints, points, drivers, couplers),
            gravity=gravity,
            forces=forces,
            bushings=bushings,
        )


def _with_outputs(
    file: Path, keys: CaseKeys, case: Case, length: Unit, units: Mapping[str, Convert]
) -> Case:
    """Return the case with its outputs and the additional points they need."""
    mechanism = case.mechanism
    if not (keys.points or keys.outputs):
        raise fault(
            file,
            "points",
            "found no point, expected one whose motion is compared; add [points.NAME], or an output"
            " of a joint or body, [outputs.NAME]",
        )
    if keys.suspension is None:
        outputs = read_outputs(file, keys, None, case, units)
        if not outputs:
            return with_all_coordinates(case)
        return replace(case, mechanism=with_markers(mechanism, outputs), outputs=outputs)
    from . import suspension  # it has many classes, and few cases have a wheel
    from .suspension_table import read_suspension

    table = read_suspension(file, keys.suspension, case, length, units["rad"])
    case = replace(case, wheels=tuple(each for each in (table.vehicle, table.other) if each))
    outputs = read_outputs(file, keys, table, case, units) or with_all_coordinates(case).outputs
    case = replace(case, mechanism=with_markers(mechanism, outputs), outputs=outputs)
    return (
        replace(case, outputs=suspension.with_slopes(outputs, size(case)))
        if table.per_travel
        else case
    )
