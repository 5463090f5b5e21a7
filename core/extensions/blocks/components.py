"""Components of a large mechanism: sets of bodies solved one after the other.

Earlier components prescribe the motion of their bodies to later ones. A matching of rows with
bodies' columns and the strongly connected sets of bodies give the components (block-triangular
form). The constraints of a component get numbered names, as a section: sections of one structure
then differ in their numbers only and share programs.
"""

from __future__ import annotations

import importlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from graphlib import TopologicalSorter
from typing import Any, cast

import numpy as np

from ...algebra import Quat, Scalar, Vec3, quat
from ...errors import SolveError
from ...failures import FailureKind
from ...joints import Joint
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian, PrescribedBody
from ...kinematics.formulation.constraints import (
    Constraint,
    Frames,
    Relation,
    constraints,
    frames,
    unit_near,
)
from ...kinematics.formulation.state_vectors import jacobian
from ...kinematics.structure.degrees_of_freedom import (
    COORDINATES,
    FreedomAccount,
    Selection,
    selection_of,
)
from ...kinematics.structure.redundancy import independent_rows
from ...mechanism.mechanism import Mechanism, Point, Vector, extent
from ...primitives.base import Drive
from .numbers_of import coordinates_of, renamed, structure, with_numbers


@dataclass(frozen=True, eq=False)
class Section:
    """A component with numbered names: those of one structure differ in their numbers only.

    Bodies are b0, b1, ..., prescribed bodies g0, ..., joints j0, ..., drivers d0, ..., points p0,
    ...

    Attributes:
        unit: length unit [m].
        given: moving bodies that are solved elsewhere.
        joints: types of the joints.
        settings: what the joints are besides their geometry: of equal joints.
        constraints: of the joints.
        drivers: the constraint of each driver, by its own name.
        points: body, position [m] and arm [units] of those whose motion is wanted.
        outputs: position, arm and Euler parameters of the bodies whose motion is wanted.
    """

    unit: float
    bodies: tuple[str, ...]
    given: tuple[str, ...]
    joints: tuple[str, ...]
    settings: tuple[str, ...]
    constraints: tuple[Constraint | Relation, ...]
    drivers: Mapping[str, Constraint]
    points: Mapping[str, tuple[str, Vector, Vec3]]
    outputs: Mapping[str, tuple[Vector, Vec3, Quat]]

    @property
    def unnamed(self) -> Section:
        """The section with numbered names of its drivers too."""
        return replace(self, drivers={str(n): c for n, c in enumerate(self.drivers.values())})

    def formulation(
        self, prescribed: Mapping[str, PrescribedBody], drives: Mapping[str, Drive]
    ) -> Cartesian:
        """Return its equations, for motions of the prescribed bodies and of the drivers."""
        primitives: dict[str, Any] = {name: c.primitive for name, c in self.drivers.items()}
        driven = [
            replace(c, primitive=replace(primitives[name], drive=drives[name]))
            for name, c in self.drivers.items()
        ]
        return Cartesian([*self.constraints, *driven], self.bodies, prescribed=prescribed)


@dataclass(frozen=True, eq=False)
class Alike:
    """Sections of one structure.

    Attributes:
        first: one of them.
        varied: positions, among the numbers of each, of those that are not the same in all.
    """

    first: Section
    varied: Sequence[int]

    @property
    def frame(self) -> Frames:
        """The frame of the lengths."""
        return Frames(self.first.unit, {}, self.first.bodies)

    @property
    def given(self) -> Sequence[str]:
        """Bodies that are solved elsewhere."""
        return self.first.given

    @property
    def numbers(self) -> list[Scalar]:
        """The varied numbers of the first section."""
        every = self._numbers()
        return [every[k] for k in self.varied]

    def _numbers(self) -> list[Scalar]:
        found = list[Scalar]()
        structure(self.first, found)
        return found

    def with_numbers(self, given: Sequence[Scalar]) -> Section:
        """Return the section with other varied numbers."""
        numbers = self._numbers()
        for k, number in zip(self.varied, given, strict=True):
            numbers[k] = number
        return with_numbers(self.first, iter(numbers))

    def select(self) -> Selection:
        """Select the rows to solve; see `select_section`."""
        return select_section(self.first)


@dataclass(frozen=True, eq=False)
class Component:
    """Bodies that are solved together.

    Attributes:
        given: moving bodies of earlier components, touched by its joints and drivers.
        joints, points: names of the joints, and of the points whose motion is wanted.
        section: the same with numbered names.
    """

    bodies: tuple[str, ...]
    given: tuple[str, ...]
    joints: tuple[str, ...]
    points: tuple[str, ...]
    section: Section


