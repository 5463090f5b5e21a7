"""Time of equilibria and of compliance matrices of a suspension, many samples together."""

from __future__ import annotations

import numpy as np

from ....case.case import Case
from ....case.measures import DriverEffort
from ...compliance.rig import CONTACT
from ...compliance.study import compliance
from ...statics.equilibrium import StaticModel
from .rounds import Spread, Work, take_turns

TRAVEL, LATERAL = 0.04, 2000.0
"""Ends of the grid: of the wheels' travel [m], and of the lateral force at each contact [N]."""
TRAVELS, FORCES, LANES = 128, 16, 256

SCHEMA = "kincheck-bench-compliance/1"


def measure(case: Case, rounds: int) -> dict[str, object]:
    """Return times per sample and per matrix [us].

    Every sample walks from design. A matrix has derivatives by six loads at each contact and each
    centre, and by the travel of each wheel.
    """
    asked = compliance(case, [0.0]).cases[0]
    assert asked.balance is not None
    model = StaticModel(asked.mechanism, asked.balance.places)
    travel = np.tile(np.linspace(-TRAVEL, TRAVEL, TRAVELS), FORCES)
    force = np.repeat(np.linspace(-LATERAL, LATERAL, FORCES), TRAVELS)
    zero = np.zeros(travel.size)
    loads = {each.name: np.zeros((len(zero), 6)) for each in asked.balance.places}
    for name, load in loads.items():
        load[:, 1] = force if name.endswith(CONTACT) else 0.0
    wheels = {output.driver for output in asked.outputs if isinstance(output, DriverEffort)}
    travels = {name: travel if name in wheels else zero for name in model.drivers}
    found = model.solve(loads, travels, slopes=False)
    executor = model.executor(LANES)
    work: dict[str, Work] = {
        "sample": lambda: model.solve(loads, travels, slopes=False),
        "matrix": lambda: executor.run("compliance"),
    }
    seconds = take_turns(work, rounds)
    sample: Spread = seconds["sample"].times(1e6 / zero.size)
    return {
        "schema": SCHEMA,
        "case": case.name,
        "samples": zero.size,
        "reached": int(found.reached.sum()),
        "unknowns": model.equations.order,
        "iterations": float(found.iterations.mean()),
        "us_per_sample": sample,
        "us_per_matrix": seconds["matrix"].times(1e6 / LANES),
    }


def lines(found: dict[str, object]) -> list[str]:
    """Return the results in words."""

    def shown(what: str) -> str:
        each = found[f"us_per_{what}"]
        assert isinstance(each, Spread)
        middle = f"median {each.median:.3g}, quartiles {each.lower:.3g} and {each.upper:.3g}"
        return f"  {each.least:.3g} us a {what} at least; {middle} of {each.rounds} rounds"

    return [
        f"{found['case']}: {found['samples']} equilibria, {found['reached']} reached,"
        f" {found['unknowns']} unknowns, {found['iterations']:.3g} iterations",
        shown("sample"),
        shown("matrix"),
    ]
