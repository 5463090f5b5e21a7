"""A mechanism as a model specification of MuJoCo; private to its adapter.

Every body frame coincides with the global frame at design, so the geometry of a case is used
unchanged. A joint is a chain of MuJoCo joints (see `joint_chains`). In the spanning tree it
connects its two bodies. A cut joint carries an auxiliary body on its first body, and one equality
constraint with its second body closes the loop: a connect if the chain ends in a ball, else a weld;
a distance is a tendon over two sites. These rows have full rank if the joint's own rows have; two
connects on the axis of a revolute would not. So every joint has its coordinates, in the tree or
not, and joint equalities relate them to one another.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ...core.joints import Coupler, Distance, Joint
from ...core.mechanism.mechanism import GROUND, Mechanism, spanning_tree
from ..shared.joint_chains import (
    CHAINS,
    Link,
    dependence,
    end_of_loop,
    free,
    polynomial_in_tree,
    relations,
)
from ..shared.loop_closures import near
from ..shared.poses import middle

JOINTS = (*CHAINS, Distance)
"""The supported joint types, exactly these: a subclass may have another meaning."""


def coordinate(joint: str, name: str) -> str:
    """Return the name of a joint's coordinate in the model."""
    return f"{joint} {name}"


@dataclass(frozen=True, slots=True)
class Equality:
    """An equality constraint and the two sites it ties (the compiled model has their ids), the
    first on the joint's first body; length of a tendon [m].

    Attributes:
        follows, curve: the joint that the constraint follows by a polynomial, and the polynomial.
        joint: the cut joint; empty for a relation.
        terms: joint and freedom of the coordinates in a relation.
    """

    kind: str
    ends: tuple[Any, ...] = ()
    length: float = 0.0
    follows: str = ""
    curve: tuple[float, ...] = ()
    joint: str = ""
    terms: tuple[tuple[str, str], ...] = ()


