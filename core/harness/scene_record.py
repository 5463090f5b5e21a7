"""The mechanism of a case as results keep it for drawing."""

from __future__ import annotations

import msgspec


class SceneBody(msgspec.Struct, frozen=True, kw_only=True):
    """A body as drawn: its frame at the design, and in every frame of the scene.

    Attributes:
        origin, euler_parameters: at the design, global [m, -].
        r: origins, global [m], shape (frames, 3); empty if only the design is known, or the body is
            fixed.
        p: Euler parameters e0..e3, body -> global [-], shape (frames, 4); empty as r.
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
    """

    name: str
    type: str
    bodies: list[str]
    points: list[list[float]] = []
    axes: list[list[float]] = []


class ScenePoint(msgspec.Struct, frozen=True, kw_only=True):
    """A named point of a body, global at the design [m].

    Attributes:
        output: whether an output reads the point.
    """

    name: str
    body: str
    position: list[float]
    output: bool


class Scene(msgspec.Struct, frozen=True, kw_only=True):
    """A case's mechanism as drawn. Poses are rounded for the screen, and never compared.

    Attributes:
        frames: indices of the samples with poses; empty if only the design position is known.
        message: empty, or the reason why samples have no pose.
    """

    bodies: list[SceneBody]
    joints: list[SceneJoint]
    points: list[ScenePoint]
    frames: list[int] = []
    message: str = ""
