"""MuJoCo in projection mode: its tree kinematics and its equality constraints, solved by the Newton walk of `projection`.

Every body frame lies on the global frame at design, so the geometry of a case enters as it stands. The joints of the spanning
tree become MuJoCo joints. A cut joint closes its loop by one equality constraint: a spherical joint by a connect, a distance by
a tendon over two sites, any other by a weld between the second body and an auxiliary body that carries the joint's freedoms on
the first. These rows have full rank where the joint's own rows have; two connects on the axis of a revolute would not.

MuJoCo's time stepping treats equalities as soft, so it is not used: position is a root of `efc_pos`, velocity and acceleration
follow from `efc_J` and its rate. MuJoCo puts that rate into `efc_aref` of connects and welds, not of tendons (measured: 4.0).
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.drivers import JointAngle, JointDisplacement, JointDriver, PointCoordinate
from ..core.harness.case import Case
from ..core.joints import Distance, Fixed, Joint, Revolute, Spherical, Translational, Universal
from ..core.mechanism import GROUND, Mechanism
from ..core.topology import spanning_tree
from ..core.trajectory import Array, Trajectory
from .projection import solve_by_projection

JOINTS = (Distance, Fixed, Revolute, Spherical, Translational, Universal)
DRIVERS = (JointAngle, JointDisplacement, PointCoordinate)
ROWS = {"connect": 3, "weld": 6, "tendon": 1}


class MuJoCo:
    """The engine `mujoco`; see `Engine`."""

    name = "mujoco"
    mode = "projection"
    loop = "python"
    settings: Mapping[str, Any] = MappingProxyType(
        {
            "residual": "efc_pos: m for connects and tendons, m and sin(angle/2) for welds; drivers: m or rad",
            "jacobian": "efc_J, dense",
            "linear_solver": "LU where the rows are square and of full rank at design, else least squares",
            "options": "no gravity, no contact, no autoreset",
            "cut_joints": "connect, tendon, or auxiliary body + weld",
        }
    )

    def version(self) -> str | None:
        """MuJoCo's version, or None where it cannot be imported."""
        try:
            return str(_mujoco().__version__)
        except Exception:  # a broken binary raises whatever its loader likes; to the harness all of it means "not here"
            return None

    def unsupported(self, case: Case) -> str | None:
        """None, or the joint or driver that has no counterpart here."""
        for joint in case.mechanism.joints:
            if type(joint) not in JOINTS:
                return f"{joint} has no counterpart in MuJoCo here; known: {', '.join(each.type for each in JOINTS)}"
        for driver in case.mechanism.drivers:
            if type(driver) not in DRIVERS:
                known = ", ".join(each.type for each in DRIVERS)
                return f"driver {driver.name!r} ({driver.type}) has no counterpart in MuJoCo here; known: {known}"
        return None

    def build(self, case: Case) -> _Model:
        """The compiled model and its rows."""
        return _Model(_mujoco(), case)

    def solve(self, model: _Model, case: Case, tol: float) -> Trajectory:
        """All samples; see `Engine.solve`."""
        return solve_by_projection(model, case, tol, model.details)


def _mujoco() -> Any:
    return importlib.import_module("mujoco")


@dataclass(frozen=True, slots=True)
class _Closure:
    """An equality constraint between two sites (their ids are known once the spec is compiled); length of a tendon [m]."""

    kind: str
    i: Any
    j: Any
    length: float = 0.0


