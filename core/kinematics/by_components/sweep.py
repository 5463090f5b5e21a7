"""Sweep a cascade: outwards from the design position, many samples as lanes, on from the last one
accepted by every component.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...failures import FailureKind
from ...mechanism.motions import Path, outwards
from ...program import ITERATIONS
from ...trajectory import QUANTITIES, Array, Trajectory, largest_found
from ..compiled.compiled_model import CLOSED
from ..compiled.motion_start import Start, solve_from_start, start_of
from ..compiled.request import SIGMA, accept_by
from ..compiled.solution import Columns, solution
from ..continuation.singularity import CONTINUED, listed
from .block_solver import Cascade
from .component_lanes import WORST, Lanes
from .component_walk import LANES, ComponentWalk, Indices, Keep
from .singular_crossing import cross

BODY = ("r", "p", "rdot", "omega", "rddot", "omega_t")
STILL = 0.0, 0.0, 0.0


@dataclass
class Outputs:
    """Columns of the table of samples, and the rows of the world that go there."""

    columns: list[int] = field(default_factory=list[int])
    rows: list[int] = field(default_factory=list[int])


class CascadeSweep:
    """A path through a cascade; solved as often as wanted."""

    def __init__(self, cascade: Cascade, path: Path, start: Start | None = None) -> None:
        self.cascade, self.path = cascade, path
        self.start = start or start_of(cascade.mechanism, path)
        self._lanes = Lanes(cascade, LANES)
        self._columns = Columns.of(cascade.request)
        self._outputs, self._still = self._places()

    def _places(self) -> tuple[Outputs, dict[int, float]]:
        """Return the columns of moving outputs with their rows of the world, and the numbers of
        outputs at rest by column.
        """
        cascade, request = self.cascade, self.cascade.request
        moving, still = Outputs(), dict[int, float]()

        def add(vector: str, part: int | None, own: str, at_rest: Sequence[float]) -> None:
            columns = self._columns.by_vector[vector]
            here = range(columns.start, columns.stop)
            if part is None:
                still.update(zip(here, at_rest, strict=True))
                return
            kind, member = cascade.place[part]
            moving.columns += here
            moving.rows += kind.rows(own, member)

        for name in request.points:
            point = cascade.mechanism.point(name)
            part = cascade.part_of.get(point.body)
            own = "" if part is None else f"p{cascade.points[part].index(name)}"
            at_rest = {"position": point.position}
            for label in QUANTITIES[: request.order + 1]:
                add(f"{label} {name}", part, f"{label} {own}", at_rest.get(label, STILL))
        for name in request.bodies:
            body = cascade.mechanism.body(name)
            part = cascade.part_of.get(name)
            own = "" if part is None else f"b{cascade.parts[part].bodies.index(name)}"
            at_rest = {"r": body.origin, "p": body.euler_parameters}
            for label in BODY[: 2 * (request.order + 1)]:
                add(f"{label} {name}", part, f"{label} {own}", at_rest.get(label, STILL))
        return moving, still

    def solve(self, tol: float) -> Trajectory:
        """The motion at all samples; see `solve`."""

        def by(start: Start) -> Trajectory:
            return (
                self if start is self.start else CascadeSweep(self.cascade, self.path, start)
            )._solve(tol)

        return solve_from_start(
            self.start, self.cascade.mechanism, self.path, by, compare=np.isfinite(tol)
        )

    def _solve(self, tol: float) -> Trajectory:
        path, lanes = self.path, self._lanes
        n = len(path.times)
        columns, rows = np.array(self._outputs.columns, np.intp), self._outputs.rows
        table = np.full((self._columns.count, n), np.nan)
        worst = np.full((len(WORST), n), np.nan)
        departure, message, notes, failures = self._departure
        self._notes, self._failures = [*notes], [*failures]
        messages = [message] if message else []
        for order, given in self._sides if not messages else ():

            def keep(samples: Indices, order: Indices = order) -> None:
                at = order[samples]
                table[columns[:, None], at] = lanes.world[rows][:, : len(at)]
                worst[:, at] = lanes.worst[:, : len(at)]

            lanes.anchor = departure
            lanes.accept_by(accept_by(tol))
            message = self._follow(path.times[order], given, self.start.time, path, keep, tol)
            messages += [message] if message else []
        return self._trajectory(table, dict(zip(WORST, worst, strict=True)), messages)

    @cached_property
    def _sides(self) -> list[tuple[Indices, list[Array]]]:
        """The samples of each side of the start, outwards, and their inputs."""
        times = self.path.times
        return [
            (side, self._lanes.sampled(times[side], self.path))
            for side in outwards(times, self.start.time)
        ]

    @cached_property
    def _departure(self) -> tuple[list[Array], str, Sequence[str], Sequence[FailureKind]]:
        """The start of the sweep: the lanes there, the message if it cannot be reached, notes and
        failures of the way.
        """
        lanes, path, begin, message = self._lanes, self.path, self.start, ""
        lanes.accept_by(accept_by(CLOSED))
        self._notes, self._failures = list[str](), list[FailureKind]()
        if way := begin.lead:
            times = np.array([0.0, 1.0])
            message = self._follow(times, lanes.sampled(times, way), 0.0, way, _nothing, CLOSED)
            message = f"on the way to {begin.name}: {message}" if message else ""
        lanes.stand_at(begin.time)
        # the rates of the path where the mechanism stands
        lanes.attempt(np.array([begin.time]), path)
        lanes.carry(0)
        return lanes.anchor, message, tuple(self._notes), tuple(self._failures)

    def _follow(
        self, times: Array, given: Sequence[Array], here: float, path: Path, keep: Keep, tol: float
    ) -> str:
        """Follow the samples outwards, over singular poses too; return the message of the end, or
        an empty text.
        """
        lanes, left, refused = self._lanes, np.arange(len(times)), list[int]()

        def walk(samples: Indices, time: float) -> ComponentWalk:
            return ComponentWalk(lanes, samples, times, given, path, keep, time=time, tol=tol)

        while len(left):
            ahead = walk(left, here)
            count, failure = ahead.run()
            left = left[count:]
            if failure is None:
                break
            at = int(left[0])
            wanted, last = float(times[at]), float(times[at - 1]) if at else None
            message = path.ended(ahead.time, wanted, last, str(failure))
            beyond = (
                None
                if failure.kind is FailureKind.TOO_MANY_PARTS
                else cross(lanes, path, ahead.sound, ahead.start, ahead.time, wanted, tol)
            )
            if beyond is None:
                self._failures.append(failure.kind)
                return message
            self._notes.append(
                f"crosses a singular pose near {path.where(ahead.time)}; {CONTINUED}"
            )
            beside = left[np.abs(times[left] - ahead.time) <= abs(beyond - ahead.time)]
            here, anchor, left = beyond, lanes.anchor, left[len(beside) :]
            reached, _ = walk(beside[::-1], here).run()
            refused += beside[: len(beside) - reached].tolist()
            lanes.anchor = anchor
        if refused:
            self._failures.append(FailureKind.UNCERTAIN)
            places = listed([path.where(float(times[k])) for k in refused])
            return (
                f"refused at {places}: so near a singular pose that neither side reaches it; keep"
                " away from it"
            )
        return ""

    def _trajectory(self, table: Array, tests: dict[str, Array], messages: list[str]) -> Trajectory:
        solved = ~np.isnan(tests["closure"])
        for column, value in self._still.items():
            table[column, solved] = value
        closure, leftover, sigma = (
            largest_found(each[solved])
            for each in (tests["closure"], tests["leftover"], -tests[SIGMA])
        )
        return solution(
            table.T,
            self._columns.points,
            self._columns.bodies,
            unit=self.cascade.unit,
            solved=solved,
            iterations=tests[ITERATIONS],
            closure=closure,
            leftover=leftover,
            message="; ".join(messages),
            failures=self._failures,
            account=self.cascade.details,
            findings={
                "smallest_singular_value": min(-sigma, 1.0),
                **({"notes": self._notes} if self._notes else {}),
            },
        )


def _nothing(samples: Indices) -> None:
    """Keep none of the samples."""
