"""Masses of bodies: by their own numbers, or by the shapes that are seen or touched.

Of MJCF, an <inertial> outranks geoms. Of USD, a mass outranks a density, and a body outranks its
colliders, from which all comes that it does not give.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...algebra import ZERO, X, Y, Z, quat, vec
from ...case.io.document import usable
from ...errors import CaseError
from ...trajectory import Array
from ..xml.element import ZEROS, Element
from .mjcf_language import Classes, Compiler
from .place import Place, turn_to, unit_quaternion
from .tree import Mass, sum_of_masses

WATER = 1000.0
"""Density of geoms unless given, as water has [kg/m^3]."""
SHAPES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Geoms with a volume, and how many sizes they have."""
MASSLESS = ("plane", "hfield")
STAND_INS = "kincheck.stand_ins"
"""Name of the custom text of a model written by kincheck without masses."""


def mass_of(
    body: Element,
    parts: Sequence[tuple[Element, Place, str]],
    classes: Classes,
    compiler: Compiler,
) -> Mass | None:
    """Return the mass of a body in its frame; None without one.

    Args:
        parts: its content, with the places and the default classes of the frames it is given in.

    Raises:
        CaseError: a number or shape makes no sense, or a mesh has the mass.
    """
    if compiler.total > 0.0:
        raise body.fault("settotalmass: scales all masses, expected masses; write them out")
    inertials = [each for each in parts if each[0].tag == "inertial"]
    geoms = [each for each in parts if each[0].tag == "geom"]
    masses: list[Mass] = []
    from_geoms = compiler.from_geoms == "true" or (compiler.from_geoms == "auto" and not inertials)
    for element, at, within in geoms if from_geoms else ():
        complete = classes.complete(element, "geom", within)
        if (found := _geom(complete, compiler)) is not None:
            masses.append(found.in_frame(at * compiler.place(complete)))
    if inertials and not masses:  # no geom in the range of groups has one (measured: MuJoCo 4.0)
        element, at, _ = inertials[-1]
        found = _inertial(element)
        place = at * compiler.place(element)
        return None if found.is_stand_in else _within_bounds(found.in_frame(place), compiler)
    if not masses and any(compiler.least):
        # the least mass is at the body's own `pos`, in its own axes (measured: MuJoCo 4.0)
        masses.append(Mass(0.0, compiler.place(body).at, np.zeros((3, 3))))
    return _within_bounds(sum_of_masses(masses), compiler) if masses else None


def _inertial(element: Element) -> Mass:
    """Return the mass of an <inertial> in its own frame."""
    mass = element.number("mass")
    if mass < 0.0:
        raise element.fault("mass: is negative, expected a positive number of kg; correct it")
    if "fullinertia" in element.attributes:
        return Mass(mass, ZERO, inertia_of(element.numbers("fullinertia", 6)))
    moments = element.numbers("diaginertia", 3, default=ZEROS)
    return Mass(mass, ZERO, np.diag(moments))


