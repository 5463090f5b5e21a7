"""Sweep a cascade: outwards from the design position, many samples as lanes, on from the last one
that every component accepts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...mechanism.motions import Path, outwards
from ...program import ITERATIONS
from ...trajectory import QUANTITIES, Array, BodyMotion, PointMotion, Trajectory, largest_found
from ..compiled.compiled_model import CLOSED
from ..compiled.motion_start import Start, solve_from_start, start_of
from ..compiled.request import SIGMA, accept_by
from ..continuation.singularity import CONTINUED, listed
from ..continuation.step_halving import MOST_PARTS, TOO_MANY, part_of_step
from .block_solver import Cascade
from .component_lanes import WORST, Lanes
from .singular_crossing import cross

# Samples at once: all are predicted from one pose, and the farther they are from it the more
# iterations they take, and the more are tried in vain; and what a large chain takes its time for is
# memory: with 24 one of 200 loops takes up to 1.6 times as long. With 8 one of 16 loops takes 1.3
# times as long.
LANES = 16
BODY = ("r", "p", "rdot", "omega", "rddot", "omega_t")
STILL = 0.0, 0.0, 0.0


Indices = NDArray[np.intp]
Keep = Callable[[Indices], None]
"""Takes samples, by their number outwards, from as many lanes."""


@dataclass(frozen=True, eq=False)
class Halt:
    """Where samples were followed to.

    Attributes:
        count: how many of them.
        here: the time that the lanes are predicted from.
        sound, start: what they were predicted from where all was sound, and its time.
        reason: why they were not followed on, where it is not that no part of a step was accepted.
    """

    count: int
    here: float
    sound: Sequence[Array]
    start: float
    reason: str = ""


class CascadeSweep:
    """A path through a cascade; solved as often as wanted."""

    def __init__(self, cascade: Cascade, path: Path, start: Start | None = None) -> None:
        self.cascade, self.path = cascade, path
        self.start = start or start_of(cascade.mechanism, path)
        self._lanes = Lanes(cascade, LANES)
        self._outputs, self._still = self._places()

    def _places(self) -> tuple[dict[str, list[int]], dict[str, Sequence[float]]]:
        """Rows of the world of everything wanted, by name; and what of it stands still."""
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
        departure, message, notes = self._departure
        self._notes = [*notes]
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
        """Of each side of the start the samples outwards, and what is given there."""
        times = self.path.times
        return [
            (side, self._lanes.sampled(times[side], self.path))
            for side in outwards(times, self.start.time)
        ]

    @cached_property
    def _departure(self) -> tuple[list[Array], str, Sequence[str]]:
        """Where the sweep starts: what is predicted from, why it cannot be reached if it cannot,
        and notes of the way.
        """
        lanes, path, begin, message = self._lanes, self.path, self.start, ""
        lanes.accept_by(accept_by(CLOSED))
        self._notes = list[str]()
        if way := begin.lead:
            times = np.array([0.0, 1.0])
            message = self._follow(times, lanes.sampled(times, way), 0.0, way, _nothing, CLOSED)
            message = f"on the way to {begin.name}: {message}" if message else ""
        lanes.stand_at(begin.time)
        # the rates of the path where the mechanism stands
        lanes.attempt(np.array([begin.time]), path)
        lanes.carry(0)
        return lanes.anchor, message, tuple(self._notes)

    def _follow(
        self, times: Array, given: Sequence[Array], here: float, path: Path, keep: Keep, tol: float
    ) -> str:
        """Follow the samples outwards, with what is given there, over singular poses too; empty, or
        why they end.
        """
        lanes, left, refused = self._lanes, np.arange(len(times)), list[int]()
        while len(left):
            halt = self._along(left, times, given, here, path, keep)
            left = left[halt.count :]
            if not len(left):
                break
            at = int(left[0])
            wanted, last = float(times[at]), float(times[at - 1]) if at else None
            message = path.ended(halt.here, wanted, last, halt.reason or self._why_ended(tol))
            beyond = (
                None
                if halt.reason
                else cross(lanes, path, halt.sound, halt.start, halt.here, wanted, tol)
            )
            if beyond is None:
                return message
            self._notes.append(f"crosses a singular pose near {path.where(halt.here)}; {CONTINUED}")
            beside = left[np.abs(times[left] - halt.here) <= abs(beyond - halt.here)]
            here, anchor, left = beyond, lanes.anchor, left[len(beside) :]
            back = self._along(beside[::-1], times, given, here, path, keep)
            refused += beside[: len(beside) - back.count].tolist()
            lanes.anchor = anchor
        if refused:
            places = listed([path.where(float(times[k])) for k in refused])
            return (
                f"refused at {places}: so near a singular pose that neither side reaches it; keep"
                " away from it"
            )
        return ""

    def _along(
        self,
        samples: Indices,
        times: Array,
        given: Sequence[Array],
        here: float,
        path: Path,
        keep: Keep,
    ) -> Halt:
        """Follow samples in their order, in parts of steps where need be, to the last or to where
        no part is accepted.
        """
        lanes, at, parts = self._lanes, 0, 0
        sound, start = lanes.anchor, here
        while at < len(samples):
            ahead = samples[at : at + LANES]
            good = lanes.attempt_at([each[:, ahead] for each in given]) > 0.0
            accepted = len(ahead) if good.all() else int(good.argmin())
            if accepted:
                keep(ahead[:accepted])
                if accepted == len(ahead):
                    lanes.go_on()
                else:
                    lanes.carry(accepted - 1)
                here, at, parts = float(times[ahead[accepted - 1]]), at + accepted, 0
                continue
            if lanes.sound:
                sound, start = lanes.anchor, here
            if parts == MOST_PARTS:
                return Halt(at, here, sound, start, TOO_MANY)
            reached = part_of_step(
                here, float(times[samples[at]]), lambda parts: lanes.attempt(parts, path), LANES
            )
            if reached is None:
                break
            lane, here = reached
            lanes.carry(lane)
            parts += 1
        return Halt(at, here, sound, start)

    def _why_ended(self, tol: float) -> str:
        """Which component could not be solved at the shortest part of a step, and how singular it
        is.
        """
        lane = self._lanes.last
        closure, sigma = (self._lanes.each(name)[:, lane] for name in ("closure", SIGMA))
        closes = bool((closure <= tol).all())
        worst = int(np.nanargmin(sigma) if closes else np.nan_to_num(closure, nan=np.inf).argmax())
        order = [part for kind in self.cascade.kinds for part in kind.members]
        bodies = ", ".join(self.cascade.parts[order[worst]].bodies)
        what = (
            "is the nearest to singular"
            if closes
            else f"is left with residual {closure[worst]:.3g} of its size"
        )
        told = (
            f"smallest singular value there about {sigma[worst]:.3g} (zero at a lock-up or dead"
            " centre)"
        )
        return f"the component of {bodies} {what}; {told}"

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
        )


def _nothing(samples: Indices) -> None:
    """Keep none of the samples."""
