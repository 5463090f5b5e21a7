"""Poses of an MJCF model by Newton's method on MuJoCo's own residuals of its equalities."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from .newton import least_squares

FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
COUNTS = {FREE: (6, 7), BALL: (3, 4)}
"""Unknowns and coordinates of joints; of others one."""


def compiled(file):
    """Return MuJoCo's own reading of a file, without what needs meshes, and without contacts."""
    spec: Any = mujoco.MjSpec.from_file(str(file))
    kinds = mujoco.mjtGeom
    for geom in [*spec.geoms]:
        if geom.meshname or geom.type in (kinds.mjGEOM_MESH, kinds.mjGEOM_HFIELD, kinds.mjGEOM_SDF):
            spec.delete(geom)
    tied = {name for each in spec.equalities for name in (each.name1, each.name2)}
    loose = [each for each in spec.tendons if each.name not in tied]
    for section in ("actuators", "sensors", "pairs", "excludes", "skins", "keys"):
        loose += [*getattr(spec, section, [])]
    for each in loose:
        spec.delete(each)
    for each in (*spec.geoms, *spec.sites, *spec.tendons):
        each.material = ""
    for section in ("materials", "textures", "meshes", "hfields"):
        for each in [*getattr(spec, section, [])]:
            spec.delete(each)
    # bodies without geoms have no mass, which motion does not need
    spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-9
    spec.compiler.fusestatic, spec.compiler.balanceinertia = False, True
    model = spec.compile()
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= int(off.mjDSBL_CONTACT) | int(off.mjDSBL_LIMIT)
    return model


class MujocoNewton:
    """A pose, moved by Newton's method.

    Attributes:
        residual: of all equalities after the last move [m or rad].
    """

    def __init__(self, file, assembled, fixed):
        self.model, self.residual = compiled(file), 0.0
        self.data = mujoco.MjData(self.model)
        self.weak = max(1e-7, 10.0 * assembled.closing.tolerance / assembled.closing.size)
        tree = assembled.tree
        moves = tree.moves.values()
        assert len(moves) == self.model.njnt
        self.joints = {name: k for k, name in enumerate(tree.moves)}
        self.bodies = {joint.inner: self.model.jnt_bodyid[k] for k, joint in enumerate(moves)}
        for joint in moves:
            at = self.model.jnt_qposadr[self.joints[joint.name]]
            if joint.is_axial:
                self.data.qpos[at] = joint.value
            elif joint.kind == "free":
                place = tree.moving[joint.inner]
                self.data.qpos[at : at + 7] = [*place.at, *place.turn]
            elif joint.inner not in tree.massless:
                self._turn(self.joints[joint.name], np.array([*tree.moving[joint.inner].turn]))
        names = {joint.name for joint in moves if {joint.name, joint.inner} & {*fixed}}
        self.fixed = {self.joints[name]: self._coordinates(self.joints[name]) for name in names}

    @property
    def state(self):
        """The coordinates."""
        return self.data.qpos.copy()

    @state.setter
    def state(self, value):
        self.data.qpos[:] = value

    def move(self, targets):
        """Close all equalities with joints at given coordinates [rad or m]."""
        wanted = {self.joints[name]: np.array([x]) for name, x in targets.items()} | self.fixed

        def rows():
            off, slopes = [self._equalities()[0]], [self._equalities()[1]]
            for joint, value in wanted.items():
                count = COUNTS.get(int(self.model.jnt_type[joint]), (1, 1))[0]
                slope = np.zeros((count, self.model.nv))
                slope[np.arange(count), self.model.jnt_dofadr[joint] + np.arange(count)] = 1.0
                off.append(self._apart(joint, value))
                slopes.append(slope)
            return np.concatenate(off), np.vstack(slopes)

        least_squares(
            rows,
            lambda step: mujoco.mj_integratePos(self.model, self.data.qpos, step, 1.0),
            self.weak,
        )
        self.residual = float(np.abs(self._equalities()[0]).max(initial=0.0))

    def body(self, name):
        """Return position and rotation matrix of a body; None of one that is no body there."""
        if name not in self.bodies:
            return None
        mujoco.mj_kinematics(self.model, self.data)
        k = self.bodies[name]
        return self.data.xpos[k].copy(), self.data.xmat[k].reshape(3, 3).copy()

    def _coordinates(self, joint):
        at, count = (
            self.model.jnt_qposadr[joint],
            COUNTS.get(int(self.model.jnt_type[joint]), (1, 1))[1],
        )
        return self.data.qpos[at : at + count].copy()

    def _apart(self, joint, value):
        here, turn = self._coordinates(joint), np.zeros(3)
        if len(here) < 4:
            return here - value
        mujoco.mju_subQuat(turn, here[-4:], value[-4:])
        return np.concatenate([here[:-4] - value[:-4], turn])

    def _turn(self, joint, wanted):
        """Turn a ball so that its body has an orientation."""
        mujoco.mj_kinematics(self.model, self.data)
        body, at = self.model.jnt_bodyid[joint], self.model.jnt_qposadr[joint]
        back, rest, found = np.zeros(4), np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(back, self.data.xquat[body])
        mujoco.mju_mulQuat(rest, back, wanted)
        mujoco.mju_mulQuat(found, self._coordinates(joint), rest)
        self.data.qpos[at : at + 4] = found

    def _equalities(self):
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        slopes = np.zeros((data.nefc, model.nv))
        if data.nefc and mujoco.mj_isSparse(model):
            sparse = (data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
            mujoco.mju_sparse2dense(slopes, data.efc_J, *sparse)
        elif data.nefc:
            slopes = data.efc_J.reshape(data.nefc, model.nv).copy()
        rows = data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return data.efc_pos[: data.nefc][rows].copy(), slopes[rows]
