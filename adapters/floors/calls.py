"""Calls of the projection mode into simulators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ..exudyn.rows import System
from ..mujoco.mujoco import mujoco as simulator
from ..shared.tree_model import TreeModel
from .floors import LEAST, Call, CountedCalls, Floor, floor_of


def mujoco(engine: Any, case: Case) -> Floor:
    """Return the floor of MuJoCo."""
    return floor_of(engine, case, _mujoco)


def exudyn(engine: Any, case: Case) -> Floor:
    """Return the floor of Exudyn."""
    return floor_of(engine, case, _exudyn)


def tree(engine: Any, case: Case) -> Floor:
    """Return the floor of an engine whose model is a `TreeModel`."""
    return floor_of(engine, case, _tree)


def _mujoco(engine: Any, model: Any, case: Case) -> CountedCalls:
    """Return `mj_kinematics` and the other calls of a pose."""
    mj, nothing = simulator(), simulator().MjSpec().compile()
    poses = ("mj_kinematics", "mj_comPos", "mj_tendon", "mj_makeConstraint")
    rates = ("mj_comVel", "mj_referenceConstraint")

    def calls(m: Any, d: Any) -> Mapping[str, Call]:
        return {name: partial(getattr(mj, name), m, d) for name in (*poses, *rates)}

    least = calls(nothing, mj.MjData(nothing))
    own = calls(model.m, model.d)
    return CountedCalls(own, least, dict.fromkeys(poses, 1), dict.fromkeys(rates, 1))


def _exudyn(engine: Any, model: Any, case: Case) -> CountedCalls:
    """Return the static solver's residual and Jacobian.

    Accelerations need two rates of the rows for a difference.
    """
    # the smallest model has one free coordinate
    least = System()
    node = least.mbs.AddNode(least.items.Node1D())
    least.mbs.AddObject(least.items.ObjectMass1D(nodeNumber=node, mass=1.0))
    least.mbs.Assemble()
    settings, solver = least.settings(), least.exu.MainSolverStatic()
    solver.InitializeSolver(least.mbs, settings)

    def calls(solver: Any, mbs: Any, settings: Any) -> Mapping[str, Call]:
        residual = partial(solver.ComputeAlgebraicEquations, mbs)
        jacobian = partial(solver.ComputeNewtonJacobian, mbs, settings)
        return {
            "ComputeAlgebraicEquations": residual,
            "ComputeNewtonJacobian": jacobian,
            "ComputeNewtonJacobian (rates)": jacobian,
            "ComputeAlgebraicEquations (rates)": residual,
        }

    return CountedCalls(
        calls(model.solver, model.mbs, model.settings),
        calls(solver, least.mbs, settings),
        {"ComputeAlgebraicEquations": 1, "ComputeNewtonJacobian": 1},
        {"ComputeNewtonJacobian (rates)": 1, "ComputeAlgebraicEquations (rates)": 2},
    )


def _tree(engine: Any, model: Any, case: Case) -> CountedCalls:
    """Return all simulator calls for a pose and its rates."""
    least = engine.model_of(replace(case, mechanism=LEAST, outputs=()))
    n, wanted = len(model.moving), len(model.wanted)
    # the same Python on the smallest model
    least.moving, least.wanted = least.moving * n, least.moving * wanted
    pose, rates, points = (
        f"placements and Jacobians of {n} frames",
        f"accelerations of {n} frames",
        f"motions of {wanted} points",
    )

    def calls(of: TreeModel) -> Mapping[str, Call]:
        zeros = np.zeros(of.unknowns)
        return {
            pose: of.observe,
            rates: partial(of.observe_rates, zeros),
            points: partial(of.points, zeros, zeros),
        }

    return CountedCalls(calls(model), calls(least), {pose: 1}, {rates: 1, points: 1})
