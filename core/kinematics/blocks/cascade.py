"""A large mechanism solved component by component: one program for all components built alike.

Every component reads the motion of prescribed bodies from a table of all solved quantities (the
world) and adds its own; see `component_lanes` for the lanes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism, Vector
from ...trajectory import Array
from ..compiled.compiled_model import CLOSED, Model, compile_model
from ..compiled.request import (
    ACCEPT,
    EARLIER,
    FROM,
    LARGEST_SIGMA,
    RATE,
    RATE_T,
    SIGMA,
    TIME,
    Request,
)
from ..formulation.constraints import frames
from ..formulation.parameters import places
from ..structure.components import Component, Section, components, section
from ..structure.degrees_of_freedom import counted


@dataclass(frozen=True, eq=False)
class ComponentType:
    """Components of one structure: one model, and numbers for each.

    Attributes:
        members: numbers of the components.
        fixed: values of the slots `Plan.fixed`, the same in all lanes, at the design position,
            shape (members, fixed).
        base: first row of the first member in the world; each has `model.kept` rows.
    """

    model: Model
    members: tuple[int, ...]
    fixed: Array
    base: int

    @cached_property
    def column(self) -> Mapping[str, int]:
        """Return the columns of `fixed` with the tolerances, and with times and singular values at
        the poses before.
        """
        names = (*ACCEPT, EARLIER + TIME, *(FROM + name for name in (TIME, SIGMA, LARGEST_SIGMA)))
        return {name: list(self.model.plan.fixed).index(self.model.slots[name]) for name in names}

    def rows(self, name: str, member: int) -> range:
        """Return the rows of the world with a kept quantity of a member."""
        rows = self.model.rows[name]
        start = self.base + member * self.model.kept
        return range(start + rows.start, start + rows.stop)


class Cascade:
    """The components of a mechanism with their programs, ready to be solved along paths.

    Args:
        request: as for `compile_model`; accelerations are computed whatever its order, to predict
            from.
        parts: its components, if known already.

    Raises:
        SolveError: the mechanism has couplers, is not driven enough, or does not close at the
            design position.
    """

    def __init__(
        self, mechanism: Mechanism, request: Request, parts: Sequence[Component] | None = None
    ) -> None:
        self.mechanism, self.request = mechanism, request
        frame = frames(mechanism)
        self.parts = components(mechanism, frame) if parts is None else parts
        self.unit = max(part.extent for part in self.parts) or frame.unit
        metres = {name: frame.unit * origin for name, origin in frame.origins.items()}
        origins: dict[str, Vector] = {
            name: (origin.x, origin.y, origin.z) for name, origin in metres.items()
        }
        driven = {getattr(driver, "point", "") for driver in mechanism.drivers}
        self.points: list[list[str]] = [[] for _ in self.parts]
        self.part_of = {name: k for k, part in enumerate(self.parts) for name in part.bodies}
        for point in mechanism.points:
            if (
                point.name in request.points or point.name in driven
            ) and point.body in self.part_of:
                self.points[self.part_of[point.body]].append(point.name)
        sections = [self._section(k, part, origins) for k, part in enumerate(self.parts)]
        alike: dict[object, list[int]] = {}
        for k, each in enumerate(sections):
            alike.setdefault(each.signature, []).append(k)
        self.kinds: list[ComponentType] = []
        self.rows = 0
        for members in alike.values():
            kind = self._kind([sections[k] for k in members], members)
            self.kinds.append(kind)
            self.rows += len(members) * kind.model.kept
        self.place = {part: (kind, k) for kind in self.kinds for k, part in enumerate(kind.members)}

    @property
    def largest(self) -> int:
        """Unknowns of the largest component."""
        return max(kind.model.selection.account.moving_coordinates for kind in self.kinds)

    @cached_property
    def details(self) -> dict[str, Any]:
        """The cascade as the record of every solution shows it."""
        unknowns, rows, redundant, sizes = 0, 0, list[str](), dict[str, dict[str, int]]()
        for kind in self.kinds:
            account, like = kind.model.selection.account, self.parts[kind.members[0]].bodies[0]
            unknowns += account.moving_coordinates * len(kind.members)
            rows += account.rows * len(kind.members)
            for part in (self.parts[k] for k in kind.members):
                # as they are called in a section
                joints = {f"j{k}": joint.name for k, joint in enumerate(part.joints)}
                named = (name.partition(":") for name in account.redundant_rows)
                redundant += [f"{joints[owner]}{colon}{row}" for owner, colon, row in named]
            which = f"components like that of {like} ({len(kind.members)})"
            sizes |= {f"{name}, {which}": size for name, size in kind.model.sizes.items()}
        return {
            **counted(self.mechanism, unknowns, rows, redundant).details,
            "components": len(self.parts),
            "largest_component": self.largest,
            "program": sizes,
        }

    def _section(self, k: int, part: Component, origins: dict[str, Vector]) -> Section:
        points = [self.mechanism.point(name) for name in self.points[k]]
        wanted = [self.mechanism.body(name) for name in part.bodies if name in self.request.bodies]
        return section(part, self.unit, origins, points, wanted)

    def _kind(self, sections: Sequence[Section], members: Sequence[int]) -> ComponentType:
        first, values = sections[0], [places(each.mechanism) for each in sections]
        varied = tuple(
            place
            for place, value in values[0].items()
            if any(each[place] != value for each in values)
        )
        m, part = first.mechanism, self.parts[members[0]]
        request = Request(
            tuple(driver.name for driver in m.drivers),
            tuple(f"p{k}" for k in range(len(self.points[members[0]]))),
            tuple(f"b{k}" for k, name in enumerate(part.bodies) if name in self.request.bodies),
            compiled=self.request.compiled,
            last_iteration=self.request.last_iteration,
            state=True,
            varied=varied,
        )
        model = compile_model(m, request, first)
        numbers = np.array(
            [[x for place in varied for x in each[place]] for each in values]
        ).reshape(len(members), -1)
        lanes = model.standing(numbers.T)
        if np.isnan(lanes).any():
            worst = self.parts[members[int(np.isnan(lanes).any(axis=0).argmax())]]
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: the component of {', '.join(worst.bodies)}"
                f" does not close at the design position to {CLOSED:g} of its size; check points,"
                " axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        source, target = np.array(model.plan.carried).T
        lanes[target] = lanes[source]
        return ComponentType(
            model, tuple(members), np.ascontiguousarray(lanes[list(model.plan.fixed)].T), self.rows
        )

    def body_rows(self, name: str) -> list[int]:
        """Return the rows of the world with the motion of a body, in the order of `PRESCRIBED`."""
        kind, member = self.place[self.part_of[name]]
        k = self.parts[kind.members[member]].bodies.index(name)
        u, q, v, a = (kind.rows(label, member) for label in (f"u b{k}", f"q b{k}", RATE, RATE_T))
        return [*u, *q, *v[6 * k : 6 * k + 6], *a[6 * k : 6 * k + 6]]