def components(mechanism: Mechanism, frame: Frames) -> list[tuple[str, ...]]:
    """Return the bodies of each component, in the order of their solution.

    Raises:
        SolveError: couplers connect joints, or the rows cannot be matched with the unknowns.
    """
    if mechanism.couplers:
        raise SolveError(
            f"mechanism {mechanism.name!r}: couplers tie its components together; solve it as one"
        )
    formulation = Cartesian.of(mechanism, frame)
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


def describe_components(
    mechanism: Mechanism,
    parts: Sequence[tuple[str, ...]],
    points: Collection[str],
    bodies: Collection[str],
) -> list[Component]:
    """Return components, in a length unit near the size of the largest.

    Args:
        parts: the bodies of each, see `components`.
        points, bodies: names of those whose motion is wanted.
    """
    level = {name: k for k, names in enumerate(parts) for name in names}
    given: list[dict[str, None]] = [{} for _ in parts]

    def place(bodies: Sequence[str]) -> int:
        """Return the component of the body solved last; there the others are prescribed."""
        moving = [name for name in bodies if name in level]
        last = max(level[name] for name in moving)
        given[last] |= dict.fromkeys(name for name in moving if level[name] != last)
        return last

    joints: list[list[Joint]] = [[] for _ in parts]
    for joint in mechanism.joints:
        joints[place(joint.bodies)].append(joint)
    size = max(extent([point for each in own for point in each.points_on()]) for own in joints)
    whole = frames(mechanism)
    frame = whole.in_units(unit_near(size) if size > 0.0 else whole.unit)
    every = constraints(mechanism, frame, {})
    last = len(every) - len(mechanism.drivers)
    of_joint: dict[str, list[Constraint | Relation]] = {}
    for c in every[:last]:
        of_joint.setdefault(c.owner, []).append(c)
    drivers: list[dict[str, Constraint]] = [{} for _ in parts]
    for c in cast("list[Constraint]", every[last:]):  # native ones
        drivers[place((c.i, c.j))][c.owner] = c
    wanted: list[list[Point]] = [[] for _ in parts]
    points, bodies = {*points}, {*bodies}
    for point in mechanism.points:
        if point.name in points and point.body in level:
            wanted[level[point.body]].append(point)
    found = list[Component]()
    for k, names in enumerate(parts):
        others, held, ends = given[k], joints[k], wanted[k]
        own = {name: f"b{n}" for n, name in enumerate(names)}
        numbered = own | {name: f"g{n}" for n, name in enumerate(others)}
        moving = [mechanism.body(name) for name in names if name in bodies]
        section = Section(
            frame.unit,
            tuple(own.values()),
            tuple(numbered.values())[len(own) :],
            tuple(joint.type for joint in held),
            tuple(map(_settings, held)),
            tuple(
                renamed(
                    c, f"j{n}", numbered, [f"j{n}{x[len(c.owner) :]}" for x in coordinates_of(c)]
                )
                for n, joint in enumerate(held)
                for c in of_joint.get(joint.name, ())
            ),
            {
                name: cast("Constraint", renamed(c, f"d{n}", numbered, ()))
                for n, (name, c) in enumerate(drivers[k].items())
            },
            {f"p{n}": (own[p.body], *frame.end(p.body, p.position)) for n, p in enumerate(ends)},
            {
                own[body.name]: (*frame.end(body.name, body.origin), quat(body.euler_parameters))
                for body in moving
            },
        )
        joint_names = tuple(joint.name for joint in held)
        point_names = tuple(point.name for point in ends)
        found.append(Component(names, tuple(others), joint_names, point_names, section))
    return found


def _settings(joint: Joint) -> str:
    own = (each.name for each in fields(joint) if "kind" not in each.metadata)
    return repr([getattr(joint, name) for name in own if name not in ("name", "i", "j")])


def select_section(section: Section) -> Selection:
    """Select the rows of a section to solve, drivers first.

    Raises:
        SolveError: there are too few independent rows.
    """
    at_rest = {name: PrescribedBody() for name in section.given}
    formulation = section.formulation(at_rest, dict.fromkeys(section.drivers, Drive()))
    matrix, bodies, unknowns = jacobian(formulation), len(section.bodies), formulation.unknowns
    kept = independent_rows(matrix, len(section.drivers), formulation.conditions)
    if len(kept) < unknowns:
        raise SolveError(
            f"a component with the joints {', '.join(section.joints)} can"
            f" still move at the design position (rank {len(kept)} of {unknowns}):"
            " lock-up, dead centre or too few drivers; shift the design",
            FailureKind.LOCKED,
        )
    rows = len(matrix) - len(section.drivers)
    coordinates = COORDINATES * bodies
    found = FreedomAccount(bodies, coordinates, rows + bodies, unknowns, rows, rows, ())
    return selection_of(found, formulation, kept)
