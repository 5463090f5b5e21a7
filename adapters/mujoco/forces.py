"""Forces by MuJoCo's recursive Newton-Euler: `mj_rne` and `mj_rnePostConstraint`; private to its
adapter.

MuJoCo's own constraint forces belong to soft constraints and are not used. Unit multipliers of its
equalities exert, measured on version 4.0: for a connect, a unit force on the first site and its
opposite on the second; for a weld, these and half a unit torque along the axes of the second body;
for a tendon, a unit force that pushes its sites apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints.base import unit
from ...core.mechanism.mechanism import Vector
from ...core.mechanism.motions import JointDriver, PointCoordinate
from ...core.trajectory import Array
from ..shared.force_solution import Dynamics
from ..shared.tree_forces import Mass, TreeForces, mass_properties
from ..shared.tree_reactions import RowWrench
from .spec import Equality, Sketch, coordinate

COMPUTED_BY = {
    "inverse dynamics": "mj_rne",
    "reactions of tree joints": "mj_rnePostConstraint: cfrc_int",
    "reactions of cut joints": "rows of efc_J",
    "force elements": "of the adapter, by sites of MuJoCo",
}


@dataclass(eq=False)
class SiteFrame:
    """A site, read on demand; see `frame_constraints.Frame`."""

    of: LoadedMuJoCo
    site: Any

    @property
    def body(self) -> int:
        return int(self.of.m.site_bodyid[self.site.id])

    @property
    def position(self) -> Array:
        return np.array(self.of.d.site_xpos[self.site.id])

    @property
    def rotation(self) -> Array:
        # the frame of every body is parallel to the global axes at design
        return np.array(self.of.d.xmat[self.body]).reshape(3, 3)

    @property
    def jacobian(self) -> Array:
        J = np.zeros((6, self.of.m.nv))
        self.of.mj.mj_jacSite(self.of.m, self.of.d, J[:3], J[3:], self.site.id)
        return J

    @property
    def velocity(self) -> Array:
        return self.jacobian @ self.of.d.qvel


class LoadedMuJoCo:
    """A model's masses, equalities and sites; see `tree_forces.LoadedTree`.

    It is created before the model is compiled; `bind` is called afterwards.
    """

    recursion: ClassVar[bool] = True

    def __init__(self, mj: Any, case: Case, sketch: Sketch) -> None:
        self.mj, self.case, self.sketch = mj, case, sketch
        self.carrier: dict[str, Any] = sketch.bodies
        self.forces = TreeForces(self)
        points = {
            each.name: case.mechanism.point(each.point)
            for each in case.mechanism.drivers
            if isinstance(each, PointCoordinate)
        }
        self.driven = {
            name: self.add_frame(self.carrier[point.body], point.position)
            for name, point in points.items()
        }

    def bind(self, m: Any, d: Any, closures: Sequence[Equality], rows: Sequence[slice]) -> None:
        """Store the compiled model, its data, its equalities and the indices of their rows."""
        self.m, self.d, self.rows = m, d, list(zip(closures, rows, strict=True))
        self.parents = [*map(int, m.body_parentid)]
        self.carrier = {name: int(body.id) for name, body in self.carrier.items()}
        self.branch_of = {
            name: (self.carrier[child], int(self.sketch.signs[name]))
            for name, child in self.sketch.children.items()
        }
        drivers = self.case.mechanism.drivers
        self.drivers = dict(enumerate(drivers, start=rows[-1].stop if rows else 0))
        self._set_loads(self.case.mechanism.gravity, self.forces.masses)

    def _set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        m, mj = self.m, self.mj
        m.opt.gravity[:] = gravity
        m.body_mass[:] = 0.0
        m.body_inertia[:] = 0.0
        for each in masses:
            body = each.frame.body
            mass, center, inertia = mass_properties(each.body, np.zeros(3))
            principal, axes = np.linalg.eigh(inertia)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            m.body_mass[body], m.body_ipos[body], m.body_inertia[body] = mass, center, principal
            mj.mju_mat2Quat(m.body_iquat[body], axes.ravel())
            # otherwise MuJoCo uses the body frame as the frame of its inertia
            m.body_sameframe[body] = int(mj.mjtSameFrame.mjSAMEFRAME_NONE)

    def add_frame(self, body: Any, at: Vector) -> SiteFrame:
        return SiteFrame(self, self.sketch.site(body, at))

    def look(self, frame: SiteFrame) -> None:
        pass  # sites are read on demand

    def dynamics(self, J: Array, v: Array, a: Array) -> Dynamics:
        """Return the forces with this Jacobian of all rows; see `force_solution.ForceModel`."""
        self.J = J
        return self.forces.dynamics(v, a)

    def jacobian(self) -> Array:
        return self.J

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        mj, m, d = self.mj, self.m, self.d
        found = np.zeros(m.nv)
        d.qvel[:], d.qacc[:] = v, a
        # masses affect the positions of the centres to which the velocities refer
        mj.mj_kinematics(m, d)
        mj.mj_comPos(m, d)
        mj.mj_comVel(m, d)
        mj.mj_rne(m, d, 1, found)
        d.efc_force[:] = 0.0  # forces of soft constraints, which `cfrc_int` would include
        mj.mj_rnePostConstraint(m, d)
        return found

    def passed_on(self, body: int, point: Array) -> Array:
        moment, force = np.split(np.array(self.d.cfrc_int[body]), 2)
        center = np.array(self.d.subtree_com[self.m.body_rootid[body]])
        return np.concatenate([force, moment + np.cross(center - point, force)])

    def angle(self, joint: str) -> float:
        at = self.m.joint(coordinate(joint, "rotation")).qposadr[0]
        return self.sketch.signs[joint] * float(self.d.qpos[at])

    def rows_of(self, joint: str) -> list[slice]:
        return [rows for each, rows in self.rows if each.joint == joint]

    def exerted(self) -> list[RowWrench]:
        found = list[RowWrench]()
        for each, rows in self.rows:
            if each.kind == "joint":
                continue
            i, j = each.ends
            on_i = self._on_first(each.kind, i, j)
            found.append(self._at(rows, i, on_i))
            found.append(self._at(rows, j, -on_i))
        for row, driver in self.drivers.items():
            if isinstance(driver, PointCoordinate):
                site = self.driven[driver.name].site.id
                pull = np.array([[*unit(driver.direction), 0.0, 0.0, 0.0]])
                found.append(self._at(slice(row, row + 1), site, pull))
        return found

    def _on_first(self, kind: str, i: int, j: int) -> Array:
        """Return the wrenches on the first site, about either site: the sites coincide, or the
        force acts along their line.
        """
        d, none = self.d, np.zeros((3, 3))
        if kind == "tendon":
            span = d.site_xpos[i] - d.site_xpos[j]
            return np.concatenate([span / np.sqrt(span @ span), np.zeros(3)])[None]
        forces = np.hstack([np.eye(3), none])
        if kind == "connect":
            return forces
        axes = np.array(d.xmat[self.m.site_bodyid[j]]).reshape(3, 3).T
        return np.vstack([forces, np.hstack([none, 0.5 * axes])])

    def _at(self, rows: slice, site: int, wrenches: Array) -> RowWrench:
        body, point = int(self.m.site_bodyid[site]), np.array(self.d.site_xpos[site])
        return RowWrench(rows, body, point, wrenches)

    def coordinate_rows(self) -> dict[int, list[tuple[str, str]]]:
        found = {rows.start: [*each.terms] for each, rows in self.rows if each.kind == "joint"}
        for row, driver in self.drivers.items():
            if isinstance(driver, JointDriver):
                found[row] = [(driver.joint, driver.freedom)]
        return found

    def coordinate_weight(self, row: int, joint: str, freedom: str) -> float:
        column = self.m.joint(coordinate(joint, freedom)).dofadr[0]
        return self.sketch.signs[joint] * float(self.J[row, column])