def inertia_of(entries: Sequence[float]) -> Array:
    """Return the matrix of moments about x, y and z and products of xy, xz and yz [kg m^2]."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def mass_in(place: Place, mass: float, entries: Sequence[float]) -> Mass | None:
    """Return the mass of a link in its frame; None of a negative one.

    Args:
        place: centre of mass and axes of the inertia, in the frame of the link.
        entries: see `inertia_of`.
    """
    return Mass(mass, ZERO, inertia_of(entries)).in_frame(place) if mass >= 0.0 else None


def _geom(element: Element, compiler: Compiler) -> Mass | None:
    """Return the mass of a geom in its own frame; None without one."""
    kind = element.attributes.get("type", "sphere")
    first, last = map(int, compiler.groups)
    group, density = element.number("group", 0.0), element.number("density", WATER)
    mass = element.number("mass", math.nan)
    heavy = (density if math.isnan(mass) else mass) != 0.0
    if kind in MASSLESS or not first <= group <= last or not heavy:
        return None
    if kind not in SHAPES or "mesh" in element.attributes:
        raise element.fault("is a mesh, expected a simple shape; give <inertial>")
    if element.attributes.get("shellinertia") == "true":
        raise element.fault("shellinertia: is a shell, expected a solid; give <inertial>")
    volume, moments = solid(kind, _sizes(element, kind))
    mass = density * volume if math.isnan(mass) else mass
    if not (mass > 0.0 and volume > 0.0 and usable(mass)):
        raise element.fault("has a mass or size that is not positive or huge; correct it")
    return Mass(mass, ZERO, mass * np.diag(moments))


def _within_bounds(found: Mass, compiler: Compiler) -> Mass:
    """Return a mass within the bounds of the compiler."""
    if not (any(compiler.least) or compiler.balanced):
        return found
    moments, axes = np.linalg.eigh(found.inertia)
    moments = np.maximum(moments, compiler.least[1])
    if compiler.balanced and moments[2] > moments[0] + moments[1]:
        moments[:] = moments.mean()
    return Mass(max(found.mass, compiler.least[0]), found.center, (axes * moments) @ axes.T)


def _sizes(element: Element, kind: str) -> Sequence[float]:
    """Return the sizes of a shape: radius and half length, or three half lengths [m]."""
    sizes = [*element.numbers("size", 1, 2, 3, default=(0.0,))]
    if "fromto" in element.attributes and kind != "sphere":  # two radii alike, then the half length
        ends = np.array(element.numbers("fromto", 6), dtype=np.float64).reshape(2, 3)
        return [
            *[sizes[0]] * (SHAPES[kind] - 1),
            0.5 * float(np.linalg.norm(np.diff(ends, axis=0))),
        ]
    if len(sizes) < SHAPES[kind]:
        raise element.fault(f"size: found {len(sizes)} numbers, expected {SHAPES[kind]}; add them")
    return sizes[: SHAPES[kind]]


def solid(kind: str, sizes: Sequence[float]) -> tuple[float, Sequence[float]]:
    """Return the volume [m^3] and the principal moments over the mass [m^2] of a solid."""
    a, b, c = (*sizes, 0.0, 0.0)[:3]
    match kind:
        case "box":
            return 8.0 * a * b * c, [(x * x + y * y) / 3.0 for x, y in ((b, c), (a, c), (a, b))]
        case "cylinder":
            across = (3.0 * a * a + 4.0 * b * b) / 12.0
            return 2.0 * math.pi * a * a * b, [across, across, 0.5 * a * a]
        case "capsule":
            round_, straight = 4.0 / 3.0 * math.pi * a**3, 2.0 * math.pi * a * a * b
            share = round_ / (round_ + straight) if round_ else 0.0
            # two half balls, each with its centre 3/8 of the radius outside the cylinder
            ends = 0.4 * a * a + b * b + 0.75 * a * b
            across = (1.0 - share) * (3.0 * a * a + 4.0 * b * b) / 12.0 + share * ends
            return round_ + straight, [across, across, (0.5 - 0.1 * share) * a * a]
        case _:
            a, b, c = (a, a, a) if kind == "sphere" else (a, b, c)
            moments = [(x * x + y * y) / 5.0 for x, y in ((b, c), (a, c), (a, b))]
            return 4.0 / 3.0 * math.pi * a * b * c, moments


FrameOf: TypeAlias = Callable[[Element], tuple[Place, Sequence[float]]]
"""Global place of a prim [m], and its scales."""
COLLIDER = "PhysicsCollisionAPI"
# Radius and height of shapes unless given, in units of the stage.
USD_SHAPES = {
    "Cube": (2.0, 0.0),
    "Sphere": (1.0, 0.0),
    "Cylinder": (1.0, 2.0),
    "Capsule": (0.5, 1.0),
}
# Radii across an axis are alike to single precision.
_ALIKE = 1e-6


@dataclass(frozen=True)
class StageMasses:
    """The masses of a stage of USD.

    Attributes:
        prims: by path, for materials.
        frame_of: see `FrameOf`.
        metre, kilogram: units of the stage [m, kg].
    """

    prims: Mapping[str, Element]
    frame_of: FrameOf
    metre: float
    kilogram: float

    def of_bodies(
        self, bodies: Mapping[str, Element], colliders: Mapping[str, Sequence[Element]]
    ) -> dict[str, Mass | None]:
        """Return the masses of bodies in their frames, by name; None of one that cannot be read."""
        found: dict[str, Mass | None] = {}
        for name, body in bodies.items():
            inside, said = colliders.get(name, ()), body.attributes
            if not (inside or "physics:mass" in said or "physics:density" in said):
                continue
            try:
                found[name] = self._of(body, inside)
            except CaseError:  # motion needs none
                found[name] = None
        return found

    def _of(self, body: Element, colliders: Sequence[Element]) -> Mass | None:
        """Return the mass of a body."""
        place, scales = self.frame_of(body)
        mass = self.kilogram * body.number("physics:mass", 0.0)
        center, moments = ZERO, body.numbers("physics:diagonalInertia", 3, default=ZEROS)
        said = body.attributes.get("physics:centerOfMass", "-inf")
        has_center, has_moments = "inf" not in said, min(moments) > 0.0
        if not (mass > 0.0 and has_center and has_moments):
            parts = [self._part(body, each, place) for each in colliders]
            whole = sum_of_masses(parts)
            if not (whole.mass > 0.0 or (mass > 0.0 and not colliders)):
                return None
            mass, share = (mass, mass / (whole.mass or mass)) if mass > 0.0 else (whole.mass, 1.0)
            center, inertia = whole.center, share * whole.inertia
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
        return Mass(mass, ZERO, unit * np.diag(moments)).in_frame(Place(center, turn))

    def _part(self, body: Element, shape: Element, around: Place) -> Mass:
        """Return the mass of a collider in the frame of its body.

        Raises:
            CaseError: its volume is not known.
        """
        place, scales = self.frame_of(shape)
        kind = shape.tag
        if kind not in USD_SHAPES:
            raise shape.fault("is no simple shape, expected one; give the mass of the body")
        sizes = [self.metre * scale for scale in scales]
        radius, height = USD_SHAPES[kind]
        axis = {"X": X, "Y": Y, "Z": Z}[shape.choice("axis", ("X", "Y", "Z"), "Z")]
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
            place = place * Place(turn=turn_to(axis))
        own = 0.0 if shape is body else self.kilogram * shape.number("physics:mass", 0.0)
        mass = own if own > 0.0 else volume * self._density(body, shape)
        return Mass(mass, ZERO, mass * np.diag(moments)).in_frame(place.relative_to(around))

    def _density(self, body: Element, shape: Element) -> float:
        """Return the density of a collider [kg/m^3]."""
        bound = (shape.attributes.get(f"material:binding{end}", "") for end in (":physics", ""))
        materials = [self.prims[path] for path in bound if path in self.prims]
        for each in (body, shape, *materials):
            if (density := each.number("physics:density", 0.0)) > 0.0:
                return density * self.kilogram / self.metre**3
        return WATER
