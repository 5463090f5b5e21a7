"""MuJoCo in simulate mode: `mj_step`, with constraints of the set softness.

A driven coordinate has an armature far above all masses, and is set to its value, rate and force at
every sample, or at every step if the rate varies. Velocities and accelerations come from
`mj_forward` at the sample.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.mechanism.motions import Ramp
from ...core.trajectory import Array, Trajectory
from ..mujoco.mujoco import MuJoCo, MuJoCoModel, mujoco
from .simulation import (
    Leg,
    SimulatedPose,
    Simulation,
    SimulationEndedError,
    start_of,
    with_joints_alone,
)

# Inertia of driven coordinates [kg or kg m2] next to bodies with unit inertia: reactions change
# their motion by a billionth.
ARMATURE = 1e9
# The impedance range with the least softness; MuJoCo clips at it (mjMAXIMP).
HARD = (0.9999, 0.9999, 0.001, 0.5, 2.0)
# Time constant of stiff constraints, in steps: the shortest that MuJoCo considers stable (refsafe),
# with the smallest gaps.
TIME_CONSTANT = 2.0
# Step of the projecting variant [s]: its correction equals the gap for any step.
UNIT_STEP = 1e-3
# Relative tolerance of its solver: the default, 1e-8, ends the corrections when a gap of a
# millimetre has shrunk to 1e-10 m.
TOLERANCE = 1e-15


@dataclass(frozen=True)
class Stepping(Simulation):
    """MuJoCo's time stepping: equal steps between the samples.

    Attributes:
        kind: "default" keeps every setting of MuJoCo; "stiff" has the stiffest stable constraints
            and MuJoCo's most accurate integrator; "projecting" sets every velocity to zero before
            each step, and springs and dampers to close a gap in one step, so that every step is a
            Newton correction in the metric of the masses. It has no velocities.
        effort: steps between samples; for the default variant, a factor on the number given by
            MuJoCo's default step size.
    """

    name: str
    kind: str
    effort: int
    projection = MuJoCo

    @property
    def loop(self) -> str:
        """Steps between samples are one call, unless every step must clear the velocities."""
        return "python" if self.kind == "projecting" else "simulator"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings other than MuJoCo's defaults."""
        own: Mapping[str, Mapping[str, Any]] = {
            "default": {"timestep": f"at most 0.002 s / {self.effort}"},
            "stiff": {
                "integrator": "RK4",
                "solref": "[2 timestep, 1]",
                "solimp": list(HARD),
                "diagexact": True,
                "steps per sample": self.effort,
            },
            "projecting": {
                "solref": "[-1/timestep^2, -1/timestep], refsafe off",
                "solimp": list(HARD),
                "diagexact": True,
                "tolerance": TOLERANCE,
                "qvel": "zero before every step",
                "steps per sample": self.effort,
            },
        }
        shared = {
            "driven coordinates": f"set at samples, armature {ARMATURE:g}",
            "rods": "bodies between a cross and a ball",
        }
        return {**own[self.kind], **shared, "options": "no gravity, no contact, no autoreset"}

    def unsupported(self, case: Case) -> str | None:
        """Return a message on the joint or driver that is not supported here, or None."""
        for coupler in case.mechanism.couplers:
            if coupler.curve and coupler.curve.knots:
                return f"{coupler}: MuJoCo's equality has powers up to the fourth; use projection"
        return super().unsupported(case)

    def efforts(self) -> Mapping[str, Stepping]:
        """Return the efforts by the number of steps."""
        counts = (1, 2, 3, 5, 8) if self.kind == "projecting" else (1, 2, 4, 8, 16)
        what = "times the default number of steps" if self.kind == "default" else "steps a sample"
        return {f"{n} {what}": replace(self, effort=n) for n in counts}

    def build(self, case: Case) -> _Steps:
        """Return the compiled model with its settings and start."""
        return _Steps(mujoco(), MuJoCo().with_known_joints(case), self)

    def solve(self, model: _Steps, case: Case, tol: float) -> Trajectory:
        with model.warnings():
            return super().solve(model, case, tol)


class _Massless(MuJoCoModel):
    # mj_objectAcceleration subtracts the gravity of the model
    gives_forces = False


