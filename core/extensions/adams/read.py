"""From a dataset of Adams Solver to a case: parts, markers, joints, springs and motions."""

from __future__ import annotations

from pathlib import Path

from ...case.case import Case, Truth
from ...case.io.document import explained, fault
from ...case.io.readers import LEFT_OUT, WITHOUT
from ...errors import shortened
from ...kinematics import degrees_of_freedom
from ...mechanism.body import Body
from ...mechanism.mechanism import Mechanism, Point, Vector
from ..closing.digits import within_digits
from ..trees.options import DrivingOptions
from ..trees.outputs import with_all_motions
from .constraints import (
    ADDED_UP,
    CLOSED,
    WEAK,
    assemble_links,
    coordinates_of,
    joint_of,
    read_couplers,
    read_links,
    size_of,
    tolerance_of,
)
from .dataset import Dataset, read_dataset
from .functions import read_drives, read_forces, read_motions
from .model import Model, Units, read_bodies, read_markers, read_places, read_units

_LONGEST_TITLE, _MOST_NAMED = 80, 12


def read_adams(file: Path, text: str, supplied: DrivingOptions) -> Case:
    """Return the case of a dataset; outputs are the coordinates of the parts' centres of mass,
    those of joints, and the rotations of parts.

    Raises:
        CaseError: a statement cannot be read and forces the motion, markers of a joint do not come
            together, or freedoms are left without a drive.
    """
    dataset = read_dataset(file, text, supplied.without)
    if dataset.without:
        dataset.notes.append(f"{WITHOUT}{', '.join(dataset.without)}")
    units = read_units(dataset)
    model = Model(dataset, units, *read_places(dataset, units), read_markers(dataset, units))
    links = read_links(model)
    size = size_of(model)
    tolerance, why = tolerance_of(dataset, size)
    if supplied.closure is not None:
        tolerance, why = supplied.closure, "--closure"
    model = assemble_links(model, links, size, tolerance)
    bodies = read_bodies(model)
    joints = {link.statement.name: joint_of(model, link) for link in links}
    driven = coordinates_of(model, links, joints)
    couplers = read_couplers(model, driven)
    forces = read_forces(model, driven)
    moved, points = read_motions(model, driven, recorded=supplied.recorded)
    with explained(file):
        mechanism = Mechanism(
            *(file.stem, bodies, [*joints.values()], [*_points(bodies), *points], (), couplers),
            gravity=_gravity(dataset, units),
            forces=forces,
        )
    if not bodies:
        raise fault(file, "", "found no part but the ground, expected parts that move; add them")
    weak = max(WEAK, ADDED_UP * tolerance / size)
    with explained(file):
        mechanism, sweep, rest = read_drives(model, mechanism, driven, moved, supplied, weak)
    case = Case(
        file.stem,
        _source(dataset),
        Truth.CONSENSUS_ONLY,
        mechanism,
        sweep,
        (),
        assembly=tuple(dataset.notes),
        unforced=tuple(rest) if supplied.recorded else (),
    )
    free = degrees_of_freedom(mechanism) - len(mechanism.drivers)
    if tolerance > CLOSED * size and not (free > 0 and supplied.recorded):
        with explained(file):
            case = within_digits(case, tolerance, why, [*joints])
    return with_all_motions(case)


def _points(bodies: list[Body]) -> list[Point]:
    """The centres of mass of the parts, or else their origins."""
    return [
        Point(body.name, body.name, body.origin)
        if body.center_of_mass is None
        else Point(f"{body.name}.cm", body.name, body.center_of_mass)
        for body in bodies
    ]


def _gravity(dataset: Dataset, units: Units) -> Vector:
    statement = dataset.once("ACCGRAV")
    if statement is None:
        return 0.0, 0.0, 0.0
    unit = units.length / units.time**2
    x, y, z = (unit * statement.one(name, 0.0) for name in ("IGRAV", "JGRAV", "KGRAV"))
    return x, y, z


def _source(dataset: Dataset) -> str:
    """Return the source of the case, with all omissions."""
    left = {**dataset.left_out, **dataset.unread()}
    counted = [f"{kind} ({count})" for kind, count in sorted(left.items())]
    left_out = shortened(counted, _MOST_NAMED) or "nothing"
    title = dataset.title[:_LONGEST_TITLE]
    return f"Adams dataset {title!r} of {dataset.file.name}{LEFT_OUT}{left_out}"
