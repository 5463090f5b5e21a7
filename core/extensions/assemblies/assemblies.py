"""Assemblies of a case at a value of its sweep, and consistent starts in any of
them for simulators.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from ...case.case import Case
from ...errors import KincheckError, SolveError
from ...joints import AxialJoint
from ...trajectory import BodyMotion
from ..exports.model_writer import LARGEST_TURN, TOL, Writer, way_to
from .assembly_modes import Assemblies, Assembly, find_assemblies

SCHEMA = "kincheck-assemblies/1"
# Farther from the intended assembly than this [rad, mechanism sizes] is another one.
INTENDED = 1e-9


class Found(msgspec.Struct, frozen=True):
    """An assembly in a results file; see `assembly_modes.Assembly`. bodies: r [m] and p by name."""

    number: int
    intended: bool
    distance: float
    starts: int
    residual: float
    smallest_singular_value: float
    orientation: int
    signs: dict[str, int]
    bodies: dict[str, dict[str, list[float]]]


class Report(msgspec.Struct, frozen=True):
    """Assemblies of a case as a file.

    Attributes:
        drivers: values [m or rad].
        ranked_by: origin of the distances.
        found_once: number of assemblies to which one start only led.
        estimated: how many there are at the least (Chao 1984).
        unlisted: share of starts, of those that close, to other assemblies (Good 1953).
    """

    schema: str
    case: str
    drivers: dict[str, float]
    ranked_by: str
    starts: int
    seed: int
    lost: int
    spurious: int
    found_once: int
    estimated: float
    unlisted: float
    assemblies: list[Found]


@dataclass(frozen=True, eq=False)
class Survey:
    """The assemblies of a case, with the intended one.

    Attributes:
        drivers: their values at the assemblies, as in the sweep [m or rad].
        way: motion of the bodies from the design to the intended assembly; None if
            there is none.
        reason: why the drive does not lead from the design to these values.
    """

    case: Case
    drivers: Mapping[str, float]
    assemblies: Assemblies
    way: Mapping[str, BodyMotion] | None
    reason: str
    seed: int

    @property
    def ranked_by(self) -> str:
        """The origin of the distances."""
        return (
            "the intended assembly, where the motion leads from the design"
            if self.way
            else "the design"
        )

    def intended(self, one: Assembly) -> bool:
        """Return whether the drive leads from the design to this assembly."""
        return self.way is not None and one.distance <= INTENDED

    def report(self) -> Report:
        """Return the survey as a file's content."""
        found = [
            Found(
                number,
                self.intended(each),
                each.distance,
                each.starts,
                each.residual,
                each.smallest,
                each.orientation,
                dict(each.signs),
                {name: {"r": r.tolist(), "p": p.tolist()} for name, (r, p) in each.poses.items()},
            )
            for number, each in enumerate(self.assemblies.found, 1)
        ]
        every = self.assemblies
        counts = every.starts, self.seed, every.lost, every.spurious, every.once
        more = every.estimated, every.unlisted
        drivers = dict(self.drivers)
        return Report(SCHEMA, self.case.name, drivers, self.ranked_by, *counts, *more, found)


def survey(case: Case, at: float | None = None, *, samples: int, seed: int) -> Survey:
    """Find assemblies of a case at a value of its sweep; by default the value at design.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the design does not close, or the
            value is not finite.
    """
    mechanism, value = case.mechanism, case.sweep.design if at is None else at
    if not math.isfinite(value):
        raise SolveError(
            f"case {case.name!r}: the value {value} is not finite. Give a value of"
            f" {case.sweep.driver!r}."
        )
    there = replace(case.sweep, values=np.array([value]))
    names = tuple(there.path.motions)
    change = there.path.drive(names, there.path.times)[0, :, 0].tolist()
    way_to(case, case.sweep.design)  # a design that does not close is an error of its own
    try:
        way, reason = way_to(case, value), ""
    except SolveError as error:
        way, reason = None, str(error)
    estimate = {name: (motion.r[-1], motion.p[-1]) for name, motion in way.items()} if way else {}
    moved = dict(zip(names, change, strict=True))
    found = find_assemblies(
        mechanism, estimate, moved, samples=samples, seed=seed, spread=None, tol=TOL
    )
    held = {driver.name: 0.0 for driver in mechanism.drivers}
    return Survey(
        case,
        held | {name: float(v[0]) for name, v in there.moved.items()},
        found,
        way,
        reason,
        seed,
    )


def written(found: Survey, write: Writer, number: int) -> Mapping[str, str]:
    """Return the case's mechanism in a writer's format, starting in one of its assemblies.

    Raises:
        KincheckError: there is no such assembly, or the format cannot express something.
    """
    case, count = found.case, len(found.assemblies.found)
    if not 1 <= number <= count:
        raise KincheckError(
            f"case {case.name!r}: there is no assembly {number}; {count} were found: give 1 to"
            f" {count}, or --samples"
        )
    chosen = found.assemblies.found[number - 1]
    if found.way is not None and found.intended(chosen):
        return write(case.mechanism, found.way, found.drivers)
    related = [coupler.name for coupler in case.mechanism.couplers]
    related += [
        each.name
        for each in case.mechanism.joints
        if isinstance(each, AxialJoint) and each.relations
    ]
    # their coordinates count whole turns; poses do not show these, and no motion leads there
    if related:
        raise KincheckError(
            f"case {case.name!r}: assembly {number} cannot be exported:"
            f" {', '.join(map(repr, related))} relates turns, and how many whole turns lead there"
            " is not known; the intended assembly can be"
        )
    return write(case.mechanism, _straight(case, chosen), found.drivers)


def _straight(case: Case, chosen: Assembly) -> dict[str, BodyMotion]:
    """Return a motion from the design to an assembly, each body turning about one axis, loops open.

    Writers read the joints' turns from it, so only its end has to close.
    """
    steps = math.ceil(math.pi / LARGEST_TURN)
    part = np.linspace(0.0, 1.0, steps + 1)[:, None]
    found: dict[str, BodyMotion] = {}
    for body in case.mechanism.moving:
        r, p = chosen.poses[body.name]
        start = np.array(body.euler_parameters)
        end = p if p @ start >= 0.0 else -p  # the short way round
        angle = 2.0 * math.asin(min(1.0, 0.5 * float(np.linalg.norm(end - start))))
        if angle > 0.0:
            turned = (np.sin((1.0 - part) * angle) * start + np.sin(part * angle) * end) / math.sin(
                angle
            )
        else:
            turned = np.repeat(start[None], steps + 1, axis=0)
        turned[-1] = end
        found[body.name] = BodyMotion(
            np.array(body.origin) + part * (r - np.array(body.origin)), turned, None, None
        )
        found[body.name].r[-1] = r
    return found
