"""MuJoCo in projection mode: its tree kinematics and its equality constraints, solved by the Newton
walk of `projection`.

`spec` creates the elements for joints and drivers.

MuJoCo's time stepping treats equalities as soft, so this mode does not use it: a position is a root
of `efc_pos`, and velocity and acceleration follow from `efc_J` and its rate. MuJoCo puts that rate
into `efc_aref` of connects and welds, not of tendons and joints (measured: 4.0).
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from ...core.case.case import Case
from ...core.harness.engine import Floor
from ...core.mechanism.motions import JointDriver, PointCoordinate
from ...core.trajectory import Array
from ..shared.compiled_floor import floor_of
from ..shared.force_solution import Dynamics
from ..shared.projection_engine import ProjectionEngine
from .forces import COMPUTED_BY, LoadedMuJoCo
from .spec import JOINTS, Equality, Sketch, coordinate

ROWS = {"connect": 3, "weld": 6, "tendon": 1, "joint": 1}


class MuJoCo(ProjectionEngine):
    """The engine `mujoco`."""

    name, title, joints = "mujoco", "MuJoCo", JOINTS

    @property
    def described(self) -> Mapping[str, Any]:
        """Return the quantities of MuJoCo's equalities that are used."""
        return {
            "residual": (
                "efc_pos: units of length; angles: sin(angle/2) of welds, rad of joints; drivers:"
                " units or rad"
            ),
            "jacobian": "efc_J, dense",
            "options": "no gravity, no contact, no autoreset; equalities without spring and damper",
            "cut_joints": (
                "tendon; or connect or weld, to an auxiliary body where the joint has slides or"
                " hinges"
            ),
            "relations": "joint equalities",
        }

    def build(self, case: Case) -> MuJoCoModel:
        """Return the compiled model in the scaled frame, and its rows."""
        return self.model_of(self.own(case))

    def model_of(self, case: Case) -> MuJoCoModel:
        """Return the compiled model of the case, and its rows."""
        model = MuJoCoModel(mujoco(), case)
        model.m.eq_solref[:] = (
            0.0  # without spring and damper, aref equals minus Jdot v to the last bit
        )
        return model

    def floor(self, case: Case) -> Floor:
        """Return the floor from `mj_kinematics` and the other calls of a pose."""
        mj = mujoco()
        model = self.build(case)
        trajectory = self.solve(model, case, 1e-12)
        nothing = mj.MjSpec().compile()
        given, empty = (model.m, model.d), (nothing, mj.MjData(nothing))

        def calls(*names: str) -> Mapping[str, tuple[Any, Any, int]]:
            return {
                name: (partial(getattr(mj, name), *given), partial(getattr(mj, name), *empty), 1)
                for name in names
            }

        pose = calls("mj_kinematics", "mj_comPos", "mj_tendon", "mj_makeConstraint")
        return floor_of(
            self.name, trajectory, model.m.nv, pose, calls("mj_comVel", "mj_referenceConstraint")
        )


def mujoco() -> Any:
    """Return the simulator, imported at the first call."""
    return importlib.import_module("mujoco")