class Sketch:
    """A mechanism as an MjSpec. The spec is compiled directly, because its XML text has only six
    digits.
    """

    def __init__(self, mj: Any, mechanism: Mechanism) -> None:
        self.mj, self.mechanism = mj, mechanism
        self.spec = mj.MjSpec()
        self.spec.option.gravity = [0.0, 0.0, 0.0]
        self.spec.option.jacobian = mj.mjtJacobian.mjJAC_DENSE
        # autoreset would replace a diverged pose by the design pose
        self.spec.option.disableflags |= (
            mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_AUTORESET
        )
        fixed = [GROUND, *(body.name for body in mechanism.bodies if body.fixed)]
        self.bodies = dict[str, Any].fromkeys(fixed, self.spec.worldbody)
        self.closures: list[Equality] = []
        self.tree: dict[str, str] = {}  # carrier of each body
        self.means: dict[str, str] = {}  # equality of each cut joint
        self.relations: list[str] = []  # relations between coordinates
        # sign of a joint's coordinate: minus if it moves the joint's first body
        self.signs: dict[str, float] = {}
        self.children: dict[str, str] = {}  # joint of the tree -> the body that it carries
        tree = spanning_tree(mechanism)
        for branch in tree.branches:
            body = self.bodies[branch.child] = self.body(self.bodies[branch.parent])
            self.tree[branch.child] = "free" if branch.joint is None else str(branch.joint)
            if branch.joint is None:
                # a tangent predicts a body best that turns about its middle
                x, y, z = middle(mechanism, mechanism.body(branch.child)).tolist()
                self.attach(body, free((x, y, z)))
                continue
            self.children[branch.joint.name] = branch.child
            if branch.child == branch.joint.j:
                self.carry(body, branch.joint, self.links(branch.joint))
            else:
                self.carry(body, branch.joint, self.links(branch.joint)[::-1], sign=-1.0)
        for joint in tree.cut:
            self.close(joint, self.bodies[joint.i], self.bodies[joint.j])
        for coupler in mechanism.couplers:
            if coupler.curve:
                self.bend(coupler)
            else:
                self.relate(
                    (joint, freedom, self.signs[joint] * weight)
                    for joint, freedom, weight in coupler.terms
                )

    def body(self, parent: Any) -> Any:
        """Add a body on its parent's frame.

        Mass and inertia do not affect kinematics, but MuJoCo requires them to be positive definite.
        """
        body = parent.add_body()
        body.mass, body.inertia, body.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
        return body

    def site(self, body: Any, position: Sequence[float]) -> Any:
        """Add a site to a body."""
        return body.add_site(name=str(len(self.spec.sites)), pos=list(position))

    def links(self, joint: Joint) -> list[Link]:
        """Return a joint's chain, from its first body to its second."""
        return CHAINS[type(joint)](joint, near(self.mechanism, joint))

    def attach(self, body: Any, links: Sequence[Link], joint: str = "") -> None:
        """Let a body move relative to its parent by links, in order from the parent.

        The armature, an inertia of each link alone, prevents MuJoCo's warning about hinges in line.
        """
        types = self.mj.mjtJoint
        kinds = {"slide": types.mjJNT_SLIDE, "hinge": types.mjJNT_HINGE, "ball": types.mjJNT_BALL}
        for link in links:
            name = coordinate(joint, link.name) if link.name else ""
            body.add_joint(
                name=name,
                type=kinds[link.move],
                pos=list(link.point),
                axis=list(link.axis),
                armature=1.0,
            )

    def carry(self, body: Any, joint: Joint, links: Sequence[Link], sign: float = 1.0) -> None:
        """Let a body move by a joint's links; the sign is minus if it is the joint's first
        body.
        """
        self.attach(body, links, joint.name)
        # all coordinates of the joint have the same sign, so their relations need none
        self.signs[joint.name] = sign
        for relation in relations(joint):
            self.relate(relation)

    def close(self, joint: Joint, i: Any, j: Any) -> None:
        """Express a cut joint of bodies i and j by an equality constraint."""
        if isinstance(joint, Distance):
            self.means[joint.name] = "tendon"
            self.span(joint, i, j)
            return
        links, point, turns = end_of_loop(self.links(joint), near(self.mechanism, joint))
        kind = "connect" if turns else "weld"
        self.means[joint.name] = kind
        if links:
            i = self.body(i)
            self.carry(i, joint, links)
            self.means[joint.name] = (
                f"{kind} to an auxiliary body that carries the joint's slides and hinges"
            )
        self.join(joint.name, kind, i, j, point)

    def span(self, rod: Distance, i: Any, j: Any) -> None:
        """Keep the rod's points on bodies i and j at its length."""
        ends = self.site(i, rod.points[0]), self.site(j, rod.points[1])
        tendon = self.spec.add_tendon(name=rod.name)
        for end in ends:
            tendon.wrap_site(end.name)
        equality = self.spec.add_equality(type=self.mj.mjtEq.mjEQ_TENDON, name1=rod.name)
        # the length is its design value plus a polynomial of another tendon; without one, only the
        # constant counts
        equality.data = [rod.rod_length - rod.design_distance, *[0.0] * (len(equality.data) - 1)]
        self.closures.append(Equality("tendon", ends, rod.rod_length, joint=rod.name))

    def relate(self, terms: Iterable[tuple[str, str, float]]) -> None:
        """Keep the weighted sum of two coordinates (joint, freedom, weight) at zero."""
        terms = list(terms)
        one, other, factor = dependence(
            (coordinate(joint, freedom), weight) for joint, freedom, weight in terms
        )
        self.follow(one, other, [0.0, factor], terms)
        self.relations.append(f"joint equality: {one} = {factor:.9g} {other}")

    def bend(self, coupler: Coupler) -> None:
        """Let the first coordinate, of weight one, follow the polynomial of the second."""
        *_, (_, _, weight) = coupler.terms
        one, other = (coordinate(joint, freedom) for joint, freedom, _ in coupler.terms)
        driven, driving = (self.signs[joint] for joint in coupler.joints)
        coefficients = polynomial_in_tree(weight, coupler.curve, driven, driving)
        self.follow(one, other, coefficients, coupler.terms, bent=True)
        self.relations.append(f"joint equality: {one} is a polynomial of {other}")

    def follow(
        self,
        one: str,
        other: str,
        coefficients: Sequence[float],
        terms: Iterable[tuple[str, str, float]],
        *,
        bent: bool = False,
    ) -> None:
        """Keep a coordinate at a polynomial of another; the constant is the first coefficient.

        Args:
            terms: joint, freedom and weight of both.
        """
        tied = tuple((joint, freedom) for joint, freedom, _ in terms)
        equality = self.spec.add_equality(type=self.mj.mjtEq.mjEQ_JOINT, name1=one, name2=other)
        equality.objtype = self.mj.mjtObj.mjOBJ_JOINT
        data = [*coefficients, *[0.0] * len(equality.data)]
        equality.data = data[: len(equality.data)]
        self.closures.append(
            Equality("joint", follows=other, curve=tuple(coefficients), terms=tied)
            if bent
            else Equality("joint", terms=tied)
        )

    def join(self, joint: str, kind: str, i: Any, j: Any, position: Sequence[float]) -> None:
        """Tie two bodies of a joint at a position.

        The default data are kept: they hold the scale of a weld's rotation rows.
        """
        ends = self.site(i, position), self.site(j, position)
        equality = {"connect": self.mj.mjtEq.mjEQ_CONNECT, "weld": self.mj.mjtEq.mjEQ_WELD}[kind]
        self.spec.add_equality(
            type=equality, name1=ends[0].name, name2=ends[1].name, objtype=self.mj.mjtObj.mjOBJ_SITE
        )
        self.closures.append(Equality(kind, ends, joint=joint))