class _Sketch:
    """A mechanism written into an MjSpec. The spec is compiled as it is: its XML text would keep six digits."""

    def __init__(self, mj: Any, mechanism: Mechanism) -> None:
        self.mj, self.mechanism = mj, mechanism
        self.spec = mj.MjSpec()
        self.spec.option.gravity = [0.0, 0.0, 0.0]
        self.spec.option.jacobian = mj.mjtJacobian.mjJAC_DENSE
        # autoreset would answer a diverged pose with the design pose
        self.spec.option.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_AUTORESET
        fixed = [GROUND, *(body.name for body in mechanism.bodies if body.fixed)]
        self.bodies = dict[str, Any].fromkeys(fixed, self.spec.worldbody)
        self.closures: list[_Closure] = []
        self.tree: dict[str, str] = {}  # what carries each body
        self.means: dict[str, str] = {}  # what closes each cut joint
        self.signs: dict[str, float] = {}  # of a joint's coordinate: minus where it moves the joint's first body
        tree = spanning_tree(mechanism)
        for branch in tree.branches:
            body = self.bodies[branch.child] = self.body(self.bodies[branch.parent])
            self.tree[branch.child] = "free" if branch.joint is None else str(branch.joint)
            if branch.joint is None:
                self.free(body, branch.child)
            else:
                self.freedoms(body, branch.joint, mirrored=branch.child == branch.joint.i)
        for joint in tree.cut:
            self.close(joint, self.bodies[joint.i], self.bodies[joint.j])

    def body(self, parent: Any) -> Any:
        """A body on its parent's frame. Mass and inertia do not enter kinematics, but MuJoCo wants them positive."""
        body = parent.add_body()
        body.mass, body.inertia, body.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
        return body

    def site(self, body: Any, position: Sequence[float]) -> Any:
        """A new site of a body."""
        return body.add_site(name=str(len(self.spec.sites)), pos=list(position))

    def free(self, body: Any, name: str) -> None:
        """Give a body all freedoms. It turns about the mean of its rods' ends, where a tangent predicts it best."""
        rods = [joint for joint in self.mechanism.joints if isinstance(joint, Distance) and name in joint.bodies]
        points = [rod.points[rod.bodies.index(name)] for rod in rods] or [self.mechanism.body(name).origin]
        for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]):
            body.add_joint(type=self.mj.mjtJoint.mjJNT_SLIDE, axis=axis)
        body.add_joint(type=self.mj.mjtJoint.mjJNT_BALL, pos=np.mean(points, axis=0).tolist())

    def freedoms(self, body: Any, joint: Joint, *, mirrored: bool = False) -> None:
        """Give a body the freedoms of a joint relative to its parent; mirrored: the body is the joint's first."""
        types = self.mj.mjtJoint
        self.signs[joint.name] = -1.0 if mirrored else 1.0
        match joint:
            case Revolute():
                body.add_joint(name=joint.name, type=types.mjJNT_HINGE, pos=list(joint.point), axis=list(joint.axis))
            case Translational():
                body.add_joint(name=joint.name, type=types.mjJNT_SLIDE, axis=list(joint.axis))
            case Spherical():
                body.add_joint(type=types.mjJNT_BALL, pos=list(joint.point))
            case Universal():  # the earlier axis moves with the parent, the later one with the body
                for axis in reversed(joint.axes) if mirrored else joint.axes:
                    body.add_joint(type=types.mjJNT_HINGE, pos=list(joint.point), axis=list(axis))
            case Fixed():
                pass
            case _:
                raise NotImplementedError(f"{joint} has no counterpart in MuJoCo; ask `unsupported` before `build`")

    def close(self, joint: Joint, i: Any, j: Any) -> None:
        """Express a cut joint of bodies i and j by an equality constraint."""
        self.means[joint.name] = "weld to an auxiliary body that carries the joint's freedoms"
        match joint:
            case Distance():
                self.means[joint.name] = "tendon"
                ends = self.site(i, joint.points[0]), self.site(j, joint.points[1])
                tendon = self.spec.add_tendon(name=joint.name)
                for end in ends:
                    tendon.wrap_site(end.name)
                equality = self.spec.add_equality(type=self.mj.mjtEq.mjEQ_TENDON, name1=joint.name)
                # the length is that at design plus a polynomial of another tendon; there is none, which leaves its constant
                equality.data = [joint.rod_length - joint.design_distance, *[0.0] * (len(equality.data) - 1)]
                self.closures.append(_Closure("tendon", *ends, joint.rod_length))
            case Spherical():
                self.means[joint.name] = "connect"
                self.join("connect", i, j, joint.point)
            case _:
                carrier = self.body(i)
                self.freedoms(carrier, joint)
                moving = self.mechanism.body(joint.i if self.mechanism.is_fixed(joint.j) else joint.j)
                self.join("weld", carrier, j, getattr(joint, "point", None) or moving.origin)

    def join(self, kind: str, i: Any, j: Any, position: Sequence[float]) -> None:
        """Tie two bodies at a position. The default data stays: it holds the scale of a weld's rotation rows."""
        ends = self.site(i, position), self.site(j, position)
        equality = {"connect": self.mj.mjtEq.mjEQ_CONNECT, "weld": self.mj.mjtEq.mjEQ_WELD}[kind]
        self.spec.add_equality(type=equality, name1=ends[0].name, name2=ends[1].name, objtype=self.mj.mjtObj.mjOBJ_SITE)
        self.closures.append(_Closure(kind, *ends))


