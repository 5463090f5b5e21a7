"""Components of a large mechanism: sets of bodies solved one after the other.

Earlier components prescribe the motion of their bodies to later ones. A matching of rows with
bodies' columns and the strongly connected sets of bodies give the components (block-triangular
form). A component becomes a mechanism of its own, a section, with numbered names: components of the
same structure then differ in their geometry only and share programs.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from graphlib import TopologicalSorter

import numpy as np

from ...algebra import ZERO, vec
from ...errors import SolveError
from ...failures import FailureKind
from ...joints import Joint, Kind
from ...mechanism.mechanism import GROUND, Body, Mechanism, Point, Vector, extent
from ...mechanism.motions import Driver, JointDriver, PointCoordinate
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Frames, unit_near
from ..formulation.parameters import places
from ..formulation.relative import Formulation
from ..formulation.state_vectors import jacobian
from .degrees_of_freedom import Selection, counted, selected
from .redundancy import independent_rows

ORIGIN = "origin "
"""Prefix of the name of a section's point that is only the internal origin of a body."""


@dataclass(frozen=True, eq=False)
class Component:
    """Bodies that are solved together.

    Attributes:
        given: moving bodies of earlier components, touched by its joints and drivers.
        joints, drivers: those of the component.
    """

    bodies: tuple[str, ...]
    given: tuple[str, ...]
    joints: tuple[Joint, ...]
    drivers: tuple[Driver, ...]

    @property
    def extent(self) -> float:
        """A power of two of metres near its size; zero if all its joints are at one point."""
        points = [point for joint in self.joints for point in joint.points_on()]
        size = extent(points)
        return unit_near(size) if size > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Section:
    """A component as a mechanism of its own.

    Attributes:
        unit: length unit of the whole mechanism [m].
        given: moving bodies that are solved elsewhere.
        origins: place (see `places`) of the internal origin of every moving body.
    """

    mechanism: Mechanism
    unit: float
    given: tuple[str, ...]
    origins: Mapping[str, str]

    @property
    def signature(self) -> object:
        """A key, equal for sections that differ in their geometry only."""
        m = self.mechanism
        return (
            m.bodies,
            tuple((joint.type, joint.bodies, *_besides_geometry(joint)) for joint in m.joints),
            tuple((point.name, point.body) for point in m.points),
            m.drivers,
            tuple(self.origins.items()),
        )

    def frame(self, mechanism: Mechanism) -> Frames:
        """Return the frames of the section for a mechanism of its structure and traced geometry."""
        value = places(mechanism)
        fixed = dict.fromkeys(
            (GROUND, *(body.name for body in mechanism.bodies if body.fixed)), ZERO
        )
        moving = {
            name: (1.0 / self.unit) * vec(value[place]) for name, place in self.origins.items()
        }
        return Frames(
            self.unit,
            fixed | moving,
            tuple(body.name for body in mechanism.moving if body.name not in self.given),
        )


def _besides_geometry(joint: Joint) -> list[object]:
    """Return the other fields of a joint, and for each optional length whether it is absent."""
    values = [(each, getattr(joint, each.name)) for each in fields(joint)]
    return [
        value is None if "kind" in each.metadata else value
        for each, value in values
        if each.name != "name"
    ]


def components(mechanism: Mechanism, frame: Frames) -> list[Component]:
    """Return the components in the order of their solution.

    Raises:
        SolveError: couplers connect joints, or the rows cannot be matched with the unknowns.
    """
    if mechanism.couplers:
        raise SolveError(
            f"mechanism {mechanism.name!r}: couplers tie its components together; solve it as one"
        )
    formulation = Cartesian.of(mechanism, frame)
    order = _order(mechanism, formulation)
    level = {name: k for k, bodies in enumerate(order) for name in bodies}
    joints: list[list[Joint]] = [[] for _ in order]
    drivers: list[list[Driver]] = [[] for _ in order]
    given: list[dict[str, None]] = [{} for _ in order]

    def place(bodies: Sequence[str]) -> int:
        """Return the component of the body solved last; there the others are prescribed."""
        moving = [name for name in bodies if name in level]
        last = max(level[name] for name in moving)
        given[last] |= dict.fromkeys(name for name in moving if level[name] != last)
        return last

    for joint in mechanism.joints:
        joints[place(joint.bodies)].append(joint)
    for driver in mechanism.drivers:
        drivers[place(_bodies(mechanism, driver))].append(driver)
    parts = zip(order, given, joints, drivers, strict=True)
    return [
        Component(bodies, tuple(others), tuple(js), tuple(ds)) for bodies, others, js, ds in parts
    ]


def _bodies(mechanism: Mechanism, driver: Driver) -> tuple[str, ...]:
    if isinstance(driver, JointDriver):
        return mechanism.joint(driver.joint).bodies
    return (mechanism.point(driver.point).body,) if isinstance(driver, PointCoordinate) else ()


