"""Commands on the motion of one case: kincheck explain, trace, assemblies and free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError, number_of, refuse, unknown
from ..options import (
    destination,
    json_file,
    number_with_unit,
    option,
    options,
    positive,
    verbosity,
    whole,
)
from .files import formats, keep_texts
from .registry import Registry, Status, names_of_given
from .shared_options import TOL, OfCase, driver_value

if TYPE_CHECKING:
    from rich.console import Console

    from ..kinematics import Curve, Event
    from ..studies.assemblies import Survey
    from ..studies.diagnosis import Diagnosis
    from ..studies.free import FreeResult


@options
class Explain(OfCase):
    """Diagnose a case: degrees of freedom, redundant and contradictory rows by name, conditioning
    along the sweep, resulting tolerances, sensitivity of the outputs to hardpoints, and the
    programs of the native engine.

    Exit status: 0 it can be solved, 1 it contradicts itself or is not determined, 2 the tool could
    not do its work.
    """

    about = "diagnose a case: freedom, conditioning, tolerances"
    samples: int = option(
        "number of samples of the sweep to examine; default %(default)s", whole(1), "N", default=41
    )
    tol: float = option(
        f"largest residual that engines may leave [m or -]; default {TOL:g}",
        positive,
        "X",
        default=TOL,
    )
    json: str | None = json_file("the diagnosis")
    quiet: bool = verbosity("print only the verdict, the findings and the notes")
    verbose: bool = verbosity("print all samples and sensitivities, instead of a few of each", "-v")

    def answer(self, registry: Registry) -> Diagnosis:
        """Diagnose a case: degrees of freedom, redundant rows, conditioning, and sensitivities of
        outputs [SI].

        Raises:
            KincheckError: there is no such case, or its file is invalid.
        """
        from ..studies.diagnosis import diagnose

        case = registry.case_of(self, driven=False)
        return diagnose(case, samples=self.samples, tol=self.tol)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..report.terminal import with_json
        from ..studies.diagnosis.text import print_diagnosis

        refuse(self.unwritable())
        found = self.answer(registry)
        how = {"quiet": self.quiet, "verbose": self.verbose}
        with with_json(found, self.json) as console:
            print_diagnosis(found, console, **how)
        return Status.DEVIATES if found.findings else Status.WITHIN


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
        from ..kinematics import trace
        from ..report.terminal import with_json

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


# Two assemblies meet where the smallest singular value is below this; regular linkages stay above
# 1e-2.
MEETING = 1e-6


@options
class ListAssemblies(OfCase):
    """List the assemblies found from random starts at a driver value, the intended assembly first.

    Exit status: 0 assemblies are found, 1 none is found, 2 the tool could not do its work.
    """

    about = "list assemblies of a mechanism, found from random starts"
    at: str | None = option(
        "value of the swept driver, such as 30mm or -20deg, in SI without a unit; default: the"
        " design position",
        number_with_unit,
        "VALUE",
    )
    samples: int = option(
        "number of random starts; default %(default)s", whole(1), "N", default=200
    )
    seed: int = option("seed of the random starts; default %(default)s", whole(0), "N", default=0)
    json: str | None = json_file("the assemblies with all poses")
    export: str | None = destination(
        f"write the mechanism, started in one of them: {formats()}", metavar="FORMAT"
    )
    number: int | None = destination(
        "number of the assembly to export; default 1, the first of the list", whole(1), "K"
    )
    out: Path | None = destination(
        "stem of the exported files; default: CASE.K in this folder", Path
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..report.terminal import with_json
        from ..studies.assemblies import survey, written

        if self.export is None and (found := names_of_given(self, ("number", "out"))):
            raise KincheckError(
                f"{found}: only an export uses it. Add --export FORMAT, or leave it out."
            )
        refuse(self.unwritable())
        if self.export is not None and self.export not in registry.writers:
            raise KincheckError(unknown("format", self.export, registry.writers))
        case = registry.case_of(self)
        found = survey(
            case,
            driver_value(self.at, case),
            samples=self.samples,
            seed=self.seed,
        )
        with with_json(found.report(), self.json) as console:
            _print(found, console)
            if self.export is not None:
                number: int = self.number or 1
                texts = written(found, registry.writer(self.export), number)
                keep_texts(texts, f"{case.name}.{number}", self.out, self.json)
        return Status.WITHIN if found.assemblies.found else Status.DEVIATES


def _print(found: Survey, console: Console) -> None:
    from ..report.terminal import columns

    listed = found.assemblies
    values = ", ".join(f"{name} = {value:.9g}" for name, value in found.drivers.items())
    count, starts = len(listed.found), listed.starts
    console.print(
        f"{found.case.name} at {values}: {count} assembl{'y' if count == 1 else 'ies'} from"
        f" {starts} starts (seed {found.seed})",
        soft_wrap=True,
    )
    telling = [
        name
        for name in (listed.found[0].signs if count else ())
        if len({a.signs[name] for a in listed.found}) > 1
    ]
    table = columns(
        ">#", "which", ">distance", ">starts", ">residual", ">smallest sv", "det", *telling
    )
    for index, each in enumerate(listed.found, 1):
        which = (
            "intended"
            if found.intended(each)
            else "meets another"
            if each.smallest < MEETING
            else "other"
        )
        signs = [_sign(each.orientation), *(_sign(each.signs[name]) for name in telling)]
        numbers = (
            f"{each.distance:.4g}",
            f"{each.starts}",
            f"{each.residual:.1e}",
            f"{each.smallest:.3g}",
        )
        table.add_row(f"{index}", which, *numbers, *signs)
    console.print(table)
    if found.reason:
        console.print(f"none is the intended assembly: {found.reason}", soft_wrap=True)
    console.print(
        f"distance: from {found.ranked_by}, rms over the bodies of turn [rad] and shift [mechanism"
        " sizes]; det, joints: signs of the determinant and of triple products, + as at design;"
        f" residual: of the mechanism's size. {listed.lost} starts did not close,"
        f" {listed.spurious} ended on spurious zeros.",
        soft_wrap=True,
    )
    missing = listed.missing or "There may be some"
    console.print(f"{missing}; raise --samples.", soft_wrap=True)


def _sign(value: int) -> str:
    return "-0+"[value + 1]


@options
class MoveFreely(OfCase):
    """Integrate the motion of a case without its drivers: its masses, loads and the rates of
    [free] alone move it from the design position.

    The error is the change when all steps are halved. Exit status: 0 the whole motion is
    integrated; 1 it ends before, at a change point; 2 the tool could not do its work.
    """

    about = "move a case without drivers, by its masses and loads, to round-off"
    duration: float | None = option(
        "of the motion [s]; default: of [free]", positive, "T", default=None
    )
    samples: int | None = option(
        "number of samples, both ends included; default: of [free]",
        whole(2),
        "N",
        default=None,
    )
    rates: Mapping[str, float] | None = field(default=None)
    csv: Path | None = destination("write time and outputs as columns, SI units", Path)
    json: str | None = json_file("outputs and errors")

    def answer(self, registry: Registry) -> FreeResult:
        """Integrate the motion of a case without its drivers.

        Args `rates`: at the start, by driver or joint [m/s or rad/s]; default: those of [free].

        Raises:
            KincheckError: duration or samples are missing, or the mechanism has no free motion.
        """
        from ..case.case import Free
        from ..studies.free import free_of

        case = registry.case_of(self, driven=False)
        given = case.free
        duration = self.duration or (given and given.duration)
        samples = self.samples or (given and given.samples)
        if not duration or not samples:
            raise KincheckError(
                f"{case.name if self.case is case else self.case}: says no duration and samples of"
                " its free motion. Add [free] with duration and samples, or give --duration and"
                " --samples."
            )
        rates: Mapping[str, float] = given.rates if given else {}
        rates = rates if self.rates is None else self.rates
        if not isinstance(rates, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise KincheckError(f"rates: found {rates!r}, expected {{DRIVER or JOINT: rate}}")
        return free_of(replace(case, free=Free(duration, samples, rates)))

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.io.atomic_files import write
        from ..report.progress import complain
        from ..report.terminal import with_json

        refuse(self.unwritable())
        found = self.answer(registry)
        if self.csv:
            write("--csv", self.csv, found.write_csv)
        complain([*found.notes, *filter(None, [found.message])])
        with with_json(found.facts, self.json) as console:
            print(
                f"{found.case}: {len(found.times)} samples to {found.times[-1]:.9g} s,"
                f" {number_of(found.freedoms, 'degree of freedom', 'degrees of freedom')},"
                f" {number_of(found.redundant, 'redundant row')}, {found.method}",
                f"  change when all steps are halved: {found.error:.1e} m,"
                f" {found.turning_error:.1e} rad",
                f"  change of energy less work: {found.energy_error:.1e} J; largest gap:"
                f" {found.gap:.1e} of the mechanism's size",
                sep="\n",
                file=console.file,
            )
        return Status.DEVIATES if found.message else Status.WITHIN