class MuJoCoModel:
    """A compiled mechanism as a `ProjectionModel`: the rows of its equalities, then one row for
    each driver.
    """

    gives_forces: ClassVar[bool] = True

    def __init__(self, mj: Any, case: Case) -> None:
        self.case = case
        mechanism, sketch = case.mechanism, Sketch(mj, case.mechanism)
        sites = {
            point.name: sketch.site(sketch.bodies[point.body], point.position)
            for point in mechanism.points
        }
        loaded = LoadedMuJoCo(mj, case, sketch) if self.gives_forces and case.forces else None
        self.mj, self.m = mj, sketch.spec.compile()
        self.d = mj.MjData(self.m)
        self.watched = [int(sites[name].id) for name in case.points]
        self.closures = [
            replace(each, ends=tuple(int(end.id) for end in each.ends)) for each in sketch.closures
        ]
        self.owner = np.repeat(
            np.arange(len(self.closures)), [ROWS[each.kind] for each in self.closures]
        )
        self.n = len(self.owner)
        if loaded:
            ends = np.cumsum([ROWS[each.kind] for each in self.closures]).tolist()
            rows = [slice(a, b) for a, b in pairwise([0, *ends])]
            loaded.bind(self.m, self.d, self.closures, rows)
        self.loaded = loaded
        owners = [self.closures[k] for k in self.owner]
        self.tendons = [
            (row, *each.ends) for row, each in enumerate(owners) if each.kind == "tendon"
        ]
        # joints that follow a polynomial: row, addresses of the other's coordinate and rate, curve
        self.bent = [
            (row, int(other.qposadr[0]), int(other.dofadr[0]), Polynomial(each.curve).deriv(2))
            for row, each in enumerate(owners)
            if each.follows
            for other in [self.m.joint(each.follows)]
        ]
        self.present: slice | NDArray[np.intp] = slice(self.n)
        self.A = np.zeros((self.n + len(mechanism.drivers), self.m.nv))
        self.columns = np.eye(len(self.A))[:, self.n :]  # the drivers have the last rows
        self.coordinates: list[tuple[int, int, float]] = []  # row, address in qpos, sign
        # joint drivers: address in qpos, in qvel, sign
        self.driven: list[tuple[int, int, float]] = []
        # row, site, unit direction, design position
        self.pulled: list[tuple[int, int, Array, Array]] = []
        for row, driver in enumerate(mechanism.drivers, start=self.n):
            if isinstance(driver, PointCoordinate):
                direction, start = (
                    np.array(driver.direction),
                    np.array(mechanism.point(driver.point).position),
                )
                self.pulled.append(
                    (row, int(sites[driver.point].id), direction / np.linalg.norm(direction), start)
                )
            elif isinstance(driver, JointDriver):
                joint, sign = (
                    self.m.joint(coordinate(driver.joint, driver.freedom)),
                    sketch.signs[driver.joint],
                )
                self.coordinates.append((row, int(joint.qposadr[0]), sign))
                self.driven.append((int(joint.qposadr[0]), int(joint.dofadr[0]), sign))
                self.A[row, int(joint.dofadr[0])] = sign
        self.details = {
            "tree": sketch.tree,
            "closures": sketch.means,
            "relations": sketch.relations,
            "closure_rows": self.n,
        }

    def reset(self) -> None:
        self.mj.mj_resetData(self.m, self.d)

    def save(self) -> Array:
        return np.array(self.d.qpos)

    def restore(self, saved: Array) -> None:
        self.d.qpos[:] = saved

    def move(self, dx: Array) -> None:
        self.mj.mj_integratePos(self.m, self.d.qpos, dx, 1.0)

    def residual(self, c: Array) -> Array:
        mj, m, d = self.mj, self.m, self.d
        mj.mj_kinematics(m, d)
        mj.mj_comPos(m, d)
        mj.mj_tendon(m, d)
        mj.mj_makeConstraint(m, d)
        # MuJoCo leaves out an equality while its Jacobian is zero; the others keep their order, and
        # efc_J its full length
        self.present = (
            slice(self.n) if d.ne == self.n else np.flatnonzero(np.isin(self.owner, d.efc_id))
        )
        r = -(self.columns @ c)
        r[self.present] = d.efc_pos
        if d.ne != self.n:
            for k in set(range(len(self.closures))).difference(d.efc_id.tolist()):
                r[: self.n][self.owner == k] = self.gap(self.closures[k])
        for row, address, sign in self.coordinates:
            r[row] += sign * d.qpos[address]
        for row, site, direction, start in self.pulled:
            r[row] += direction @ (d.site_xpos[site] - start)
        return r

    def jacobian(self) -> Array:
        self.A[: self.n] = 0.0
        self.A[self.present] = self.d.efc_J.reshape(-1, self.m.nv)[: self.d.ne]
        for row, site, direction, _ in self.pulled:
            self.A[row] = direction @ self.slope(site)
        return self.A

    def driver_columns(self) -> Array:
        return self.columns

    def bias(self, v: Array) -> Array:
        d, b = self.d, np.zeros(len(self.A))
        d.qvel[:] = v
        self.mj.mj_comVel(self.m, d)
        self.mj.mj_referenceConstraint(self.m, d)
        # aref = -(B vel + K I pos) - Jdot v; an absent connect or weld never opens, so its Jdot v
        # is zero
        stiffness, damping, impedance, _ = d.efc_KBIP.reshape(-1, 4).T
        b[self.present] = -(d.efc_aref + damping * d.efc_vel + stiffness * impedance * d.efc_pos)
        for row, i, j in self.tendons:
            span, apart = d.site_xpos[j] - d.site_xpos[i], (self.slope(j) - self.slope(i)) @ v
            turned = (self.slope_rate(j) - self.slope_rate(i)) @ v
            length = math.sqrt(span @ span)
            b[row] = (apart @ apart - (span @ apart / length) ** 2 + span @ turned) / length
        for row, place, rate, bend in self.bent:
            b[row] = -bend(d.qpos[place]) * v[rate] ** 2
        for row, site, direction, _ in self.pulled:
            b[row] = direction @ (self.slope_rate(site) @ v)
        return b

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.d.qvel[:] = v
        self.mj.mj_comVel(self.m, self.d)
        return [
            (np.array(self.d.site_xpos[site]), J @ v, J @ a + self.slope_rate(site) @ v)
            for site, J in zip(self.watched, map(self.slope, self.watched), strict=True)
        ]

    computed_by = COMPUTED_BY

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        assert self.loaded is not None
        return self.loaded.dynamics(self.A, v, a)

    def gap(self, closure: Equality) -> Array | float:
        """Return the residual of an equality that MuJoCo leaves out; a weld is left out only
        between parts of one rigid body, so its residual is zero.
        """
        i, j = closure.ends
        span = self.d.site_xpos[i] - self.d.site_xpos[j]
        return {"connect": span, "tendon": math.sqrt(span @ span) - closure.length, "weld": 0.0}[
            closure.kind
        ]

    def slope(self, site: int) -> Array:
        """Return the Jacobian of a site's position, shape (3, unknowns)."""
        J = np.zeros((3, self.m.nv))
        self.mj.mj_jacSite(self.m, self.d, J, None, site)
        return J

    def slope_rate(self, site: int) -> Array:
        """Return the rate of this Jacobian at the velocity last set, shape (3, unknowns)."""
        J = np.zeros((3, self.m.nv))
        self.mj.mj_jacDot(self.m, self.d, J, None, self.d.site_xpos[site], self.m.site_bodyid[site])
        return J
