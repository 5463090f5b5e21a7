"""Equilibria by the native engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...case.case import Balance, Case
from ...failures import FailureKind
from ...forces import Forces
from ...harness.native_engine import NativeEngine
from ...kinematics import largest_residual
from ...trajectory import PointMotion, Trajectory
from .equilibrium import StaticModel


def equilibria(engine: NativeEngine, case: Case) -> Trajectory:
    """Return the equilibria of a case; see `harness.engine.Balancing`."""
    mechanism, balance, path = case.mechanism, case.balance or Balance(), case.sweep.path
    names = [driver.name for driver in mechanism.drivers]
    travel = dict(zip(names, path.drive(names, path.times)[0], strict=True))
    found = StaticModel(mechanism, balance.places).solve(balance.loads, travel, slopes=False)

    def place(name: str) -> PointMotion:
        point = mechanism.point(name)
        at = found.place(point.body, point.position)
        return PointMotion(np.where(found.reached[:, None], at, np.nan), None, None)

    kept = {
        name: replace(each, r=each.r[found.reached], p=each.p[found.reached])
        for name, each in found.bodies.items()
    }
    unknown = np.full(len(found.reached), np.nan)
    efforts = {name: np.where(found.reached, x, np.nan) for name, x in found.efforts.items()}
    return Trajectory(
        {name: place(name) for name in case.points},
        found.reached,
        found.iterations,
        largest_residual(mechanism, mechanism.joints, kept),
        "" if found.reached.all() else "the path of loads and travel turns back (snap-through)",
        forces=Forces({}, efforts, {}, unknown, unknown),
        failures=[] if found.reached.all() else [FailureKind.NOT_FOUND],
    )