def _order(mechanism: Mechanism, formulation: Cartesian) -> list[tuple[str, ...]]:
    """Return the sets of bodies in the order of their solution."""
    sparse, graphs = (
        importlib.import_module(name) for name in ("scipy.sparse", "scipy.sparse.csgraph")
    )
    rows = formulation.rows(formulation.configuration(formulation.design))
    n = formulation.unknowns
    at = [(k, column) for k, row in enumerate(rows) for column in row]
    pattern = sparse.coo_array(
        (np.ones(len(at)), tuple(np.array(at).T)), shape=(len(rows), n)
    ).tocsr()
    row_of: list[int] = graphs.maximum_bipartite_matching(pattern, perm_type="row").tolist()
    if min(row_of) < 0:
        raise SolveError(
            f"mechanism {mechanism.name!r}: its rows cannot be matched with its unknowns; it is not"
            " driven enough",
            FailureKind.FREE,
        )
    # a joint's own coordinate goes to the body with which its joint is solved
    owner = {
        name: mechanism.joint(name.rsplit(".", 1)[0]).bodies for name in formulation.coordinates
    }
    body_of = [k // COLUMNS for k in range(COLUMNS * len(formulation.bodies))]
    body_of += [
        next(
            formulation.columns[b] // COLUMNS for b in owner[name][::-1] if b in formulation.columns
        )
        for name in owner
    ]
    needs = {
        (body_of[column], body_of[other]) for column, k in enumerate(row_of) for other in rows[k]
    }
    shape = (len(formulation.bodies),) * 2
    graph = sparse.coo_array((np.ones(len(needs)), tuple(np.array(sorted(needs)).T)), shape=shape)
    count, set_of = graphs.connected_components(graph, directed=True, connection="strong")
    before: dict[int, set[int]] = {k: set() for k in range(count)}
    for body, other in needs:
        if set_of[body] != set_of[other]:
            before[int(set_of[body])].add(int(set_of[other]))
    members: dict[int, list[str]] = {k: [] for k in range(count)}
    for name, k in zip(formulation.bodies, set_of.tolist(), strict=True):
        members[k].append(name)
    return [tuple(members[k]) for k in TopologicalSorter(before).static_order()]


def section(
    component: Component,
    unit: float,
    origins: Mapping[str, Vector],
    points: Sequence[Point],
    bodies: Sequence[Body],
) -> Section:
    """Return the component with numbered names.

    Bodies are b0, b1, ..., prescribed bodies g0, ..., joints j0, ..., points p0, ... They have no
    masses: motion does not need them, and components that differ in masses share a program.

    Args:
        origins: internal origin of every moving body, global [m].
        points: output points and driven points.
        bodies: its own bodies whose motion is an output.
    """
    own = {name: f"b{k}" for k, name in enumerate(component.bodies)}
    names = own | {name: f"g{k}" for k, name in enumerate(component.given)}
    joint_names = {joint.name: f"j{k}" for k, joint in enumerate(component.joints)}
    point_names = {point.name: f"p{k}" for k, point in enumerate(points)}
    joints = [
        joint.changed(
            name=joint_names[joint.name], i=names.get(joint.i, GROUND), j=names.get(joint.j, GROUND)
        )
        for joint in component.joints
    ]
    named = [
        replace(point, name=point_names[point.name], body=names.get(point.body, GROUND))
        for point in points
    ]
    drivers: list[Driver] = []
    for driver in component.drivers:
        if isinstance(driver, JointDriver):
            drivers.append(replace(driver, joint=joint_names[driver.joint]))
        elif isinstance(driver, PointCoordinate):
            drivers.append(replace(driver, point=point_names[driver.point]))
    at: dict[str, str] = {}
    for name, body in names.items():
        found = next(
            (place for place, point in _joint_places(joints, body) if point == origins[name]), None
        )
        if found is None:  # an origin at no joint of the component is a point of its own
            named.append(Point(f"{ORIGIN}{body}", body, origins[name]))
            found = f"points.{ORIGIN}{body}.position"
        at[body] = found
    wanted = {body.name: body for body in bodies}
    described = [
        Body(new, wanted[name].origin, wanted[name].euler_parameters)
        if name in wanted
        else Body(new)
        for name, new in names.items()
    ]
    return Section(
        Mechanism("section", described, joints, named, drivers),
        unit,
        tuple(names.values())[len(own) :],
        at,
    )


def _joint_places(joints: Sequence[Joint], body: str) -> list[tuple[str, tuple[float, ...]]]:
    """Return the places of the points of joints on a body, with their values."""
    parts = [
        (joint.name, part) for joint in joints if body in joint.bodies for part in joint.parts(body)
    ]
    return [
        (f"joints.{owner}.{name}", value)
        for owner, (name, kind, value) in parts
        if kind is Kind.POSITION
    ]


def select_section(mechanism: Mechanism, formulation: Formulation) -> Selection:
    """Select the rows of a section to solve, drivers first.

    Raises:
        SolveError: there are too few independent rows.
    """
    matrix, drivers = jacobian(formulation), len(mechanism.drivers)
    kept = independent_rows(matrix, drivers, formulation.conditions)
    if len(kept) < formulation.unknowns:
        raise SolveError(
            f"a component with the joints {', '.join(joint.type for joint in mechanism.joints)} can"
            f" still move at the design position (rank {len(kept)} of {formulation.unknowns}):"
            " lock-up, dead centre or too few drivers; shift the design",
            FailureKind.LOCKED,
        )
    found = counted(mechanism, formulation.unknowns, len(matrix) - drivers, ())
    return selected(found, formulation, kept)
