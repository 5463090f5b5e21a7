"""A case with a closed form, and engines that answer it rightly or wrongly on purpose."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from kincheck import (
    Body,
    Case,
    JointAngle,
    Mechanism,
    Point,
    PointMotion,
    Revolute,
    Trajectory,
    adapters,
)
from kincheck.core.case.case import Output, Series, Sweep, Truth
from kincheck.core.harness.run import run

RADIUS = 0.5
SAMPLES = 9


def exact(case):
    """A crank's tip: position, velocity and acceleration, each (n, 3), by its closed form."""
    angle, rate = case.sweep.change, case.sweep.rate
    e = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    t = np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], axis=1)
    return RADIUS * e, RADIUS * rate * t, -RADIUS * rate**2 * e


def crank(name="crank", *, truth=Truth.CLOSED_FORM, reference=True, rate=2.0, atol=1e-9):
    """A crank of 0.5 m turned from -1 to 1 rad; outputs x (relative to the design) and y."""
    mechanism = Mechanism(
        name,
        [Body("arm")],
        [Revolute("pivot", "ground", "arm", point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))],
        [Point("tip", "arm", (RADIUS, 0.0, 0.0))],
        [JointAngle("angle", "pivot")],
    )
    outputs = (
        Output("x", "tip", (1.0, 0.0, 0.0), True, atol, 0.0, "test"),
        Output("y", "tip", (0.0, 1.0, 0.0), False, atol, 0.0, "test"),
    )
    sweep = Sweep("angle", np.linspace(-1.0, 1.0, SAMPLES), rate)
    case = Case(name, "made up", truth, mechanism, sweep, outputs)
    if not reference:
        return case
    p, v, a = exact(case)
    return replace(
        case,
        reference={
            "x": Series(p[:, 0] - RADIUS, v[:, 0], a[:, 0]),
            "y": Series(p[:, 1].copy(), v[:, 1], a[:, 1]),
        },
    )


def swept(case, values):
    """The case with other samples, of which it has no reference."""
    return replace(case, sweep=replace(case.sweep, values=np.array(values)), reference={})


def solution(case, *, solved=None, message="", **changed):
    """The exact trajectory; changed: position, velocity or acceleration to be used instead."""
    p, v, a = (
        changed.get(name, right)
        for name, right in zip(("position", "velocity", "acceleration"), exact(case), strict=True)
    )
    solved = np.ones(len(case.sweep.values), dtype=bool) if solved is None else solved
    details = {"rank": np.int64(6), "dof": 1, "condition": np.float64(0.1), "pivots": np.arange(3)}
    return Trajectory(
        {"tip": PointMotion(p, v, a)}, solved, np.full(len(solved), 3), 1e-15, message, details
    )


@dataclass
class Fake:
    """An engine whose answer is given by a function of the case."""

    name: str = "fake"
    answer: Any = solution
    installed: str | None = "1.2"
    refusal: str | None = None
    mode: str = "projection"
    loop: str = "python"
    settings: dict = field(default_factory=dict)
    solves: int = 0
    untimed: bool = False

    @property
    def in_process(self):
        """As the native engine, for which a fake of that name stands in."""
        return self.name == "native"

    bounds_error = in_process

    def version(self):
        return self.installed

    def unsupported(self, case):
        return self.refusal

    def build(self, case):
        return "model"

    def solve(self, model, case, tol):
        assert model == "model"
        self.solves += 1
        return self.answer(case)


def run_case(case, *engines, **options):
    """Return the results of a case in these engines, by default to 1e-12."""
    return run([case], engines, **{"tol": 1e-12, **options})


def record_of(engine, case=None, **options):
    """Return the one record of a case in an engine, by default of the crank."""
    (record,) = run_case(case or crank(), engine, **options).records
    return record


def native_but(change, name="native"):
    """An engine whose answer is the native one, changed by a function of it and the case."""
    native = adapters.engine("native")
    return Fake(name, lambda case: change(native.solve(native.build(case), case, 1e-12), case))


def raising(error):
    """An answer that raises."""

    def answer(case):
        raise error

    return answer


def off(quantity, change):
    """An answer that is right but for one quantity, changed by a function of its (n, 3) values."""

    def answer(case):
        right = dict(zip(("position", "velocity", "acceleration"), exact(case), strict=True))[
            quantity
        ]
        return solution(case, **{quantity: change(right.copy())})

    return answer


def at(sample, axis, value):
    """A change that puts a value at one sample."""

    def change(values):
        values[sample, axis] = value
        return values

    return change


def partial(case):
    """The last two samples are out of reach."""
    solved = np.arange(SAMPLES) < SAMPLES - 2
    p, v, a = (np.where(solved[:, None], each, np.nan) for each in exact(case))
    return solution(
        case,
        solved=solved,
        message="cannot be followed beyond 0.5",
        position=p,
        velocity=v,
        acceleration=a,
    )


def calls(monkeypatch, owner, name):
    """The arguments of all calls from now on."""
    every, call = [], getattr(owner, name)
    monkeypatch.setattr(
        owner, name, lambda *given, **named: (every.append(given), call(*given, **named))[1]
    )
    return every
