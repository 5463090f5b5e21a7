"""MuJoCo in projection mode: its tree kinematics and its equality constraints, solved by the Newton
walk of `projection`.

MuJoCo's time stepping treats equalities as soft, so this mode does not use it: a position is a root
of `efc_pos`, and velocity and acceleration follow from `efc_J` and its rate. MuJoCo puts that rate
into `efc_aref` of connects and welds, not of tendons and joints (measured: 4.0).

Every body frame coincides with the global frame at design, so the geometry of a case is used
unchanged. All links of a chain are joints of one body. One equality constraint ties the end of a
cut joint's links to its second body: a connect if the chain ends in a ball, else a weld; a distance
is a tendon over two sites. These rows have full rank if the joint's own rows have; two connects on
the axis of a revolute would not. Joint equalities relate coordinates to one another.

Forces come from MuJoCo's recursive Newton-Euler, since its own constraint forces belong to soft
constraints. Unit multipliers of its equalities exert, measured on version 4.0: for a connect, a
unit force on the first site and its opposite on the second; for a weld, these and half a unit
torque along the axes of the second body; for a tendon, a unit force apart on its sites.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from ...core.case.case import Case
from ...core.joints import Distance, Spherical
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.force_solution import RowWrench
from ..shared.tree_forces import Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import CHAINS, Chain, Closure, Link, Relation

ROWS = {"connect": 3, "weld": 6, "tendon": 1, "joint": 1}


class MuJoCo(TreeEngine):
    """The engine `mujoco`."""

    name, title, joints = "mujoco", "MuJoCo", (*CHAINS, Distance)

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

    def model_of(self, case: Case) -> MuJoCoModel:
        """Return the compiled model of the case, and its rows."""
        model = MuJoCoModel(mujoco(), case)
        # without spring and damper, aref equals minus Jdot v to the last bit
        model.m.eq_solref[:] = 0.0
        return model


def mujoco() -> Any:
    """Return the simulator, imported at the first call."""
    return importlib.import_module("mujoco")


@dataclass(eq=False)
class Equality:
    """An equality constraint of MuJoCo.

    Attributes:
        keeps: name of the cut joint, or the relation.
        bodies: numbers of the tied bodies.
        sites: the tied sites, in the compiled model their numbers.
        length: length of a tendon [m].
        follows, curve: the joint whose polynomial another follows, and the polynomial.
    """

    kind: str
    keeps: str | Relation
    bodies: Sequence[int] = ()
    sites: Sequence[Any] = ()
    length: float = 0.0
    follows: str = ""
    curve: Sequence[float] = ()


class MuJoCoModel(TreeModel):
    """The tree in MuJoCo: a body for each chain, a site for each frame, an equality for each cut
    joint and each relation.

    Attributes:
        nodes, links: bodies and joints of the specification, by their numbers.
        equalities: in the order of their rows.
    """

    whole = (Distance,)
    merges = False
    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "mj_rne",
        "reactions of tree joints": "mj_rnePostConstraint: cfrc_int",
        "reactions of cut joints": "rows of efc_J",
        "force elements": "of the adapter, by sites of MuJoCo",
    }

    def __init__(self, mj: Any, case: Case) -> None:
        # the specification is compiled directly, because its XML text has only six digits
        self.mj, self.spec = mj, mj.MjSpec()
        self.spec.option.gravity = [0.0, 0.0, 0.0]
        self.spec.option.jacobian = mj.mjtJacobian.mjJAC_DENSE
        # autoreset would replace a diverged pose by the design pose
        self.spec.option.disableflags |= (
            mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_AUTORESET
        )
        self.m: Any = None  # until `finish`, as the data
        self.d: Any = None
        self.nodes, self.links = [self.spec.worldbody], list[Any]()
        self.equalities: list[Equality] = []
        self.carriers: dict[str, str] = {}
        self.relations: list[str] = []
        self.masses: Sequence[Mass] = ()
        super().__init__(case)

    @property
    def details(self) -> Mapping[str, Any]:
        return {
            "tree": self.carriers,
            "closures": self.closures,
            "relations": self.relations,
            "closure_rows": self.own_count,
        }

    def carry(self, chain: Chain) -> None:
        parent, joint = self.carrier[chain.parent], chain.joint
        node = self.nodes[parent].add_body(name=str(len(self.nodes)))
        # mass and inertia do not affect kinematics, but must be positive definite
        node.mass, node.inertia, node.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
        self.carrier[chain.child] = len(self.nodes)
        if not chain.cut:
            self.carriers[chain.child] = str(joint) if joint else "free"
            if joint:
                self.branch_of[joint.name] = len(self.nodes), chain.sign
        self.nodes.append(node)
        self.parents.append(parent)
        self.origin.append(np.zeros(3))
        for link in chain.links:
            if joint and link.name:
                self.coordinates[joint.name, link.name] = str(len(self.links)), chain.sign
            self.add_link(self.carrier[chain.child], link, np.array(link.point))

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        types = self.mj.mjtJoint
        kinds = {"slide": types.mjJNT_SLIDE, "hinge": types.mjJNT_HINGE, "ball": types.mjJNT_BALL}
        joint = self.nodes[parent].add_joint(
            name=str(len(self.links)),
            type=kinds[link.move],
            pos=list(offset),
            axis=list(link.axis),
            armature=1.0,  # otherwise MuJoCo warns about hinges in line
        )
        self.links.append(joint)

    def make_frame(self, body: int, offset: Array) -> Any:
        return self.nodes[body].add_site(name=str(len(self.spec.sites)), pos=list(offset))

    def close(self, closure: Closure) -> None:
        joint, bodies = closure.joint, self.bodies_of(closure)
        ends = zip(bodies, map(np.array, closure.points), strict=True)
        sites = [self.make_frame(body, point) for body, point in ends]
        names, types = [site.name for site in sites], self.mj.mjtEq
        if isinstance(joint, Distance):
            kind, length = "tendon", joint.rod_length
            tendon = self.spec.add_tendon(name=joint.name)
            for name in names:
                tendon.wrap_site(name)
            equality = self.spec.add_equality(type=types.mjEQ_TENDON, name1=joint.name)
            # the length is its design value plus a polynomial of another tendon; without one, only
            # the constant counts
            change = length - joint.design_distance
            equality.data = [change, *[0.0] * (len(equality.data) - 1)]
        else:
            kind, length = "connect" if closure.by is Spherical else "weld", 0.0
            # the default data are kept: they hold the scale of a weld's rotation rows
            self.spec.add_equality(
                type=types.mjEQ_CONNECT if kind == "connect" else types.mjEQ_WELD,
                name1=names[0],
                name2=names[1],
                objtype=self.mj.mjtObj.mjOBJ_SITE,
            )
        aside = " to an auxiliary body that carries the joint's slides and hinges"
        self.closures[joint.name] = kind + (aside if closure.links else "")
        self.equalities.append(Equality(kind, joint.name, bodies, sites, length))

    def relate(self, relation: Relation) -> None:
        if len(relation.terms) > 2:
            self._sum(relation)
            return
        if relation.curve and relation.curve.knots:  # MuJoCo has powers up to the fourth
            super().relate(relation)
            return
        *ends, function = relation.follower(signed=True)
        (curve,) = function.powers
        names = [self.coordinates[end][0] for end in ends]
        one, other = map(" ".join, ends)
        equality = self.spec.add_equality(
            type=self.mj.mjtEq.mjEQ_JOINT,
            name1=names[0],
            name2=names[1],
            objtype=self.mj.mjtObj.mjOBJ_JOINT,
        )
        equality.data = [*curve, *[0.0] * len(equality.data)][: len(equality.data)]
        if relation.curve:
            self.relations.append(f"joint equality: {one} is a polynomial of {other}")
            found = Equality("joint", relation, follows=names[1], curve=curve)
        else:
            self.relations.append(f"joint equality: {one} = {curve[1]:.9g} {other}")
            found = Equality("joint", relation)
        self.equalities.append(found)

    def _sum(self, relation: Relation) -> None:
        """Keep the length of a fixed tendon, the weighted sum of coordinates."""
        name = f"{relation.name}.sum{len(self.equalities)}"
        tendon = self.spec.add_tendon(name=name)
        for (joint, freedom, weight), sign in zip(relation.terms, relation.signs, strict=True):
            tendon.wrap_joint(self.coordinates[joint, freedom][0], sign * weight)
        equality = self.spec.add_equality(type=self.mj.mjtEq.mjEQ_TENDON, name1=name)
        equality.data = [0.0] * len(equality.data)
        self.relations.append(f"tendon equality: a sum of {len(relation.terms)} coordinates")
        self.equalities.append(Equality("joint", relation))

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        self.spec.option.gravity, self.masses = list(gravity), masses

    def finish(self) -> None:
        m = self.m = self.spec.compile()
        self.d = self.mj.MjData(m)
        for frame in self.frames:
            if frame.handle is not None:
                frame.handle = int(m.site(frame.handle.name).id)
        for equality in self.equalities:
            equality.sites = [int(m.site(site.name).id) for site in equality.sites]
            self.own.append((ROWS[equality.kind], equality.keeps))
        if self.equalities:
            self.conditions.insert(0, Equalities(self, self.own_count))
        if self.loaded:
            self._weigh()

    def _weigh(self) -> None:
        m = self.m
        m.body_mass[:] = 0.0
        m.body_inertia[:] = 0.0
        for each in self.masses:
            body = m.body(self.nodes[each.frame.body].name).id
            mass, center, inertia = mass_properties(each.body, np.zeros(3))
            principal, axes = np.linalg.eigh(inertia)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            m.body_mass[body], m.body_ipos[body], m.body_inertia[body] = mass, center, principal
            self.mj.mju_mat2Quat(m.body_iquat[body], axes.ravel())
            # otherwise MuJoCo uses the body frame as the frame of its inertia
            m.body_sameframe[body] = int(self.mj.mjtSameFrame.mjSAMEFRAME_NONE)

    @property
    def unknowns(self) -> int:
        return self.m.nv

    def coordinate(self, body: Any) -> tuple[int, int]:
        joint = self.m.joint(body)
        return int(joint.qposadr[0]), int(joint.dofadr[0])

    def design(self) -> Array:
        return np.array(self.m.qpos0)

    def configuration_after(self, dx: Array) -> Array:
        q = self.q.copy()
        self.mj.mj_integratePos(self.m, q, dx, 1.0)
        return q

    def place(self) -> None:
        mj, m, d = self.mj, self.m, self.d
        d.qpos[:] = self.q
        mj.mj_kinematics(m, d)
        mj.mj_comPos(m, d)
        mj.mj_tendon(m, d)
        mj.mj_makeConstraint(m, d)

    def rate(self, v: Array, a: Array) -> None:
        self.d.qvel[:], self.d.qacc[:] = v, a
        self.mj.mj_comVel(self.m, self.d)

    def placement(self, handle: int) -> tuple[Array, Array]:
        # the frame of every body is parallel to the global axes at design
        turned = self.d.xmat[self.m.site_bodyid[handle]]
        return np.array(self.d.site_xpos[handle]), np.array(turned).reshape(3, 3)

    def slope(self, handle: int) -> Array:
        J = np.zeros((6, self.m.nv))
        self.mj.mj_jacSite(self.m, self.d, J[:3], J[3:], handle)
        return J

    def motion(self, handle: int) -> tuple[Array, Array]:
        J, J_t = self.slopes(handle, 6)
        return J @ self.d.qvel, J @ self.d.qacc + J_t @ self.d.qvel

    def slopes(self, site: int, n: int) -> Array:
        """Return the Jacobian of a site and its rate, shape (2, n, unknowns); n is 3 for its point
        alone, else 6.
        """
        m, d = self.m, self.d
        J, J_t = found = np.zeros((2, n, m.nv))
        turns = (J[3:], J_t[3:]) if n > 3 else (None, None)
        self.mj.mj_jacSite(m, d, J[:3], turns[0], site)
        self.mj.mj_jacDot(m, d, J_t[:3], turns[1], d.site_xpos[site], m.site_bodyid[site])
        return found

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        mj, m, d = self.mj, self.m, self.d
        self.rate(v, a)
        found = np.zeros(m.nv)
        mj.mj_rne(m, d, 1, found)
        d.efc_force[:] = 0.0  # forces of soft constraints, which `cfrc_int` would include
        mj.mj_rnePostConstraint(m, d)
        return found

    def passed_on(self, body: int, point: Array) -> Array:
        node = self.m.body(self.nodes[body].name).id
        moment, force = np.split(np.array(self.d.cfrc_int[node]), 2)
        center = np.array(self.d.subtree_com[self.m.body_rootid[node]])
        return np.concatenate([force, moment + np.cross(center - point, force)])

    def row_wrenches(self) -> list[RowWrench]:
        found = super().row_wrenches()
        for each, (rows, _) in zip(self.equalities, self.own_rows, strict=True):
            if each.kind == "joint":
                continue
            on_first = self._on_first(each)
            for body, site, wrenches in zip(
                each.bodies, each.sites, (on_first, -on_first), strict=True
            ):
                found.append(RowWrench(rows, body, np.array(self.d.site_xpos[site]), wrenches))
        return found

    def _on_first(self, equality: Equality) -> Array:
        """Return the wrenches on the first body, about either site: the sites coincide, or the
        force acts along their line.
        """
        (i, j), d, none = equality.sites, self.d, np.zeros((3, 3))
        if equality.kind == "tendon":
            span = d.site_xpos[i] - d.site_xpos[j]
            return np.concatenate([span / np.sqrt(span @ span), np.zeros(3)])[None]
        forces = np.hstack([np.eye(3), none])
        if equality.kind == "connect":
            return forces
        axes = np.array(d.xmat[self.m.site_bodyid[j]]).reshape(3, 3).T
        return np.vstack([forces, np.hstack([none, 0.5 * axes])])


class Equalities:
    """The rows of all equalities; see `constraints.Condition`."""

    def __init__(self, of: MuJoCoModel, n: int) -> None:
        self.of, self.n = of, n
        counts = [ROWS[each.kind] for each in of.equalities]
        self.owner = np.repeat(np.arange(len(counts)), counts)
        owners = [of.equalities[k] for k in self.owner]
        self.tendons = [
            (row, *each.sites) for row, each in enumerate(owners) if each.kind == "tendon"
        ]
        # joints that follow a polynomial: row, the other's place in q and in v, second derivative
        self.bent = [
            (row, *of.coordinate(each.follows), Polynomial(each.curve).deriv(2))
            for row, each in enumerate(owners)
            if each.follows
        ]
        self.present: Any = slice(n)  # rows that MuJoCo has not left out

    def rows(self) -> tuple[Any, Array]:
        m, d = self.of.m, self.of.d
        if d.ne == self.n:
            self.present = slice(self.n)
            return d.efc_pos, d.efc_J.reshape(-1, m.nv)[: self.n]
        # MuJoCo leaves out an equality while its Jacobian is zero; the others keep their order, and
        # efc_J its full length
        self.present = np.flatnonzero(np.isin(self.owner, d.efc_id))
        phi, J = np.zeros(self.n), np.zeros((self.n, m.nv))
        phi[self.present], J[self.present] = d.efc_pos, d.efc_J.reshape(-1, m.nv)[: d.ne]
        for k in {*range(len(self.of.equalities))}.difference(d.efc_id.tolist()):
            phi[self.owner == k] = self.gap(self.of.equalities[k])
        return phi, J

    def gap(self, equality: Equality) -> Array | float:
        """Return the residual of an equality without rows in MuJoCo; a weld is left out only
        between parts of one rigid body, so its residual is zero.
        """
        if equality.kind == "weld":
            return 0.0
        i, j = equality.sites
        span = self.of.d.site_xpos[i] - self.of.d.site_xpos[j]
        return span if equality.kind == "connect" else math.sqrt(span @ span) - equality.length

    def bias(self) -> Any:
        of, d, b = self.of, self.of.d, np.zeros(self.n)
        of.mj.mj_referenceConstraint(of.m, d)
        # aref = -(B vel + K I pos) - Jdot v; an absent connect or weld never opens, so its Jdot v
        # is zero
        stiffness, damping, impedance, _ = d.efc_KBIP.reshape(-1, 4).T
        b[self.present] = -(d.efc_aref + damping * d.efc_vel + stiffness * impedance * d.efc_pos)
        for row, i, j in self.tendons:
            span = d.site_xpos[j] - d.site_xpos[i]
            apart, turned = (of.slopes(j, 3) - of.slopes(i, 3)) @ d.qvel
            length = math.sqrt(span @ span)
            b[row] = (apart @ apart - (span @ apart / length) ** 2 + span @ turned) / length
        for row, place, rate, bend in self.bent:
            b[row] = -bend(d.qpos[place]) * d.qvel[rate] ** 2
        return b
