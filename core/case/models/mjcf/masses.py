"""Masses of a model's bodies: of <inertial>, else of simple geoms, by MuJoCo's rules."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....algebra import ZERO, Vec3, X, Y, Z, vec
from ....errors import MechanismError
from ....mechanism.body import Body, Inertia, checked_inertia
from ....trajectory import Array
from ...io.document import SMALLEST, usable
from .classes import Classes
from .elements import Element
from .frames import HERE, Compiler, Place, coordinates, read_place

WATER = 1000.0
"""Density of geoms unless given, that of water [kg/m^3]."""
SHAPES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Geoms with a volume, and how many sizes they have."""
MASSLESS = ("plane", "hfield")
STAND_IN = 1e-6
"""Mass and moments of what kincheck itself writes for a body without a mass [kg, kg m^2]."""
# Of the stand-in's moments, turned into the axes of a body [kg m^2].
ROUND_OFF = 1e-9 * STAND_IN
STAND_INS = "kincheck.stand_ins"
"""Name of the custom text of a model that kincheck wrote without masses."""


@dataclass(frozen=True, eq=False)
class Mass:
    """A mass in a frame.

    Attributes:
        mass: [kg].
        center: centre of mass [m].
        inertia: about the centre, in the axes of the frame [kg m^2], shape (3, 3).
    """

    mass: float
    center: Vec3
    inertia: Array

    def seen_in(self, place: Place) -> Mass:
        """Return the mass in another frame, in which the place of its own one is given."""
        axes = np.array([[*place.direction(axis)] for axis in (X, Y, Z)]).T
        return Mass(self.mass, place.point(self.center), axes @ self.inertia @ axes.T)


def together(masses: Sequence[Mass]) -> Mass:
    """Return several masses in a frame as one."""
    total = sum(each.mass for each in masses)
    if len(masses) == 1 or total == 0.0:
        return masses[0] if masses else Mass(0.0, ZERO, np.zeros((3, 3)))
    center = sum(((each.mass / total) * each.center for each in masses), ZERO)
    inertia = np.zeros((3, 3))
    for each in masses:
        arm = np.array([*(each.center - center)], dtype=np.float64)
        inertia += each.inertia + each.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Mass(total, center, inertia)


def weighed(body: Body, mass: Mass | None) -> Body | None:
    """Return a body with a mass given in global axes; None if no rigid body has it, as no one has a
    moment of inertia alone.
    """
    if mass is None or not (mass.mass or mass.inertia.any()):
        return body
    if mass.mass == 0.0:
        return None
    mass = Mass(mass.mass, vec(coordinates(mass.center)), mass.inertia)
    matrix = 0.5 * (mass.inertia + mass.inertia.T)
    xx, yy, zz = np.diag(matrix).tolist()
    products = (float(matrix[pair]) for pair in ((0, 1), (1, 2), (0, 2)))
    xy, yz, xz = (x if abs(x) >= SMALLEST else 0.0 for x in products)
    six: Inertia = (xx, yy, zz, xy, yz, xz)
    if not all(map(usable, (mass.mass, *mass.center, *six))):
        return None
    try:
        inertia = checked_inertia(body.name, six) if matrix.any() else None
    except MechanismError:
        return None
    center = coordinates(mass.center)
    return replace(body, mass=mass.mass, center_of_mass=center, inertia=inertia)


