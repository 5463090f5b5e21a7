"""Kinematics and compliance (K&C) of a suspension: equilibria over travel, and over loads.

At each travel the wheel's height is held, and the rest is in equilibrium with springs, bushings,
weight and loads. The 6 x 6 matrix C gives displacement (3) and turn (3) of the carrier at the
contact, global axes, by force (3) and torque (3) there; of an axle it is 12 x 12, left wheel first.
Slopes of outputs by a load follow from C's motions as slopes by travel do from velocities.

Sources: the numbering and the factors are those of Adams/Car, Output of Suspension Analyses
(adams.thisaray.com/adams_car/turn.html), and of MotionView, Suspension Design Factors
(help.altair.com/hwdesktop/hwx/topics/motionview/suspension_design_factors_r.htm).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...case.case import HELD_BUT, TIME, Balance, Case, Sweep, Truth
from ...case.measures import DriverEffort, ForceMeasure
from ...case.quantity import (
    ORDERS,
    Output,
    Quantity,
    known_at,
    point_jets,
    still_jets,
    with_markers,
)
from ...errors import KincheckError, SolveError
from ...jet import Jet
from ...kinematics import solve
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Motion, Ramp
from ...trajectory import Array, PointMotion
from ..hardpoints.design import AxleMotion
from ..hardpoints.suspension import PerTravel
from ..statics.equilibrium import Equilibria, StaticModel
from .rates import SIDES, Curve, wheel_rates
from .released import released
from .results import COMPLIANCE, LOAD, WHEEL_LOAD, ComplianceCurves, ComplianceResults
from .rig import CONTACT, PER, Wheel, held_drivers, wheels_of
from .section import Load, rig_of
from .springs import how_to_add

# Engines agree on equilibria to round-off of their positions, which stiffness turns into forces.
WITHIN, SAME_LOAD, ROUND_OFF = 1e-12, 1e-9, 1e-15
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
GOAL = "engines differ by round-off"
DEFAULT_TRAVEL = np.linspace(-0.06, 0.06, 25)
NO_VALUE = "it has no value at any of these samples, by its definition"
OF_A_WHEEL = {"wheel_rate", "wheel_rate_opposite"}
SMALL_LOAD, SMALL_TRAVEL = 1e-9, 1e-3
"""A wheel load of less is round-off [N], and travels are seldom shorter [m]."""


def compliance(
    case: Case,
    travel: Array | Sequence[float] | None = None,
    loads: Mapping[str, float | Sequence[float] | Array] | None = None,
    axle: str = AxleMotion.HEAVE,
) -> ComplianceResults:
    """Return the kinematics and compliance of a suspension.

    Joints with bushings give way to them. Drivers of [compliance] `held` keep their values, by
    default all.

    Args:
        travel: of the wheel, or of the steering if `axle` is "steer" [m or rad], from design; by
            default 60 mm up and down.
        loads: values by load, "lateral", "longitudinal", "braking" or "aligning" [N, N m], each
            applied at design; one number is applied over all travel.
        axle: motion of both wheels, if the case has two: "heave", "roll" or "steer".

    Returns:
        The curves; samples without an equilibrium are NaN, and `failures` has the last reachable
        loads.

    Raises:
        KincheckError: the case does not tell wheel, contact or height, or a load is unknown.
        SolveError: a body is free, or there is no equilibrium at rest.
    """
    study = _Study(case, AxleMotion(axle))
    given = DEFAULT_TRAVEL if travel is None else np.asarray(travel, dtype=np.float64)
    for name in loads or {}:
        if name not in list(Load):
            raise KincheckError(f"load {name!r} is none of {', '.join(Load)}. Give one of these")
    every = {Load(name): np.asarray(values, float) for name, values in (loads or {}).items()}
    always = {load: values for load, values in every.items() if not values.ndim}
    over_travel = study.over_travel(given, always)
    curves = {load: study.over_load(load, values) for load, values in every.items() if values.ndim}
    cases = [study.case_of("travel", given, always, over_travel)]
    cases += [study.case_of(x, curve.at, {x: curve.at}, curve) for x, curve in curves.items()]
    return ComplianceResults(case.name, over_travel, curves, study.signs, tuple(cases))


def _load_text(load: Load, value: float) -> str:
    return f"{load} {value:.6g} {'N m' if load is Load.ALIGNING else 'N'}"


class _Study:
    def __init__(self, case: Case, axle: AxleMotion) -> None:
        self.case, self.axle, self.rig = case, axle, rig_of(case)
        soft = released(case.mechanism)
        held = held_drivers(case, self.rig, soft)
        self.wheels = wheels_of(case, held, soft)
        if len(self.wheels) == 1 and axle is not AxleMotion.HEAVE:
            raise KincheckError(
                f"{case.name}: --axle {axle} needs both wheels of an axle, and the case has one."
                " Add [suspension.other], or leave the option out"
            )
        self.steering = _steering(case, held, self.wheels) if axle is AxleMotion.STEER else ""
        self.mechanism: Mechanism = replace(
            soft, drivers=[driver for driver in soft.drivers if driver.name in held]
        )
        self.lacking, self.without_rate = lacking(case, self.mechanism), False
        self.computed = [x for x in case.outputs if x.name not in self.lacking]
        self.model = StaticModel(
            self.mechanism,
            [point for wheel in self.wheels for point in wheel.points],
            {name for output in self.computed for name in output.forces},
        )

    @property
    def gives_way(self) -> bool:
        """Whether anything moves under a load while the held drivers stand still."""
        return self.model.equations.unknowns > len(self.model.equations.chosen)

    @property
    def _stiffest(self) -> float:
        """The largest stiffness [N/m]."""
        return max((x for each in self.mechanism.forces for x in _stiffnesses(each)), default=0.0)

    @property
    def signs(self) -> str:
        """The convention of signs, in words."""
        vehicle = self.wheels[0].vehicle
        return "global axes of the case" if vehicle is None else vehicle.signs

    @property
    def _other(self) -> float:
        """The sense of the other wheel's travel and loads."""
        return -1.0 if self.axle is AxleMotion.ROLL else 1.0

    def _travels(self, values: Array) -> dict[str, Array]:
        if self.steering:
            return {self.steering: values}
        signs = (1.0, self._other)
        return {w.travel: s * w.lift * values for w, s in zip(self.wheels, signs, strict=False)}

    def over_travel(self, values: Array, loads: Mapping[Load, Array]) -> ComplianceCurves:
        """Return the curves over travel, with constant loads."""
        constant = {load: np.full(len(values), float(x)) for load, x in loads.items()}
        found = self.model.solve(self._loads(constant, len(values)), self._travels(values))
        what = self.steering or "travel"
        unit = "m"
        if self.steering and self.mechanism.driver(self.steering).turns:
            unit = "rad"

        def sample_text(x: float, share: float) -> str:
            under = [_load_text(load, share * float(value)) for load, value in loads.items()]
            return " with ".join([f"{what} {share * x:.6g} {unit}", *under])

        curves = self._curves("travel", values, found, sample_text)
        return replace(
            curves,
            rigid=self._rigid(values),
            turning=unit == "rad",
            upward=not self.steering,
        )

    def case_of(
        self, axis: str, at: Array, loads: Mapping[Load, Array], found: ComplianceCurves
    ) -> Case:
        """Return the equilibria of these samples as a case for engines.

        Its outputs are the wheels' centres and loads, and those of the case that are poses.
        """
        n = len(at)
        given = self._loads({load: np.broadcast_to(x, (n,)) for load, x in loads.items()}, n)
        places = tuple(point for wheel in self.wheels for point in wheel.points)
        largest = max(np.nanmax(np.abs([found.wheel_load, *(x[:, 2] for x in given.values())])), 0)
        outputs: list[Quantity] = []
        for wheel in self.wheels:
            outputs += [
                Output(
                    f"{wheel.name}wheel_center_{name}", wheel.point, axis, False, WITHIN, 0.0, GOAL
                )
                for name, axis in AXES.items()
            ]
            if WHEEL_LOAD in found.not_computed:
                continue
            load = SAME_LOAD * float(largest) + ROUND_OFF * self._stiffest
            effort = DriverEffort(f"{wheel.name}wheel_load", load, 0.0, GOAL, driver=wheel.travel)
            outputs.append(effort.bound(self.mechanism))
        known = [x for x in self.case.outputs if not x.forces and x.orders == ORDERS]
        sweep = Sweep(TIME, np.arange(n, dtype=np.float64), 0.0)
        if axis == "travel":
            (first, values), *others = self._travels(at).items()
            sweep = Sweep(first, values, 0.0, motions=self._along(others))
        return replace(
            self.case,
            name=f"{self.case.name} over {axis}",
            truth=Truth.CONSENSUS_ONLY,
            mechanism=with_markers(self.mechanism, outputs),
            sweep=sweep,
            outputs=tuple(outputs + known),
            reference={},
            balance=Balance(places, given),
        )

    def _along(self, others: Iterable[tuple[str, Array]]) -> dict[str, Motion]:
        """Return the motions of the other wheel's driver as the first wheel's moves at rate one."""
        lift = self.wheels[0].lift
        return {
            name: Ramp(lift * wheel.lift * self._other)
            for wheel, (name, _) in zip(self.wheels[1:], others, strict=False)
        }

    def over_load(self, load: Load, values: Array) -> ComplianceCurves:
        """Return the curves over a load at design."""
        found = self.model.solve(self._loads({load: values}, len(values)), {})
        return self._curves(load, values, found, lambda x, share: _load_text(load, share * x))

    def _loads(self, loads: Mapping[Load, Array], n: int) -> dict[str, Array]:
        found = {point.name: np.zeros((n, 6)) for wheel in self.wheels for point in wheel.points}
        for load, values in loads.items():
            for wheel, sign in zip(self.wheels, (1.0, self._other), strict=False):
                place, unit = wheel.unit(load)
                found[place] += sign * values[:, None] * unit
        return found

    def _curves(
        self, axis: str, at: Array, found: Equilibria, what: Callable[[float, float], str]
    ) -> ComplianceCurves:
        wheel, lost = self.wheels[0], ~found.reached
        rates, contact = self._rates(found), self._at_contact(found)
        outputs, own = self._outputs(found), {**rates, **contact}
        taken = {*own, WHEEL_LOAD}
        if any(x.name == WHEEL_LOAD and isinstance(x, DriverEffort) for x in self.computed):
            taken.remove(WHEEL_LOAD)
        if twice := sorted(outputs.keys() & taken):
            raise KincheckError(
                f"{self.case.name}: output {twice[0]!r} has the name of a result of kincheck kc."
                " Give it another name"
            )
        outputs |= own
        load = wheel.lift * found.efforts[wheel.travel]
        reason = "no spring resists the wheel, so that it has no meaning. " + how_to_add(self.case)
        idle = dict.fromkeys(self._unloaded(axis, at, load, rates), reason)
        outputs = {name: each for name, each in outputs.items() if name not in idle}
        if not self.gives_way:  # what the solver leaves is round-off
            still = {x for x in outputs if x.endswith((*PER.values(),))} | {*contact}
            outputs |= {x: replace(outputs[x], values=0.0 * at) for x in still}
        # a force or a quotient may have no value at all
        none = {
            name: NO_VALUE
            for name, each in outputs.items()
            if found.reached.any() and not np.isfinite(each.values[found.reached]).any()
        }
        shared = {
            x.name: f"joint {x.read!r}: {reason}"
            for x in self.computed
            if isinstance(x, ForceMeasure)
            and (reason := self._placed(x, found).undetermined(found.forces))
        }
        not_computed = {**self.lacking, **none, **shared, **idle}

        def blank(values: Array) -> Array:
            return _blank_rows(values, lost)

        failures = [
            f"no equilibrium at {what(float(at[k]), 1.0)}: the last is at"
            f" {what(float(at[k]), float(found.share[k]))}, where the path turns back"
            " (snap-through) or meets another one"
            for k in np.flatnonzero(lost)
        ]
        unstable = [
            f"the equilibrium at {what(float(x), 1.0)} is unstable: {way}"
            for x, way, ok in zip(at, found.unstable, found.reached, strict=True)
            if way and ok
        ]
        notes = [f"{unstable[0]} ({len(unstable)} samples in all)"] if unstable else []
        if not self.mechanism.forces:
            notes.append(
                "nothing is elastic: there is no bushing and no spring, so nothing gives way to a"
                f" load. {how_to_add(self.case)}, and --bushings FILE, or"
                " [joints.NAME.bushings.X]"
            )
        elif not self.case.mechanism.forces and not self.without_rate:
            notes.append(
                "wheel load and wheel rate are those of the bushings alone, as there is no spring."
                f" {how_to_add(self.case)}"
            )
        if self.model.equations.dropped:
            notes.append(
                f"{len(self.model.equations.dropped)} redundant rows are left out: displacements"
                " are unique, and what these rows share of the reactions is not"
            )
        return ComplianceCurves(
            axis,
            at,
            blank(found.place(wheel.body, wheel.center)),
            blank(found.direction(wheel.body, wheel.spin)),
            blank(load * np.nan if WHEEL_LOAD in idle else load),
            blank(self._matrix(found) * float(self.gives_way)),
            {name: replace(x, values=blank(x.values)) for name, x in outputs.items()},
            {},
            not_computed,
            found.reached,
            tuple(failures),
            tuple(notes),
            rigid_joints=not self.gives_way,
        )

    def _matrix(self, found: Equilibria) -> Array:
        """Return C at the contacts, shape (n, 6 wheels, 6 wheels)."""
        return np.concatenate(
            [
                np.concatenate(
                    [
                        found.motion(
                            found.by_load[f"{loaded.name}{CONTACT}"][0], seen.body, seen.contact
                        )
                        for seen in self.wheels
                    ],
                    axis=1,
                )
                for loaded in self.wheels
            ],
            axis=2,
        )

    def _at_contact(self, found: Equilibria) -> dict[str, Curve]:
        """Return the compliance of each wheel at the contact along its force, which acts on all."""
        curves = dict[str, Curve]()
        signed = [*zip(self.wheels, (1.0, self._other), strict=False)]
        for load, k in ((Load.LATERAL, 1), (Load.LONGITUDINAL, 0)):
            step: Any = sum(
                sign * (found.by_load[f"{each.name}{CONTACT}"][0][:, :, :3] @ each.axes[k])
                for each, sign in signed
            )
            sense = f"displacement of the contact along a {load} force at it"
            for each, sign in signed:
                moved = found.motion(step, each.body, each.contact)[:, :3] @ (sign * each.axes[k])
                curves[f"{each.name}{load}_{COMPLIANCE}"] = Curve(moved, "m/N", sense)
        return curves

    def _unloaded(
        self, axis: str, at: Array, load: Array, rates: Mapping[str, Curve]
    ) -> tuple[str, ...]:
        """Return the names of wheel load and rates that have no meaning: no spring resists."""
        far = max(SMALL_TRAVEL, float(np.abs(at).max()) if axis == "travel" else 0.0)
        small = SMALL_LOAD + WITHIN * self._stiffest * far
        without_load = bool(np.abs(load).max() <= small)
        if axis == "travel":
            rate = max(float(np.abs(rates[name].values).max()) for name in OF_A_WHEEL & {*rates})
            idle = without_load and rate <= small / far
            self.without_rate = idle or not self.mechanism.forces
        loads = [name for name in rates if name.startswith(WHEEL_LOAD)]
        others = [name for name in rates if name not in loads]
        return (*others * self.without_rate, *(WHEEL_LOAD, *loads) * without_load)

    def _step(self, found: Equilibria, load: Load) -> Array:
        """Return the motion of the unknowns by a unit of a load on all wheels."""
        total = 0.0
        for wheel, sign in zip(self.wheels, (1.0, self._other), strict=False):
            place, unit = wheel.unit(load)
            total = total + sign * (found.by_load[place][0] @ unit)
        return np.asarray(total)

    def _outputs(self, found: Equilibria) -> dict[str, Curve]:
        by_travel = sum(
            (
                sign * wheel.lift * found.by_driver[wheel.travel][0]
                for wheel, sign in zip(self.wheels, (1.0, self._other), strict=False)
            ),
            np.zeros(()),
        )
        by_load = {load: self._step(found, load) for load in self.rig.loads}
        curves = dict[str, Curve]()
        for output in self.computed:
            if isinstance(output, ForceMeasure):
                values = self._placed(output, found).values(found.forces)
                curves[output.name] = Curve(values, output.unit, output.sense)
                continue
            alone = [found.by_driver[name][0] for name in output.facts.get(HELD_BUT, ())]
            step = sum(alone, np.zeros(())) if alone else by_travel
            value = self._value(output, found, np.asarray(step))
            curves[output.name] = Curve(value.x, output.unit, output.sense)
            if isinstance(output, PerTravel) or output.orders < ORDERS:
                continue
            for load, step in by_load.items():
                per = "N m" if load is Load.ALIGNING else "N"
                slope = self._value(output, found, step).v
                unit = f"{output.unit}/{f'({per})' if ' ' in per else per}"
                sense = f"{output.sense}, per unit of {load} load".removeprefix(", ")
                curves[f"{output.name}{PER[load]}"] = Curve(slope, unit, sense)
        return curves

    def _placed(self, output: ForceMeasure, found: Equilibria) -> ForceMeasure:
        """Return a force with the axes and points that it follows."""
        if output.follows_points:
            places = {
                name: found.place(point.body, point.position)
                for name in output.points
                for point in (self.mechanism.point(name),)
            }
            return output.with_points(
                {name: point_jets(PointMotion(x, None, None)) for name, x in places.items()}
            )
        return output

    def _value(self, output: Quantity, found: Equilibria, step: Array) -> Jet:
        """Return an output, with its slope by a motion of the unknowns in place of its rate."""

        def at(name: str) -> tuple[Array, Array]:
            point = self.mechanism.point(name)
            moved = found.motion(step, point.body, point.position)
            return found.place(point.body, point.position), moved

        return self._output(output, at, len(found.share))

    def _output(self, output: Quantity, at: Callable[[str], tuple[Array, Array]], n: int) -> Jet:
        """Return an output of n samples by places of points and their rates, shape (n, 3)."""
        moving = {name: point_jets(PointMotion(*at(name), None)) for name in output.points}
        design = {name: still_jets(self.mechanism.point(name).position) for name in output.points}
        with np.errstate(all="ignore"):  # NaN marks unknown values
            jet = known_at(output, moving, design)
        x, v, a = (np.broadcast_to(np.asarray(x, float), (n,)) for x in (jet.x, jet.v, jet.a))
        return Jet(x, v, a)

    def _rates(self, found: Equilibria) -> dict[str, Curve]:
        """Return wheel rates, roll stiffness and, of an axle, both wheels' loads."""
        wheels, order = self.wheels, list(self.model.drivers)
        lifts = np.array([wheel.lift for wheel in wheels])
        own = [order.index(wheel.travel) for wheel in wheels]
        by = [found.by_driver[wheel.travel][1][:, own] for wheel in wheels]
        matrix = lifts[:, None] * np.stack(by, axis=-1) * lifts
        across = wheels[0].axes[1]
        if len(wheels) == 2:
            track = abs(float(across @ np.subtract(wheels[0].center, wheels[1].center)))
        else:
            middle = (0.0, 0.0, 0.0) if wheels[0].vehicle is None else wheels[0].vehicle.middle
            track = 2.0 * abs(float(across @ np.subtract(wheels[0].center, middle)))
        rates = wheel_rates(matrix, track, self._other, self.rig.tire_stiffness)
        for side, wheel in zip(SIDES, wheels, strict=False) if len(wheels) == 2 else ():
            load = wheel.lift * found.efforts[wheel.travel]
            rates[f"{WHEEL_LOAD}_{side}"] = Curve(load, "N", LOAD)
        return rates

    def _rigid(self, values: Array) -> dict[str, Array]:
        """Return the outputs of the mechanism with its joints; none if it cannot move so."""
        mechanism = self.case.mechanism
        travels = self._travels(values)
        (driver, given), *others = travels.items()
        try:
            moved = solve(
                mechanism,
                driver,
                given + mechanism.design_value(driver),
                order=1,
                motions=self._along(others),
            )
        except SolveError:  # it has other freedoms, and no rigid curve to compare with
            return {}

        def at(name: str) -> tuple[Array, Array]:
            motion = moved.points[name]
            rate = motion.velocity if motion.velocity is not None else motion.position * np.nan
            return motion.position, rate

        return {
            output.name: np.where(moved.solved, self._output(output, at, len(values)).x, np.nan)
            for output in self.computed
            if not output.forces and self._along_sweep(output, travels)
        }

    def _along_sweep(self, output: Quantity, travels: Mapping[str, Array]) -> bool:
        """Return whether the rates along the sweep are those of an output's own drivers."""
        alone = {*output.facts.get(HELD_BUT, ())}
        return not alone or (alone == {*travels} and self._other > 0.0)