class _Steps:
    def __init__(self, mj: Any, case: Case, how: Stepping) -> None:
        case = replace(case, mechanism=with_joints_alone(case.mechanism))
        self.mj, self.how, self.of = mj, how, _Massless(mj, case)
        self.start, self.details = start_of(self.of, case), self.of.details
        m = self.m = self.of.m
        self.longest = float(m.opt.timestep)
        places = [(*self.of.coordinate(name), sign) for name, sign in self.of.driven]
        self.q, self.v, self.sign = (np.array(each) for each in zip(*places, strict=True))
        m.dof_armature[self.v] = ARMATURE
        mj.mj_setConst(m, self.of.d)  # MuJoCo scales the softness by this
        if how.kind == "stiff":
            m.opt.integrator = mj.mjtIntegrator.mjINT_RK4
        if how.kind != "default":
            m.eq_solimp[:] = HARD
            # otherwise softness depends on a mean of the masses, not on each row
            m.opt.enableflags |= mj.mjtEnableBit.mjENBL_DIAGEXACT
        if how.kind == "projecting":
            m.opt.disableflags |= mj.mjtDisableBit.mjDSBL_REFSAFE
            m.opt.timestep, m.opt.tolerance = UNIT_STEP, TOLERANCE
            m.eq_solref[:] = -1.0 / UNIT_STEP**2, -1.0 / UNIT_STEP
        self.steady = all(isinstance(motion, Ramp) for motion in case.sweep.path.motions.values())
        self.warned: list[str] = []
        self.twist = np.zeros(6)  # angular over linear, global axes

    def count(self, gap: float) -> int:
        """Return the number of steps over a gap between samples [s]."""
        return self.how.effort * (
            math.ceil(gap / self.longest) if self.how.kind == "default" else 1
        )

    @contextmanager
    def warnings(self) -> Generator[None]:
        """Collect MuJoCo's warnings, which it would write to a file in the working directory."""
        before = self.mj.get_mju_user_warning()
        self.mj.set_mju_user_warning(self.warned.append)
        try:
            yield
        finally:
            self.mj.set_mju_user_warning(before)

    def run(self, leg: Leg) -> Iterator[SimulatedPose]:
        """Yield the poses of a leg."""
        mj, m, d = self.mj, self.m, self.of.d
        mj.mj_resetData(m, d)
        d.qpos[:], d.qvel[:] = self.start.configuration, leg.sign * self.start.v
        self.warned.clear()
        driven = leg.drive(leg.times)
        yield self.pose(driven[..., 0], 0)
        for k, (t, until) in enumerate(pairwise(leg.times.tolist()), start=1):
            n = self.count(abs(until - t))
            if self.how.kind == "projecting":
                self.project(driven[..., k])
            elif n:  # samples may be repeated
                self.step(leg, t, until, n)
            if self.warned:
                raise SimulationEndedError(f"MuJoCo warns: {self.warned[0]}")
            yield self.pose(driven[..., k], n)

    def step(self, leg: Leg, t: float, until: float, n: int) -> None:
        """Advance from time to time in n steps."""
        self.m.opt.timestep = h = abs(until - t) / n
        if self.how.kind == "stiff":
            self.m.eq_solref[:] = TIME_CONSTANT * h, 1.0
        if self.steady:
            self.mj.mj_step(self.m, self.of.d, n)
            return
        # a changing force has its value in the middle of the step
        whole, half = (
            leg.drive(t + (until - t) * (np.arange(n) + part) / n) for part in (0.0, 0.5)
        )
        for k in range(n):
            self.set(whole[0, :, k], whole[1, :, k], half[2, :, k])
            self.mj.mj_step(self.m, self.of.d)

    def project(self, driven: Array) -> None:
        """Correct the pose for the drivers' values."""
        for _ in range(self.how.effort):
            self.of.d.qvel[:] = 0.0
            self.set(driven[0], 0.0 * driven[1], 0.0 * driven[2])
            self.mj.mj_step(self.m, self.of.d)

    def set(self, c: Array, c_t: Array, c_tt: Array) -> None:
        """Set the driven coordinates to their values, rates and forces."""
        d = self.of.d
        d.qpos[self.q], d.qvel[self.v] = self.sign * c, self.sign * c_t
        d.qfrc_applied[self.v] = ARMATURE * self.sign * c_tt

    def pose(self, driven: Array, steps: int) -> SimulatedPose:
        """Return the pose at the current state, with the steps since the previous sample."""
        mj, m, d = self.mj, self.m, self.of.d
        self.set(*driven)
        points, moves = np.full((3, len(self.of.wanted), 3), np.nan), self.how.kind != "projecting"
        if moves:
            mj.mj_forward(m, d)
            mj.mj_rnePostConstraint(m, d)
        else:
            mj.mj_fwdPosition(m, d)
        for k, frame in enumerate(self.of.wanted):
            if frame.handle is None:  # of the ground
                points[:, k] = frame.position, np.zeros(3), np.zeros(3)
                continue
            points[0, k] = d.site_xpos[frame.handle]
            for order, rate in ((1, mj.mj_objectVelocity), (2, mj.mj_objectAcceleration)):
                if moves:
                    rate(m, d, mj.mjtObj.mjOBJ_SITE, frame.handle, self.twist, 0)
                    points[order, k] = self.twist[3:]
        return SimulatedPose(points, float(np.abs(d.efc_pos[: d.ne]).max(initial=0.0)), steps)


stiff = partial(Stepping, "mujoco", "stiff", 4)
default = partial(Stepping, "mujoco-default", "default", 1)
projecting = partial(Stepping, "mujoco-projecting", "projecting", 5)
