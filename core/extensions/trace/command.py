"""The command kincheck trace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase
from ...errors import KincheckError, refuse, unknown
from ...options import (
    json_file,
    option,
    options,
    positive,
)

if TYPE_CHECKING:
    from .curve import Curve, Event

LENGTH = 5.0
"""Default length in each direction: a few full turns of all bodies."""
WAYS = {1: "growing", -1: "falling"}


@options
class Trace(OfCase):
    """Follow a case's motion from its design position in both directions by arc length, and report
    its singular poses.

    A limit point is a lock-up: the driver's value reverses there while the motion continues. A
    branch point is a bifurcation: the joints allow several continuations there, and the curve goes
    straight on. Exit status: 0 the whole length was traced, or a closed curve; 1 the curve ends
    before; 2 the tool could not do its work.
    """

    about = "follow a motion past lock-ups; find limit and branch points"
    driver: str | None = option(
        "driver whose value follows from the motion; default: the swept driver",
        metavar="NAME",
    )
    length: float = option(
        "length in each direction [mechanism sizes and radians]; default %(default)s",
        positive,
        "L",
        default=LENGTH,
    )
    json: str | None = json_file("the curve")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...report.terminal import with_json
        from .curve import trace

        case = registry.case_of(self)
        drivers = [driver.name for driver in case.mechanism.drivers]
        driver = self.driver or (case.sweep.driver if case.sweep.driver in drivers else drivers[0])
        if driver not in drivers:
            raise KincheckError(unknown("driver", driver, drivers))
        refuse(self.unwritable())
        curves = [trace(case.mechanism, driver, length=self.length)]
        if not curves[0].closed:
            curves.append(trace(case.mechanism, driver, length=self.length, direction=-1))
        design = case.mechanism.design_value(driver)
        unit = "rad" if case.mechanism.driver(driver).turns else "m"
        with with_json(_facts(case.name, curves, design, unit), self.json) as console:
            for direction, curve in zip((1, -1), curves, strict=False):
                print(
                    *_lines(case.name, curve, direction, design, unit), sep="\n", file=console.file
                )
        return Status.DEVIATES if any(curve.message for curve in curves) else Status.WITHIN


def _lines(case: str, curve: Curve, direction: int, design: float, unit: str) -> list[str]:
    low, high = curve.values.min() + design, curve.values.max() + design
    end = (
        "back at the design position"
        if curve.closed
        else curve.message or "up to the requested length"
    )
    head = (
        f"{case}: {curve.driver} first {WAYS[direction]}: {len(curve.arc)} poses over the length"
        f" {abs(curve.arc[-1]):.6g}, {end}; {curve.driver} from {low:.9g} to {high:.9g} {unit}"
    )
    return [head] + [
        f"  {event.kind} at {curve.driver} = {event.value + design:.9f} {unit} (length"
        f" {event.arc:.6g}); at the nearest pose {event.singularity.words}"
        for event in curve.events
    ]


def _facts(case: str, curves: list[Curve], design: float, unit: str) -> dict[str, Any]:
    """Return all curves as plain data [m, rad]."""

    def event(each: Event) -> dict[str, Any]:
        place = {"kind": each.kind, "arc": each.arc, "value": each.value + design}
        return place | {
            "points": {name: x.tolist() for name, x in each.points.items()},
            "nearest_pose": each.singularity.facts,
        }

    found = [
        {
            "arc": curve.arc.tolist(),
            "values": (curve.values + design).tolist(),
            "smallest_singular_value": curve.sigma.tolist(),
            "points": {name: x.tolist() for name, x in curve.points.items()},
            "events": [event(each) for each in curve.events],
            "closed": curve.closed,
            "message": curve.message,
        }
        for curve in curves
    ]
    return {
        "schema": "kincheck-trace/1",
        "case": case,
        "driver": curves[0].driver,
        "unit": unit,
        "curves": found,
    }
