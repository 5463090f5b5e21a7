"""Masses of links: <inertial> of URDF and of SDF, which name its entries alike."""

from __future__ import annotations

from ....algebra import vec
from ....errors import CaseError
from ..mjcf.elements import Element
from ..mjcf.frames import HERE, Place
from .robot import Inertial
from .sdf_frames import read_pose
from .values import numbers_of, only_child, require_children, roll_pitch_yaw

ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
POSE = ("xyz", "rpy")
IN_INERTIAL = (
    *("mass", "density", "pose", "inertia", "frame"),
    *("auto_inertia_params", "fluid_added_mass"),
)
UNIT = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""Inertia of a link of SDF unless given, of 1 kg [kg m^2]."""


def urdf_inertial(link: Element) -> Inertial | None:
    """Return the mass of a link of URDF; None without one."""
    element = next(link.only("inertial"), None)
    if element is None:
        return None
    require_children(element, ("mass", "inertia", "origin"), closed=True)
    for child in element.children:
        child.require_known({"mass": ("value",), "inertia": ENTRIES}.get(child.tag, POSE), "URDF")
    try:
        (mass,) = _child(element, "mass").numbers("value", (1,))
        matrix = only_child(element, "inertia")
        entries = [
            0.0 if matrix is None else matrix.numbers(name, (1,), (0.0,))[0] for name in ENTRIES
        ]
        origin = only_child(element, "origin")
        place = HERE
        if origin is not None:
            at = vec(origin.numbers("xyz", (3,), (0.0, 0.0, 0.0)))
            place = Place(at, roll_pitch_yaw(origin.numbers("rpy", (3,), (0.0, 0.0, 0.0))))
    except CaseError:  # motion does not need it; the link is listed as one without a mass
        return Inertial()
    return Inertial(place, mass, tuple(entries))


def sdf_inertial(link: Element) -> Inertial | None:
    """Return the mass of a link of SDF; None without one."""
    element = next(link.only("inertial"), None)
    if element is None:
        return None
    element.require_known(("auto",), "SDF")
    require_children(element, IN_INERTIAL, closed=True)
    for child in element.only("inertia"):
        require_children(child, ENTRIES, closed=True)
    try:
        if element.choice("auto", ("true", "false", "1", "0"), "false") in ("true", "1"):
            return Inertial()  # that of its collision shapes
        (mass,) = (1.0,)
        if (given := only_child(element, "mass")) is not None:
            (mass,) = numbers_of(given, (1,))
        matrix = only_child(element, "inertia")
        entries = [
            numbers_of(child, (1,), (default,))[0]
            if matrix is not None and (child := only_child(matrix, name)) is not None
            else default
            for name, default in zip(ENTRIES, UNIT, strict=True)
        ]
        place = read_pose(only_child(element, "pose"))
    except CaseError:
        return Inertial()
    return Inertial(place, mass, tuple(entries))


def _child(element: Element, tag: str) -> Element:
    found = only_child(element, tag)
    if found is None:
        raise element.fault(f"<{tag}>: missing; add it")
    return found