class _Model:
    """A compiled mechanism as a `ProjectionModel`: the rows of its equalities, then one row for each driver."""

    def __init__(self, mj: Any, case: Case) -> None:
        mechanism, sketch = case.mechanism, _Sketch(mj, case.mechanism)
        sites = {point.name: sketch.site(sketch.bodies[point.body], point.position) for point in mechanism.points}
        self.mj, self.m = mj, sketch.spec.compile()
        self.d = mj.MjData(self.m)
        self.watched = [int(sites[name].id) for name in case.points]
        self.closures = [replace(each, i=int(each.i.id), j=int(each.j.id)) for each in sketch.closures]
        self.owner = np.repeat(np.arange(len(self.closures)), [ROWS[each.kind] for each in self.closures])
        self.n = len(self.owner)
        owners = [self.closures[k] for k in self.owner]
        self.tendons = [(row, each.i, each.j) for row, each in enumerate(owners) if each.kind == "tendon"]
        self.present: slice | NDArray[np.intp] = slice(self.n)
        self.A = np.zeros((self.n + len(mechanism.drivers), self.m.nv))
        self.columns = np.eye(len(self.A))[:, self.n :]  # the rows of the drivers are the last
        self.coordinates: list[tuple[int, int, float]] = []  # row, address in qpos, sign
        self.pulled: list[tuple[int, int, Array, Array]] = []  # row, site, unit direction, design position
        for row, driver in enumerate(mechanism.drivers, start=self.n):
            if isinstance(driver, PointCoordinate):
                direction, start = np.array(driver.direction), np.array(mechanism.point(driver.point).position)
                self.pulled.append((row, int(sites[driver.point].id), direction / np.linalg.norm(direction), start))
            elif isinstance(driver, JointDriver):
                joint, sign = self.m.joint(driver.joint), sketch.signs[driver.joint]
                self.coordinates.append((row, int(joint.qposadr[0]), sign))
                self.A[row, int(joint.dofadr[0])] = sign
        self.details = {"tree": sketch.tree, "closures": sketch.means, "closure_rows": self.n}

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
        # MuJoCo leaves out an equality while its whole Jacobian is zero; the rest keeps its order, efc_J its full length
        self.present = slice(self.n) if d.ne == self.n else np.flatnonzero(np.isin(self.owner, d.efc_id))
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
        # aref = -(B vel + K I pos) - Jdot v; an absent connect or weld is one that never opens, its Jdot v is zero
        stiffness, damping, impedance, _ = d.efc_KBIP.reshape(-1, 4).T
        b[self.present] = -(d.efc_aref + damping * d.efc_vel + stiffness * impedance * d.efc_pos)
        for row, i, j in self.tendons:
            span, apart = d.site_xpos[j] - d.site_xpos[i], (self.slope(j) - self.slope(i)) @ v
            turned = (self.slope_rate(j) - self.slope_rate(i)) @ v
            length = math.sqrt(span @ span)
            b[row] = (apart @ apart - (span @ apart / length) ** 2 + span @ turned) / length
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

    def gap(self, closure: _Closure) -> Array | float:
        """Residual of an equality that MuJoCo leaves out: of a weld only between parts of one rigid body, so it is zero."""
        span = self.d.site_xpos[closure.i] - self.d.site_xpos[closure.j]
        return {"connect": span, "tendon": math.sqrt(span @ span) - closure.length, "weld": 0.0}[closure.kind]

    def slope(self, site: int) -> Array:
        """Jacobian of a site's position, shape (3, unknowns)."""
        J = np.zeros((3, self.m.nv))
        self.mj.mj_jacSite(self.m, self.d, J, None, site)
        return J

    def slope_rate(self, site: int) -> Array:
        """Its rate at the velocity last set, shape (3, unknowns)."""
        J = np.zeros((3, self.m.nv))
        self.mj.mj_jacDot(self.m, self.d, J, None, self.d.site_xpos[site], self.m.site_bodyid[site])
        return J
