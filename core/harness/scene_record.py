"""The mechanism of a case as results hold it for drawing."""

from __future__ import annotations

import msgspec

from ..tabular import notebook


class SceneBody(msgspec.Struct, frozen=True, kw_only=True):
    """A body for drawing: its axes at the design, and in every frame of the scene.

    Attributes:
        origin, euler_parameters: at the design, global [m, -].
        r: origins, global [m], shape (frames, 3); empty if only the design is known, or the body is
            fixed.
        p: Euler parameters e0..e3, body -> global [-], shape (frames, 4); empty if r is.
    """

    name: str
    fixed: bool
    origin: list[float]
    euler_parameters: list[float]
    r: list[list[float]] = []
    p: list[list[float]] = []


class SceneJoint(msgspec.Struct, frozen=True, kw_only=True):
    """A joint's geometry, global at the design [m].

    Attributes:
        bodies: names of the first and the second body.
        points: none, one common to both bodies, or one on each.
        axes: directions of any length: none, one common to both bodies, or one on each.
        far: another place on the axis that the file states, such as the second pivot of an arm;
            empty without one.
    """

    name: str
    type: str
    bodies: list[str]
    points: list[list[float]] = []
    axes: list[list[float]] = []
    far: list[float] = []


class SceneSpring(msgspec.Struct, frozen=True, kw_only=True):
    """A spring or a damper between two bodies.

    Attributes:
        kind: "spring", "damper" or "both".
        bodies: names of the first and the second body.
        points: one on each, global at the design [m].
    """

    kind: str
    bodies: list[str]
    points: list[list[float]]


class ScenePoint(msgspec.Struct, frozen=True, kw_only=True):
    """A named point of a body, global at the design [m].

    Attributes:
        output: whether an output uses the point.
    """

    name: str
    body: str
    position: list[float]
    output: bool


class SceneWheel(msgspec.Struct, frozen=True, kw_only=True):
    """A wheel, global at the design.

    Attributes:
        body: the wheel carrier.
        center: wheel centre [m].
        spin, up: unit vectors along the axis of rotation and away from the road [-].
        radius: from the wheel centre to the contact centre [m].
        kingpin: names of the lower and the upper point of the steering axis; empty without two.
        middle: a point of the vehicle's centre plane [m], if the sweep moves the wheels' travel
            alone, so that its motion has a roll centre; otherwise empty.
    """

    body: str
    center: list[float]
    spin: list[float]
    up: list[float]
    radius: float
    kingpin: list[str] = []
    middle: list[float] = []


class SceneForce(msgspec.Struct, frozen=True, kw_only=True):
    """A force measured by an output along one direction.

    Attributes:
        output: the output with the values of the force [N].
        name: the joint or driver.
        body: the body that the force acts on.
        position: the point of this body at which the force acts, global at the design [m].
        direction: global unit vector [-].
    """

    output: str
    name: str
    body: str
    position: list[float]
    direction: list[float]


class Scene(msgspec.Struct, frozen=True, kw_only=True):
    """A case's mechanism for drawing. Poses are rounded for the screen, and never compared.

    Attributes:
        wheels: wheels of suspension outputs with a known radius.
        forces: outputs of joints' forces and of the efforts of driven points.
        frames: indices of the samples with poses; empty if only the design position is known.
        message: empty, or the reason for samples without a pose.
    """

    bodies: list[SceneBody]
    joints: list[SceneJoint]
    points: list[ScenePoint]
    wheels: list[SceneWheel] = []
    springs: list[SceneSpring] = []
    forces: list[SceneForce] = []
    frames: list[int] = []
    message: str = ""

    def view(self, title: str) -> str:
        """Return the motion for a notebook."""
        return notebook("scene", title, self)
