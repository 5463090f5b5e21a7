"""Comparison of the forces that MuJoCo reports for its constraints with the forces of rigid bodies.

MuJoCo's constraints are soft, so its forces differ from the engine's forces, the multipliers of
exact rows. At a pose, with velocities and applied forces of the exact motion, MuJoCo finds its own
accelerations; its tendon equality, which models a rod, has no Jdot v. Run:

    python -m kincheck.adapters.simulate.soft_constraints CASE.toml
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.case.case import Case
from ...core.case.io.case_file import load_case
from ...core.errors import CaseError, KincheckError
from ...core.kinematics import start_of
from ...core.trajectory import Array
from ..mujoco.mujoco import MuJoCo, MuJoCoModel
from ..shared.equivalents import own_frame
from ..shared.projection import Walk

# solref and solimp of every equality: MuJoCo's own, and nearly rigid.
SOFTNESS: Mapping[str, tuple[Sequence[float], Sequence[float]]] = {
    "default": ((0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)),
    "stiff": ((0.002, 1.0), (0.9999, 0.9999, 0.001, 0.5, 2.0)),
}
# Largest number of steps of MuJoCo's constraint solver, which stops earlier once it has converged.
ITERATIONS = 500
TOL = 1e-12


@dataclass(frozen=True, eq=False)
class RodForces:
    """The compression of a rod over the samples [N], each of shape (n,).

    Attributes:
        rigid: from the exact accelerations.
        without_bias: from rigid rows, where the row of the rod lacks Jdot v.
        forward: `efc_force` after `mj_forward`, by softness.
        inverse: `efc_force` after `mj_inverse` at the exact accelerations, by softness.
    """

    rigid: Array
    without_bias: Array
    forward: Mapping[str, Array]
    inverse: Mapping[str, Array]


def rod_forces(case: Case, rod: str) -> RodForces:
    """Return the forces of a rod, a distance joint that closes a loop, over the sweep of a case.

    Raises:
        CaseError: the case has no force output, its bodies lack masses, or the rod is no tendon.
        SolveError: the case cannot be built.
    """
    if not case.forces:
        raise CaseError(f"case {case.name!r}: no output reads a force; add one, as joint_force")
    if (reason := MuJoCo().unsupported(case)) is not None:
        raise CaseError(f"case {case.name!r}: {reason}")
    engine = MuJoCo()
    model, unit = engine.model_of(engine.scaled_case(case)), own_frame(case).unit
    m, d, mj = model.m, model.d, model.mj
    tendons = {
        str(each.keeps): rows.start
        for each, (rows, _) in zip(model.equalities, model.own_rows, strict=True)
        if each.kind == "tendon"
    }
    if rod not in tendons:
        raise CaseError(
            f"case {case.name!r}: joint {rod!r} is no rod that MuJoCo has as a tendon, expected one"
            f" of: {', '.join(tendons) or 'none'}"
        )
    row, equalities = tendons[rod], model.own_count
    m.dof_armature[:] = 0.0
    rigid, without_bias = list[float](), list[float]()
    own = {(way, name): list[float]() for way in ("forward", "inverse") for name in SOFTNESS}
    exact = m.eq_solref.copy(), m.eq_solimp.copy()
    m.opt.iterations, m.opt.tolerance = ITERATIONS, 0.0
    walk, path = Walk(model, case, TOL, None, own_frame(case)), case.sweep.path
    origin, message = walk.start(path, start_of(case.mechanism, path))
    if origin is None:
        raise CaseError(f"case {case.name!r}: {message}")
    samples = [at for _, at in walk.follow_samples(origin)]
    mj.mj_setConst(m, d)
    for at in samples:
        model.restore(at.saved)
        model.residual(at.c)
        J = np.array(model.jacobian())
        given = model.dynamics(at.v, at.a)
        multipliers = np.linalg.lstsq(J.T, given.demand)[0]
        applied = model.inverse_dynamics(at.v, at.a) - given.demand
        applied += J[equalities:].T @ multipliers[equalities:]
        bias = model.bias(at.v)[:equalities]
        bias[row] = 0.0
        rigid.append(float(multipliers[row]))
        unbiased = _rigid(model, J[:equalities], bias, applied, at.v, case)
        without_bias.append(float(unbiased[row]))
        for name, (solref, solimp) in SOFTNESS.items():
            m.eq_solref[:], m.eq_solimp[:] = solref, solimp
            d.qfrc_applied[:] = applied
            mj.mj_forward(m, d)
            own["forward", name].append(float(d.efc_force[row]))
            d.qacc[:] = at.a
            mj.mj_inverse(m, d)
            own["inverse", name].append(float(d.efc_force[row]))
        d.qfrc_applied[:] = 0.0
        m.eq_solref[:], m.eq_solimp[:] = exact
    return RodForces(
        unit * np.array(rigid),
        unit * np.array(without_bias),
        {name: unit * np.array(own["forward", name]) for name in SOFTNESS},
        {name: unit * np.array(own["inverse", name]) for name in SOFTNESS},
    )


def _rigid(
    model: MuJoCoModel, E: Array, bias: Array, applied: Array, v: Array, case: Case
) -> Array:
    """Return the multipliers of rigid rows E qacc = -bias under these applied forces."""
    n, (rows, _) = len(v), E.shape
    drift = model.inverse_dynamics(v, np.zeros(n))
    columns = [model.inverse_dynamics(v, unit) - drift for unit in np.eye(n)]
    mass = np.array(columns).T
    if np.linalg.eigvalsh(0.5 * (mass + mass.T))[0] <= 0.0:
        raise CaseError(
            f"case {case.name!r}: a moving body has no mass or no inertia, and MuJoCo finds no"
            " accelerations; give every body mass and inertia"
        )
    system = np.block([[mass, -E.T], [E, np.zeros((rows, rows))]])
    found = np.linalg.solve(system, np.concatenate([applied - drift, -bias]))
    return np.asarray(found[n:], dtype=np.float64)


def report_lines(found: RodForces, rod: str) -> str:
    """Return the findings as lines of text."""
    largest, n = float(np.abs(found.rigid).max()), len(found.rigid)

    def off(values: Array, other: Array) -> str:
        return f"{float(np.abs(values - other).max()):.3g} N"

    lines = [f"{rod}: at most {largest:.4g} N over {n} samples, by exact rows"]
    for name, values in found.forward.items():
        lines += [
            f"{name} equalities, efc_force of mj_forward: off by up to {off(values, found.rigid)};"
            f" from rigid rows without Jdot v of the tendon by {off(values, found.without_bias)}",
            f"{name} equalities, efc_force of mj_inverse at the exact accelerations: off by up to"
            f" {off(found.inverse[name], found.rigid)}",
        ]
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Print the forces of every rod of a case file; return the exit status."""
    if len(arguments) != 1:
        print(
            "usage: python -m kincheck.adapters.simulate.soft_constraints CASE.toml",
            file=sys.stderr,
        )
        return 2
    try:
        case = load_case(arguments[0])
        rods = [joint.name for joint in case.mechanism.joints if joint.type == "distance"]
        if not rods:
            raise CaseError(f"case {case.name!r}: no joint is a distance, and MuJoCo has no tendon")
        for rod in rods:
            print(report_lines(rod_forces(case, rod), rod))
    except KincheckError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