def lacking(case: Case, soft: Mechanism) -> dict[str, str]:
    """Return why equilibria do not have an output, by its name; `soft` holds the held drivers."""
    found = dict[str, str]()
    held = {driver.name for driver in soft.drivers}
    drivers = {driver.name for driver in case.mechanism.drivers}
    known = {each.name for each in (*soft.given_joints, *soft.forces)} | held
    for output in case.outputs:
        read = {*output.forces} - known
        if isinstance(output, PerTravel) and output.of_output.orders < ORDERS:
            found[output.name] = "a slope of a slope, which kincheck run has for rigid joints"
        elif isinstance(output, DriverEffort) and output.at is not None:
            found[output.name] = (
                "an effort at another joint follows the motion of rigid joints. kincheck run has it"
            )
        elif {*output.facts.get(HELD_BUT, ())} - held or read & drivers:
            found[output.name] = "its driver is free here. Name it in [compliance] held"
        elif read:
            (name, *_) = read
            found[output.name] = (
                f"joint {name!r} gives way to its bushings. Give them as [forces.NAME], and ask for"
                " their element_force"
            )
    return found


def _stiffnesses(each: Any) -> Sequence[float]:
    return np.atleast_1d(getattr(each, "stiffness", 0.0)).tolist()


def _steering(case: Case, held: Sequence[str], wheels: Sequence[Wheel]) -> str:
    lifting = {wheel.travel for wheel in wheels}
    others = [name for name in held if name not in lifting]
    if not others:
        raise KincheckError(
            f"{case.name}: --axle steer needs a held driver of the steering, and all held drivers"
            " lift wheels. Add one to the case"
        )
    return case.sweep.driver if case.sweep.driver in others else others[0]


def _blank_rows(values: Array, lost: NDArray[np.bool_]) -> Array:
    found = np.array(values, dtype=np.float64)
    found[lost] = np.nan
    return found
