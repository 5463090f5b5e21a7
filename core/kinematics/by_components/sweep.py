"""Sweep a cascade: outwards from the design position, many samples as lanes, on from the last one
accepted by every component.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ...failures import FailureKind
from ...mechanism.motions import Path, outwards
from ...program import ITERATIONS
from ...trajectory import QUANTITIES, Array, BodyMotion, PointMotion, Trajectory, largest_found
from ..compiled.compiled_model import CLOSED
from ..compiled.motion_start import Start, solve_from_start, start_of
from ..compiled.request import SIGMA, accept_by
from ..continuation.singularity import CONTINUED, listed
from .block_solver import Cascade
from .component_lanes import WORST, Lanes
from .component_walk import LANES, ComponentWalk, Indices, Keep
from .singular_crossing import cross

BODY = ("r", "p", "rdot", "omega", "rddot", "omega_t")
STILL = 0.0, 0.0, 0.0


class CascadeSweep:
    """A path through a cascade; solved as often as wanted."""

    def __init__(self, cascade: Cascade, path: Path, start: Start | None = None) -> None:
        self.cascade, self.path = cascade, path
        self.start = start or start_of(cascade.mechanism, path)
        self._lanes = Lanes(cascade, LANES)
        self._outputs, self._still = self._places()

    def _places(self) -> tuple[dict[str, list[int]], dict[str, Sequence[float]]]:
        """Return the rows of the world for each wanted motion by name, and the motions at rest."""
        cascade, m = self.cascade, self.cascade.mechanism
        found, still = dict[str, list[int]](), dict[str, Sequence[float]]()
        for name in cascade.request.points:
            point = m.point(name)
            if point.body not in cascade.part_of:
                still |= {f"{label} {name}": STILL for label in QUANTITIES} | {
                    f"position {name}": point.position
                }
                continue
            kind, member = cascade.place[cascade.part_of[point.body]]
            own = f"p{cascade.points[cascade.part_of[point.body]].index(name)}"
            found |= {
                f"{label} {name}": [*kind.rows(f"{label} {own}", member)] for label in QUANTITIES
            }
        for name in cascade.request.bodies:
            if name not in cascade.part_of:
                body = m.body(name)
                still |= {f"{label} {name}": STILL for label in BODY}
                still |= {f"r {name}": body.origin, f"p {name}": body.euler_parameters}
                continue
            kind, member = cascade.place[cascade.part_of[name]]
            own = f"b{cascade.parts[kind.members[member]].bodies.index(name)}"
            found |= {f"{label} {name}": [*kind.rows(f"{label} {own}", member)] for label in BODY}
        return found, still

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
        rows = [row for each in self._outputs.values() for row in each]
        table, worst = np.full((len(rows), n), np.nan), np.full((len(WORST), n), np.nan)
        departure, message, notes, failures = self._departure
        self._notes, self._failures = [*notes], [*failures]
        messages = [message] if message else []
        for order, given in self._sides if not messages else ():

            def keep(samples: Indices, order: Indices = order) -> None:
                at = order[samples]
                table[:, at] = lanes.world[rows][:, : len(at)]
                worst[:, at] = lanes.worst[:, : len(at)]

            lanes.anchor = departure
            lanes.accept_by(accept_by(tol))
            message = self._follow(path.times[order], given, self.start.time, path, keep, tol)
            messages += [message] if message else []
        found, at = dict[str, Array](), 0
        for name, each in self._outputs.items():
            found[name] = table[at : at + len(each)].T
            at += len(each)
        return self._trajectory(found, dict(zip(WORST, worst, strict=True)), messages)

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

    def _trajectory(
        self, found: dict[str, Array], tests: dict[str, Array], messages: list[str]
    ) -> Trajectory:
        request, solved = self.cascade.request, ~np.isnan(tests["closure"])
        order, unit = request.order + 1, self.cascade.unit
        found |= {
            name: np.where(solved[:, None], value, np.nan) for name, value in self._still.items()
        }

        def motion(name: str) -> PointMotion:
            series = [found[f"{label} {name}"] for label in QUANTITIES[:order]]
            return PointMotion(*series, *[None] * (3 - len(series)))

        def body(name: str) -> BodyMotion:
            v, a = (
                np.hstack([found[f"{label} {name}"] for label in pair])
                for pair in (("rdot", "omega"), ("rddot", "omega_t"))
            )
            return BodyMotion(
                found[f"r {name}"],
                found[f"p {name}"],
                v if order > 1 else None,
                a if order > 2 else None,
            )

        return Trajectory(
            points={name: motion(name) for name in request.points},
            solved=solved,
            iterations=np.where(solved, tests[ITERATIONS], 0.0).astype(np.int64),
            residual=largest_found(tests["closure"][solved]) * unit,
            message="; ".join(messages),
            details={
                **self.cascade.details,
                "redundant_residual": largest_found(tests["leftover"][solved]) * unit,
                "smallest_singular_value": min(-largest_found(-tests[SIGMA][solved]), 1.0),
            }
            | ({"notes": self._notes} if self._notes else {}),
            bodies={name: body(name) for name in request.bodies},
            failures=self._failures,
        )


def _nothing(samples: Indices) -> None:
    """Keep none of the samples."""
