"""Masses of bodies of MJCF, by inertials or geoms."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....algebra import ZERO
from ...io.document import usable
from .element import Element
from .mjcf_language import Classes, Compiler
from .place import Place
from .tree import Mass, together

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
    if inertials and not (compiler.from_geoms == "true" and geoms):
        element, at, _ = inertials[-1]
        found = _inertial(element)
        place = at.then(compiler.place(element))
        return None if found.is_stand_in else _within_bounds(found.seen_in(place), compiler)
    masses: list[Mass] = []
    for element, at, within in geoms if compiler.from_geoms != "false" else ():
        complete = classes.complete(element, "geom", within)
        if (found := _geom(complete, compiler)) is not None:
            masses.append(found.seen_in(at.then(compiler.place(complete))))
    if not masses and any(compiler.least):
        # the least mass is at the body's own `pos`, in its own axes (measured: MuJoCo 4.0)
        masses.append(Mass(0.0, compiler.place(body).at, np.zeros((3, 3))))
    return _within_bounds(together(masses), compiler) if masses else None


def _inertial(element: Element) -> Mass:
    """Return the mass of an <inertial> in its own frame."""
    mass = element.number("mass")
    if mass < 0.0:
        raise element.fault("mass: is negative, expected a positive number of kg; correct it")
    if "fullinertia" in element.attributes:
        xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", 6)
        return Mass(mass, ZERO, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    moments = element.numbers("diaginertia", 3, default=(0.0, 0.0, 0.0))
    return Mass(mass, ZERO, np.diag(moments))


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