@dataclass(frozen=True)
class Scales:
    """How a model's compiler takes masses.

    Attributes:
        from_geoms: "true", "false", or "auto" for bodies without <inertial>.
        groups: first and last group of geoms with a mass.
        least: lower bounds of mass and principal moments [kg, kg m^2].
        balanced: principal moments that break the triangle inequality become their mean.
        total: mass of the whole model [kg]; negative for no such rule.
        stand_ins: kincheck wrote the model of a mechanism without masses.
    """

    from_geoms: str = "auto"
    groups: tuple[int, int] = (0, 5)
    least: tuple[float, float] = (0.0, 0.0)
    balanced: bool = False
    total: float = -1.0
    stand_ins: bool = False

    def body(
        self, element: Element, classes: Classes, compiler: Compiler, childclass: str
    ) -> Mass | None:
        """Return the mass of a body's element in its frame; None without one.

        Raises:
            CaseError: a number or shape makes no sense, or a mesh has the mass.
        """
        if self.stand_ins:
            return None
        if self.total > 0.0:
            raise element.fault("settotalmass: scales all masses, expected masses; write them out")
        inside = [*_in_frames(element, HERE, childclass, compiler)]
        given = [(each, place) for each, place, _ in inside if each.tag == "inertial"]
        geoms = [each for each in inside if each[0].tag == "geom"]
        if given and not (self.from_geoms == "true" and geoms):
            inertial, place = given[-1]
            found = _inertial(inertial)
            at = place.then(read_place(inertial, compiler))
            return None if found is None else self._bounded(found.seen_in(at))
        masses: list[Mass] = []
        for geom, place, within in geoms if self.from_geoms != "false" else ():
            complete = classes.complete(geom, "geom", within)
            if (found := self._geom(complete)) is not None:
                masses.append(found.seen_in(place.then(read_place(complete, compiler))))
        if not masses and any(self.least):
            # the least mass is at the body's own `pos`, in its own axes (measured: MuJoCo 4.0)
            masses.append(Mass(0.0, read_place(element, compiler).at, np.zeros((3, 3))))
        return self._bounded(together(masses)) if masses else None

    def _geom(self, element: Element) -> Mass | None:
        """Return the mass of a geom in its own frame; None without one."""
        kind = element.attributes.get("type", "sphere")
        first, last = self.groups
        (group,) = element.numbers("group", (1,), (0.0,))
        (density,) = element.numbers("density", (1,), (WATER,))
        (mass,) = element.numbers("mass", (1,), (math.nan,))
        heavy = (density if math.isnan(mass) else mass) != 0.0
        if kind in MASSLESS or not first <= group <= last or not heavy:
            return None
        if kind not in SHAPES or "mesh" in element.attributes:
            raise element.fault("is a mesh, expected a simple shape; give <inertial>")
        if element.attributes.get("shellinertia") == "true":
            raise element.fault("shellinertia: is a shell, expected a solid; give <inertial>")
        volume, moments = _solid(kind, _sizes(element, kind))
        mass = density * volume if math.isnan(mass) else mass
        if not (mass > 0.0 and volume > 0.0 and usable(mass)):
            raise element.fault("has a mass or size that is not positive or huge; correct it")
        return Mass(mass, ZERO, mass * np.diag(moments))

    def _bounded(self, found: Mass) -> Mass:
        """Return a mass within the bounds of the compiler."""
        if not (any(self.least) or self.balanced):
            return found
        moments, axes = np.linalg.eigh(found.inertia)
        moments = np.maximum(moments, self.least[1])
        if self.balanced and moments[2] > moments[0] + moments[1]:
            moments[:] = moments.mean()
        inertia = (axes * moments) @ axes.T
        return Mass(max(found.mass, self.least[0]), found.center, inertia)


def read_scales(root: Element) -> Scales:
    """Return the settings of all <compiler> elements; the last of each counts.

    Raises:
        CaseError: a setting without a meaning.
    """
    attributes = {
        key: (element, value)
        for element in root.only("compiler")
        for key, value in element.attributes.items()
    }

    def number(key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        if key not in attributes:
            return default
        return attributes[key][0].numbers(key, (len(default),), default)

    def choice(key: str, known: Sequence[str], default: str) -> str:
        return attributes[key][0].choice(key, known, default) if key in attributes else default

    first, last = number("inertiagrouprange", (0.0, 5.0))
    least = number("boundmass", (0.0,))[0], number("boundinertia", (0.0,))[0]
    return Scales(
        choice("inertiafromgeom", ("true", "false", "auto"), "auto"),
        (int(first), int(last)),
        least,
        choice("balanceinertia", ("true", "false"), "false") == "true",
        number("settotalmass", (-1.0,))[0],
        any(
            text.attributes.get("name") == STAND_INS
            for custom in root.only("custom")
            for text in custom.only("text")
        ),
    )


def _in_frames(
    around: Element, place: Place, childclass: str, compiler: Compiler
) -> Iterator[tuple[Element, Place, str]]:
    """Yield what is in a body or its frames, with the place and the class of the frame."""
    for element in around.children:
        if element.tag == "frame":
            inner = place.then(read_place(element, compiler))
            within = element.attributes.get("childclass", childclass)
            yield from _in_frames(element, inner, within, compiler)
        else:
            yield element, place, childclass


def _inertial(element: Element) -> Mass | None:
    """Return the mass of an <inertial> in its own frame; None for a stand-in of none."""
    (mass,) = element.numbers("mass", (1,))
    if mass < 0.0:
        raise element.fault("mass: is negative, expected a positive number of kg; correct it")
    if "fullinertia" in element.attributes:
        xx, yy, zz, xy, xz, yz = element.numbers("fullinertia", (6,))
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    else:
        inertia = np.diag(element.numbers("diaginertia", (3,), (0.0, 0.0, 0.0)))
    if mass == STAND_IN and np.allclose(inertia, STAND_IN * np.eye(3), rtol=0, atol=ROUND_OFF):
        return None
    return Mass(mass, ZERO, inertia)


def _sizes(element: Element, kind: str) -> Sequence[float]:
    """Return the sizes of a shape: radius and half length, or three half lengths [m]."""
    sizes = [*element.numbers("size", (1, 2, 3), (0.0,))]
    if "fromto" in element.attributes and kind != "sphere":  # two radii alike, then the half length
        ends = np.array(element.numbers("fromto", (6,)), dtype=np.float64).reshape(2, 3)
        return [
            *[sizes[0]] * (SHAPES[kind] - 1),
            0.5 * float(np.linalg.norm(np.diff(ends, axis=0))),
        ]
    if len(sizes) < SHAPES[kind]:
        raise element.fault(f"size: found {len(sizes)} numbers, expected {SHAPES[kind]}; add them")
    return sizes[: SHAPES[kind]]


def _solid(kind: str, sizes: Sequence[float]) -> tuple[float, Sequence[float]]:
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
