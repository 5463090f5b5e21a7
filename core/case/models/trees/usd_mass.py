"""Masses of bodies of USD, by their own properties or by their colliders.

A mass outranks a density, and a body outranks its colliders, from which all comes that it does not
give.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ....algebra import ZERO, quat, vec
from ....errors import CaseError
from .element import Element
from .mjcf_mass import WATER, solid
from .place import Place, turn_to, unit_quaternion
from .tree import Mass, together
from .usd_joints import AXES

FrameOf: TypeAlias = Callable[[Element], tuple[Place, Sequence[float]]]
"""Global place of a prim [m], and its scales."""
COLLIDER = "PhysicsCollisionAPI"
# Radius and height of shapes unless given, in units of the stage.
SHAPES = {"Cube": (2.0, 0.0), "Sphere": (1.0, 0.0), "Cylinder": (1.0, 2.0), "Capsule": (0.5, 1.0)}
# Radii across an axis are alike to single precision.
_ALIKE = 1e-6


def masses_of(
    bodies: Mapping[str, Element],
    colliders: Mapping[str, Sequence[Element]],
    prims: Mapping[str, Element],
    frame_of: FrameOf,
    units: tuple[float, float],
) -> dict[str, Mass | None]:
    """Return the masses of bodies in their frames; None of one that cannot be read.

    Args:
        bodies: by name.
        colliders: in each of them.
        prims: by path, for materials.
        units: of length and mass of the stage [m, kg].
    """
    reader = _Masses(prims, frame_of, *units)
    found: dict[str, Mass | None] = {}
    for name, body in bodies.items():
        said = body.attributes
        if not (colliders.get(name) or "physics:mass" in said or "physics:density" in said):
            continue
        try:
            found[name] = reader.of(body, colliders.get(name, ()))
        except CaseError:  # motion needs none
            found[name] = None
    return found


class _Masses:
    def __init__(
        self, prims: Mapping[str, Element], frame_of: FrameOf, metre: float, kilogram: float
    ) -> None:
        self.prims, self.frame_of, self.metre, self.kilogram = prims, frame_of, metre, kilogram

    def of(self, body: Element, colliders: Sequence[Element]) -> Mass | None:
        """Return the mass of a body."""
        place, scales = self.frame_of(body)
        mass = self.kilogram * body.number("physics:mass", 0.0)
        center, moments = ZERO, body.numbers("physics:diagonalInertia", 3, default=(0.0,) * 3)
        said = body.attributes.get("physics:centerOfMass", "-inf")
        has_center, has_moments = "inf" not in said, min(moments) > 0.0
        if not (mass > 0.0 and has_center and has_moments):
            parts = [self._part(body, each, place) for each in colliders]
            whole = together(parts)
            if not whole.mass > 0.0:
                return None
            mass = mass if mass > 0.0 else whole.mass
            center, inertia = whole.center, (mass / whole.mass) * whole.inertia
        else:
            inertia = np.zeros((3, 3))
        if has_center:
            at = body.numbers("physics:centerOfMass", 3)
            center = self.metre * vec([s * x for s, x in zip(scales, at, strict=True)])
        if not has_moments:
            return Mass(mass, center, inertia)
        axes = body.numbers("physics:principalAxes", 4, default=(1.0, 0.0, 0.0, 0.0))
        turn = unit_quaternion(quat(axes if any(axes) else (1.0, 0.0, 0.0, 0.0)))
        unit = self.kilogram * self.metre**2
        return Mass(mass, ZERO, unit * np.diag(moments)).seen_in(Place(center, turn))

    def _part(self, body: Element, shape: Element, around: Place) -> Mass:
        """Return the mass of a collider in the frame of its body.

        Raises:
            CaseError: its volume is not known.
        """
        place, scales = self.frame_of(shape)
        kind = shape.tag
        if kind not in SHAPES:
            raise shape.fault("is no simple shape, expected one; give the mass of the body")
        sizes = [self.metre * scale for scale in scales]
        radius, height = SHAPES[kind]
        axis = AXES[shape.choice("axis", (*AXES,), "Z")]
        if kind == "Cube":
            half = 0.5 * shape.number("size", radius)
            volume, moments = solid("box", [half * size for size in sizes])
        elif kind == "Sphere":
            radius = shape.number("radius", radius)
            volume, moments = solid("ellipsoid", [radius * size for size in sizes])
        else:
            along = [*axis].index(1.0)
            across = [size for k, size in enumerate(sizes) if k != along]
            if not math.isclose(*across, rel_tol=_ALIKE) or (
                kind == "Capsule" and not math.isclose(across[0], sizes[along], rel_tol=_ALIKE)
            ):
                raise shape.fault("is no round shape after scaling, expected one; scale it evenly")
            lengths = (
                shape.number("radius", radius) * across[0],
                0.5 * shape.number("height", height) * sizes[along],
            )
            volume, moments = solid(kind.lower(), lengths)
            place = place.then(Place(turn=turn_to(axis)))
        own = 0.0 if shape is body else self.kilogram * shape.number("physics:mass", 0.0)
        mass = own if own > 0.0 else volume * self._density(body, shape)
        return Mass(mass, ZERO, mass * np.diag(moments)).seen_in(place.seen_from(around))

    def _density(self, body: Element, shape: Element) -> float:
        """Return the density of a collider [kg/m^3]."""
        bound = (shape.attributes.get(f"material:binding{end}", "") for end in (":physics", ""))
        materials = [self.prims[path] for path in bound if path in self.prims]
        for each in (body, shape, *materials):
            if (density := each.number("physics:density", 0.0)) > 0.0:
                return density * self.kilogram / self.metre**3
        return WATER
