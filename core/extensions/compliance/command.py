"""kincheck kc: kinematics and compliance of a suspension on its bushings."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.reader_options import Supplied
from ...cli import shared_options
from ...cli.forms import contents_of_forms, with_forms
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL, Isolated
from ...errors import KincheckError, labelled, refuse
from ...options import (
    argument,
    destination,
    group,
    joint_types,
    option,
    options,
    several,
    with_values,
)
from ..hardpoints.options import HARDPOINTS

if TYPE_CHECKING:
    from ...case.case import Case
    from ...case.units import Unit
    from ...harness.engine import Engine
    from ...harness.record import Record, Results
    from .results import ComplianceResults

MOST, UNLESS_GIVEN = 100_000, "25"
_Formed: Any = with_forms()


@dataclass(frozen=True)
class FromDesign(Supplied):
    """Options of the readers; the travel counts from design, of any file."""

    travel: str | None = option(
        "travel of the wheel from design, or of the steering with --axle steer: up and down,"
        " default 60mm:25, as in kincheck run, or START:STOP:SAMPLES, positive up:"
        " --travel=-40:60mm:21. In metres without a unit",
        metavar="LENGTH[:N]|A:B:N",
        heading=HARDPOINTS,
    )


@options
class MeasureCompliance(Isolated, _Formed):  # pyright: ignore[reportUntypedBaseClass]
    """Find the equilibria of a suspension with springs, bushings and loads, and their compliance.

    Joints with bushings give way to them. --axle heave, roll or steer moves both wheels of an axle.

    Exit status: 0 all samples have an equilibrium, and all engines agree; 1 an engine deviates or
    ends in an error; 2 a sample has no equilibrium, and its message gives the last load that has
    one, or the tool could not do its work.
    """

    about = "kinematics and compliance: equilibria on bushings over travel and loads"
    LAST = (*Isolated.LAST, *_Formed.LAST)
    case: str = argument(
        "name of a built-in case, or path to a case file or a hardpoint table", "CASE"
    )
    load: tuple[str, ...] = option(
        "curve over a load at design, as lateral=-3000:3000:31 [N, N m]: longitudinal, lateral,"
        " braking or aligning, 25 samples unless given. One number is a load that acts over all"
        " travel. May be repeated",
        metavar="NAME=A:B:N",
        several="repeated",
    )
    bushings: Path | None = option(
        "bushings of the joints, in SI: TOML, for a table of hardpoints by role,"
        " [bushings.ROLE], as kincheck templates NAME --bushings prints, else tables"
        " [joints.NAME.bushings.X] as in case files",
        Path,
        "FILE",
    )
    spring: tuple[str, ...] = option(
        "spring between two points of the case, by the name of its motion ratio without _ratio or"
        " by the table's own, as Feder of Feder unten and Feder oben, of an axle on both sides:"
        ' --spring "spring: 35 N/mm", with its force at design'
        ' "spring: 35 N/mm, 3 kN". "tire: 200 N/mm" is under the wheel, for the ride rate. May be'
        " repeated",
        metavar='"NAME: RATE"',
        several="repeated",
    )
    engine: tuple[str, ...] = option(
        "check the equilibria by these engines: each finds them by its own kinematics, gravity"
        " and rows, exudyn-static by its own solver, and gets a verdict against native",
        metavar="NAME",
        several="together",
    )
    history: Path | None = destination(
        "store the records of native and of these engines in this file, as kincheck run does", Path
    )
    csv: Path | None = destination("write the curves, in mm, deg, N, kN", Path)
    json: str | None = destination("write the results in SI, - for standard output")
    out: Path | None = destination("write the page DIR/kc.html, and results.json", Path, "DIR")
    joint_type: tuple[str, ...] = joint_types()
    supplied: FromDesign = group(default_factory=FromDesign)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write, write_all
        from ...harness.engine import STANDARD
        from ...harness.record import to_json
        from ...report.progress import complain, missing_requirements
        from ...report.table import print_table
        from ...report.terminal import with_json
        from ..hardpoints.design import FARTHEST, travel_samples
        from ..hardpoints.reader import is_table
        from . import study, views
        from .page import page, report
        from .springs import springs_in, with_springs

        problems = shared_options.contradictions(self)
        engines = self._engines(registry, problems)
        refuse(problems or shared_options.unreachable(self))
        typed, axle = self.supplied.travel, self.supplied.axle
        table = os.path.isfile(self.case) and is_table(Path(self.case), self.supplied)
        travel = study.DEFAULT_TRAVEL
        if typed is not None:
            # the steering of a case file may turn, in rad
            farthest = math.inf if axle == study.AxleMotion.STEER and not table else FARTHEST
            file, count = Path(self.case), len(travel)
            travel = travel_samples(file, typed, count, still=True, farthest=farthest)
        springs = springs_in(self.spring)
        # the sweep of a table's case; one sample is none
        swept = table and typed is not None and travel[0] != travel[-1]
        supplied = replace(
            self.supplied,
            travel=f"{travel[0]}:{travel[-1]}:{len(travel)}" if swept else None,
            axle=axle if table else None,
            bushings=self.bushings if table else None,
        )
        case = registry.case_of(with_values(self, supplied=supplied), driven=False)
        if self.bushings is not None and not table:
            from ..hardpoints.rubber import with_bushings

            case = with_bushings(case, self.bushings)
        case = with_springs(case, springs)
        refuse(self.unwritable("kc.html", *(["results.json"] if engines else [])))
        loads = dict(map(_load, self.load))
        results = study.compliance(case, travel, loads, axle or study.AxleMotion.HEAVE)
        if self.csv is not None:
            write("--csv", self.csv, views.table(results).encode())
        if engines:
            results = replace(
                results, checked=self._check_engines(engines, results.cases, problems)
            )
        checked = results.checked
        if self.out is not None:
            if checked is not None:
                write("--out", self.out / "results.json", to_json(checked))
            write("--out", self.out / "kc.html", page(results).encode())
        problems += write_all(contents_of_forms(self, report(results)))
        with with_json(views.as_data(results), self.json) as console:
            print(*views.lines(results), sep="\n", file=console.file)
            if checked is not None:
                print_table(checked, console.file, reactions=True)
            every = results.travel, *results.loads.values()
            notes = (*case.assembly, *(note for each in every for note in each.notes))
            complain(labelled(note) for note in dict.fromkeys(notes))
        named = [each.name for each in engines if each.name != STANDARD]
        problems += views.failures(results)
        problems += missing_requirements(checked, (), named) if checked else []
        refuse(problems)
        return Status.of(checked) if checked is not None else Status.WITHIN

    def _engines(self, registry: Registry, problems: list[str]) -> list[Engine]:
        """Return native and the named engines; none if nothing is to be checked or stored."""
        found = registry.find_engines(self.engine, problems)
        if not (self.engine or self.history):
            return []
        native = registry.baseline(found)
        return [native, *found] if native is not None else found

    def _check_engines(
        self,
        engines: Sequence[Engine],
        cases: Sequence[Case],
        problems: list[str],
    ) -> Results:
        """Return the records of the engines, stored in the history if there is one."""
        from ...harness import run as running
        from ...history.runs import keep
        from ...history.store import HistoryError

        solver, settings = shared_options.solver(self, engines)
        keeping = None
        if self.history is not None:
            settings["selection"] = {
                "cases": [each.name for each in cases],
                "engines": [each.name for each in engines],
                "options": {},
            }
            try:
                keeping = keep(
                    self.history,
                    cases,
                    engines,
                    tol=TOL,
                    command=self.command,
                    settings=settings,
                    resume=False,
                )
            except HistoryError as error:
                from ...cli.destinations import not_in_history

                problems.append(not_in_history(self, error))

        def add(record: Record, done: int, total: int) -> None:
            if keeping is not None:
                keeping.add(record)

        facts = keeping.facts if keeping is not None else settings
        results = running.run(
            cases, engines, tol=TOL, progress=add, command=self.command, solver=solver, facts=facts
        )
        if keeping is not None:
            keeping.end(results, interrupted=False)
            problems += keeping.problems + keeping.store.damage
        return results


def _load(text: str) -> tuple[str, Any]:
    from ...case.units import FORCES, Unit

    name, _, values = text.partition("=")
    if not values:
        raise KincheckError(f"--load {text}: expected NAME=A:B:N, as lateral=-3000:3000:31")
    units = FORCES
    if name == "aligning":
        units = {
            f"{force}m": Unit(f"{force}m", unit.size, unit.convert)
            for force, unit in FORCES.items()
        }
    found = _values(f"--load {name}", values, units)
    return name, found if ":" in values else found[0]


def _values(option: str, text: str, units: Mapping[str, Unit]) -> list[float]:
    """Return the samples A:B:N, or one number, in SI."""
    from ...case.io.document import interval

    parts = text.split(":")
    bare, other = [*units][:2]
    try:
        ends, _ = interval(parts[:2], units, bare)
    except ValueError:
        ends = [math.nan]
    count = parts[2] if len(parts) == 3 else "1" if ends[0] == ends[-1] else UNLESS_GIVEN
    if not all(map(math.isfinite, ends)) or not count.isdecimal() or not 1 <= int(count) <= MOST:
        raise KincheckError(
            f"{option} {text}: expected START:STOP:SAMPLES or START:STOP, numbers in"
            f" {' or '.join(units)}, {bare} without a unit, and 1 to {MOST} samples. Write"
            f" -60{other}:60{other}:25"
        )
    start, stop, steps = ends[0], ends[-1], max(1, int(count) - 1)
    return [0.0 + start + (stop - start) * (k / steps) for k in range(int(count))]


def compliance(
    case: str | Path | Case,
    travel: Sequence[float] | None = None,
    loads: Mapping[str, float | Sequence[float]] | None = None,
    axle: str = "heave",
    *,
    springs: Mapping[str, float | tuple[float, float]] | None = None,
    engines: str | Engine | Sequence[str | Engine] = (),
    jobs: int | None = None,
) -> ComplianceResults:
    """Return the kinematics and compliance of a suspension, as the command `kincheck kc` does.

    Args:
        case: name, path or case.
        travel: of the wheel from design [m], by default 60 mm up and down; of the steering if
            `axle` is "steer".
        loads: values by load, "lateral", "longitudinal", "braking" or "aligning" [N, N m], each
            applied at design; one number acts over all travel.
        axle: motion of both wheels: "heave", "roll" or "steer".
        springs: rate [N/m], or rate and force at design [N/m, N], by the name of a motion ratio
            without "_ratio", such as "spring"; "tire" is under the wheel.
        engines: names or engines that find the equilibria by themselves; `checked` has their
            records, judged against native.
        jobs: number of worker processes, as of `run`.

    Raises:
        KincheckError: the case lacks facts, or a sample has no equilibrium; the message gives the
            last load with one.
    """
    from ...cli.main import function, registry
    from ...cli.run import Run
    from . import study
    from .springs import with_springs

    one = with_springs(registry().find_case(case, driven=False), springs or {})
    found = study.compliance(one, travel, loads, axle)
    if found.failures:
        raise KincheckError("\n".join(found.failures))
    if not (team := several(engines)):
        return found
    run = function("run", Run)
    return replace(found, checked=run(found.cases, ("native", *team), jobs=jobs))
