"""Drawings of a scene for the page: hardpoints by body, links within a body, rods between bodies.

Hardpoints are in body coordinates; the page places them by the poses of the body frames.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any, TypeAlias

import msgspec

from ..algebra import Vec3, quat, rotation_less_identity, vec
from ..errors import sentence
from ..harness.scene_record import Scene, SceneBody, SceneForce, SceneJoint, SceneWheel
from ..joints.base import unit
from ..mechanism.mechanism import GROUND
from .axis import Axis
from .figures import COLOURS

MARKS = {
    "revolute": "hinge",
    "screw": "hinge",
    "cylindrical": "slide",
    "translational": "slide",
    "spherical": "ball",
    "universal": "cross",
    "constant_velocity": "cross",
}
"""Mark of a joint by its type; other types get a general mark."""

# Up to this many hardpoints of a body are linked pairwise, as arms are drawn; more are linked to a
# hub.
ALL_JOINED = 4
# Hardpoints of one body closer than this are one point [m]: tables have at best a tenth of a
# millimetre.
SAME = 1e-6


Numbers: TypeAlias = list[float]
Nodes: TypeAlias = tuple[int, int]
Wheel: TypeAlias = tuple[int, Numbers, Numbers, Numbers, float, list[int], Numbers]


class Drawing(msgspec.Struct):
    """A drawing as the page's script reads it; a node is an index of `nodes`, a body an index of
    `bodies`.

    Attributes:
        bodies: name, whether fixed, number of the colour, place of the axes (body frame), and
            poses: origins r [m] and Euler parameters p, one for each frame of the scene or one
            only. Bodies that mirror each other have one colour.
        nodes: body, and x, y, z in its frame [m].
        links: two nodes of one body.
        rods: two nodes of two bodies.
        marks: node, kind of mark, axis in the body's frame or null, whether the joint is on a fixed
            body.
        labels: two nodes, and the text between them.
        springs: two nodes, and "spring", "damper" or "both".
        tubes: a node of a slide, and a place on its axis as far as its file states [m].
        wheels: body, centre [m] and axis of rotation in its frame, global upward direction, radius
            [m], nodes of the steering axis and a point of the vehicle's centre plane; empty if
            there are none.
        arrows: body, place in its frame [m], label, and global force in each frame of the scene;
            null if unknown.
        unit: of the arrows: N, or that of lengths, if they are moves of points.
        paths: nodes whose path over the frames is drawn.
        steps: the caption of each frame.
        start: the frame closest to the design position, which is shown first.
        joints: name, type and bodies of every joint, as text.
        caption: the source of the poses, or the reason why there are none.
    """

    bodies: list[dict[str, Any]] = []
    nodes: list[tuple[int, float, float, float]] = []
    links: list[Nodes] = []
    rods: list[Nodes] = []
    marks: list[tuple[int, str, Numbers | None, bool]] = []
    labels: list[tuple[int, int, str]] = []
    springs: list[tuple[int, int, str]] = []
    tubes: list[Nodes] = []
    wheels: list[Wheel] = []
    arrows: list[tuple[int, Numbers, str, list[Numbers | None]]] = []
    unit: str = "N"
    paths: list[int] = []
    steps: list[str] = []
    start: int = 0
    joints: list[tuple[str, str, str]] = []
    caption: str = ""


def drawing(
    scene: Scene, axis: Axis, outputs: Mapping[str, Sequence[float | None]] | None = None
) -> Drawing:
    """Return the drawing of a scene; the values of the axis name its frames.

    Args:
        outputs: values over the samples, for the arrows of forces, by output.
    """
    made = _Draughtsman(scene, axis)
    made.add_arrows(outputs or {})
    return made.drawn


class _Draughtsman:
    def __init__(self, scene: Scene, axis: Axis) -> None:
        ground = SceneBody(
            name=GROUND, fixed=True, origin=[0.0, 0.0, 0.0], euler_parameters=[1.0, 0.0, 0.0, 0.0]
        )
        self.scene = scene
        self.bodies = [ground, *scene.bodies]
        self.numbers = {body.name: k for k, body in enumerate(self.bodies)}
        self.kinds = [*dict.fromkeys(_kind(body) for body in self.bodies if not body.fixed)]
        self.drawn = Drawing()
        for joint in scene.joints:
            self._joint(joint)
        for point in scene.points:
            node = self._node(point.body, point.position)
            self._label(node, node, point.name)
            if point.output and scene.frames:
                self.drawn.paths.append(node)
        for spring in scene.springs:
            ends = zip(spring.bodies, spring.points, strict=True)
            first, second = (self._node(*end) for end in ends)
            self.drawn.springs.append((first, second, spring.kind))
        self.drawn.wheels = [self._wheel(wheel) for wheel in scene.wheels]
        self.drawn.bodies = [self._body(k) for k in range(len(self.bodies))]
        self.drawn.steps = [f"sample {k} · {axis.at(k)}".removesuffix(" · ") for k in scene.frames]
        self.drawn.start = min(range(len(scene.frames)), key=self._from_design, default=0)
        solved = (
            f"Poses at {len(scene.frames)} of {len(axis.values)} samples, by the native solver. "
            if scene.frames
            else ""
        )
        self.drawn.caption = solved + (f"{sentence(scene.message)}." if scene.message else "")

    def add_arrows(self, outputs: Mapping[str, Sequence[float | None]]) -> None:
        """Add one arrow for all components of a joint or driver along global axes, and one for each
        other direction.
        """
        groups: dict[str, list[SceneForce]] = {}
        for force in self.scene.forces:
            along_axis = sum(map(bool, force.direction)) == 1
            if force.output in outputs:
                groups.setdefault(force.name if along_axis else force.output, []).append(force)
        for name, forces in groups.items():
            vectors = [
                _sum(forces, [outputs[force.output][frame] for force in forces])
                for frame in self.scene.frames
            ]
            body, place = self._local(forces[0].body, forces[0].position)
            self.drawn.arrows.append((body, place, name, vectors))

    def _local(self, body: str, position: Sequence[float]) -> tuple[int, Numbers]:
        """Return the number of a body, and a point of it in its frame [m]."""
        number = self.numbers[body]
        arm = vec(position) - vec(self.bodies[number].origin)
        return number, list(_in_body(self.bodies[number], arm))

    def _wheel(self, wheel: SceneWheel) -> Wheel:
        number, center = self._local(wheel.body, wheel.center)
        spin = list(_in_body(self.bodies[number], vec(wheel.spin)))
        points = {point.name: point for point in self.scene.points}
        ends = [self._node(points[name].body, points[name].position) for name in wheel.kingpin]
        return number, center, spin, wheel.up, wheel.radius, ends, wheel.middle

    def _from_design(self, frame: int) -> float:
        """Return the distance of the bodies from the design position [m + -], to compare frames."""
        posed = [body for body in self.bodies if body.r]
        return sum(
            math.dist(each.r[frame], each.origin) + math.dist(each.p[frame], each.euler_parameters)
            for each in posed
        )

    def _node(self, body: str, position: Sequence[float]) -> int:
        """Return the hardpoint of a body at a position, a new one if there is none."""
        number, local = self._local(body, position)
        for k, (other, *place) in enumerate(self.drawn.nodes):
            if other == number and all(
                abs(a - b) < SAME for a, b in zip(place, local, strict=True)
            ):
                return k
        x, y, z = local
        self.drawn.nodes.append((number, x, y, z))
        return len(self.drawn.nodes) - 1

    def _joint(self, joint: SceneJoint) -> None:
        i, j = joint.bodies
        self.drawn.joints.append((joint.name, joint.type.replace("_", " "), f"{i} – {j}"))
        if not joint.points:
            return  # the joint has directions only, and no position
        first, second = self._node(i, joint.points[0]), self._node(j, joint.points[-1])
        if len(joint.points) > 1:
            self._label(first, second, joint.name)
            self.drawn.rods.append((first, second))
            self._mark(first, "end", None, i)
            self._mark(second, "end", None, j)
        else:
            self._label(first, first, joint.name)
            axis = (
                list(_in_body(self.bodies[self.numbers[i]], unit(joint.axes[0])))
                if joint.axes
                else None
            )
            kind = MARKS.get(joint.type, "other")
            self._mark(first, kind, axis, i, j)
            if joint.far and kind == "slide":
                self.drawn.tubes.append((first, self._node(j, joint.far)))
            elif joint.far:
                self._node(j, joint.far)
                self._mark(self._node(i, joint.far), kind, axis, i, j)

    def _mark(self, node: int, kind: str, axis: Numbers | None, *bodies: str) -> None:
        self.drawn.marks.append(
            (node, kind, axis, any(self.bodies[self.numbers[name]].fixed for name in bodies))
        )

    def _label(self, a: int, b: int, text: str) -> None:
        """Add a label; texts at the same place share one."""
        for k, (*place, label) in enumerate(self.drawn.labels):
            if place == [a, b]:
                if text not in label.split(" · "):
                    self.drawn.labels[k] = (a, b, f"{label} · {text}")
                return
        self.drawn.labels.append((a, b, text))

    def _body(self, number: int) -> dict[str, Any]:
        """Return a body for the page; link the hardpoints of a moving body, a single one to a given
        origin.
        """
        body = self.bodies[number]
        if not body.fixed:
            own = [wheel for wheel in self.drawn.wheels if wheel[0] == number]
            mine = [
                k
                for k, (other, *place) in enumerate(self.drawn.nodes)
                if other == number
                # a place on the road belongs to the tyre
                and not any(
                    abs(math.dist(place, at) - high) < SAME for _, at, _, _, high, *_ in own
                )
            ]
            # the global origin is the default, not a given origin
            if len(mine) == 1 and any(body.origin):
                mine = sorted({*mine, self._node(body.name, body.origin)})
            self._link(number, mine)
        frame = self._frame([vec(place) for other, *place in self.drawn.nodes if other == number])
        r, p = body.r or [body.origin], body.p or [body.euler_parameters]
        colour = 0 if body.fixed else self.kinds.index(_kind(body)) % len(COLOURS)
        facts = {"name": body.name, "fixed": body.fixed, "colour": colour}
        return {**facts, "frame": frame, "r": r, "p": p}

    def _link(self, number: int, nodes: Sequence[int]) -> None:
        if len(nodes) <= ALL_JOINED:
            self.drawn.links += combinations(nodes, 2)
            return
        self.drawn.nodes.append((number, *_middle([vec(self.drawn.nodes[k][1:]) for k in nodes])))
        self.drawn.links += [(k, len(self.drawn.nodes) - 1) for k in nodes]

    def _frame(self, hardpoints: Sequence[Vec3]) -> list[float]:
        """Return the place of a body's axes: its origin, or the middle of its hardpoints if the
        origin is far from them.
        """
        if not hardpoints:
            return [0.0, 0.0, 0.0]
        middle = _middle(hardpoints)
        reach = max(math.dist([*point], middle) for point in hardpoints)
        return [0.0, 0.0, 0.0] if math.hypot(*middle) <= reach + SAME else [*middle]


def _kind(body: SceneBody) -> str:
    """Return the name of a body without the side of an axle."""
    return body.name.removeprefix("left_").removeprefix("right_")


def _sum(forces: Sequence[SceneForce], values: Sequence[float | None]) -> Numbers | None:
    """Return the vector of components along their directions [N]; None if one is unknown."""
    known = [value for value in values if value is not None and math.isfinite(value)]
    if len(known) < len(values):
        return None
    parts = zip(known, forces, strict=True)
    products = [[value * x for x in force.direction] for value, force in parts]
    return [float(f"{sum(each):.4g}") for each in zip(*products, strict=True)]


def _middle(points: Sequence[Vec3]) -> tuple[float, float, float]:
    x, y, z = (sum(values) / len(points) for values in zip(*points, strict=True))
    return x, y, z


def _in_body(body: SceneBody, a: Vec3) -> tuple[float, float, float]:
    """Return a vector given globally at the design, in the body's frame."""
    x, y, z = a + rotation_less_identity(quat(body.euler_parameters).conjugate()) @ a
    return x, y, z
