"""Bushings at the hardpoints of a suspension, by role, and masses and springs beside them.

A bushing at a role takes the place of the joint there. Its third axis is the joint's, and the first
two are across it; so the third number of each key is along this axis or about it. Joints without an
axis have the global axes. The right side mirrors the left.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from ...case.case import Case
from ...case.io.document import Section, parse, read_text
from ...case.io.mechanism_sections import LARGEST, read_bushings
from ...errors import CaseError
from ...joints import Distance, Joint
from ...joints.base import triad
from ...mechanism.body import Body
from ...mechanism.loads import Bushing, ForceElement, SpringDamper
from ...mechanism.mechanism import GROUND, Vector
from .table import HardpointTable, number
from .templates import KNUCKLE, TIEROD_INNER, Template

Three = float | tuple[float, float, float]
# A steel ball joint is stiff, rubber is not: numbers of a passenger car [N/m, N m/rad].
SAMPLE_STIFFNESS, SAMPLE_TURNING = 5e6, 100.0
STANDARD_GRAVITY = (0.0, 0.0, -9.80665)


class RoleKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[bushings.ROLE], in SI."""

    stiffness: Three = 0.0
    turning_stiffness: Three = 0.0
    damping: Three = 0.0
    turning_damping: Three = 0.0
    preload: Three = 0.0


@dataclass(frozen=True)
class Rubber:
    """What a file has beside hardpoints, of the left side, by roles and bodies of the template.

    Attributes:
        bushings: keys of `RoleKeys` by role.
        bodies: mass and centre of mass by body.
        springs: keys of a spring-damper by the roles of its ends; the first is on the chassis.
    """

    bushings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Any])
    bodies: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Any])
    springs: Mapping[tuple[str, str], Mapping[str, Any]] = field(
        default_factory=dict[tuple[str, str], Any]
    )


def joint_at(template: Template, role: str) -> str | None:
    """Return the joint that a bushing at a role replaces: a pivot or a ball, one on the chassis
    first, else the rod that ends there; none where two rods meet.
    """
    found = [name for name, (_, _, _, *roles) in template.joint_rows.items() if role in roles]
    rods = [name for name in found if _is_rod(template, name)]
    others = [name for name in found if name not in rods]
    on_chassis = [name for name in others if GROUND in template.joint_rows[name]]
    return next(iter((*on_chassis, *others, *(rods if len(rods) == 1 else ()))), None)


def _is_rod(template: Template, joint: str) -> bool:
    return Joint.registry[template.joint_rows[joint][0]] is Distance


def with_rubber(
    case: Case, template: Template, at: Mapping[str, Vector], sides: Mapping[str, int], of: Rubber
) -> Case:
    """Return the case of a suspension with bushings, masses and springs.

    Args:
        at: positions by role, of the left side.
        sides: 1 for the left, -1 for the right side, by the prefix of its names.
    """
    mechanism = case.mechanism

    def place_on_side(point: Sequence[float], side: int) -> Vector:
        return point[0], side * point[1], point[2]

    def bushings() -> Iterator[Bushing]:
        for prefix, side in sides.items():
            for role, keys in of.bushings.items():
                joint: Any = mechanism.joint(f"{prefix}{joint_at(template, role)}")
                base: list[Any] = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
                if (axis := getattr(joint, "axis", None)) is not None:
                    base = [[*x] for x in triad(place_on_side([*axis], side))[:2]]
                axes, numbers = [place_on_side(x, side) for x in base], dict(keys)
                if side < 0 and (given := keys.get("preload")):
                    # the mirror image of a right-handed third axis
                    x, y, z = (given,) * 3 if isinstance(given, float) else given
                    numbers["preload"] = (x, y, -z)
                yield Bushing(
                    name=f"{joint.name}.{role}",
                    i=joint.i,
                    j=joint.j,
                    point=place_on_side(at[role], side),
                    axes=(axes[0], axes[1]),
                    joint=joint.name,
                    **numbers,
                )

    def springs() -> Iterator[ForceElement]:
        for prefix, side in sides.items():
            for roles, keys in of.springs.items():
                own = [template.bodies.get(role, GROUND) for role in roles]
                i, j = (body if body == GROUND else prefix + body for body in own)
                points = place_on_side(at[roles[0]], side), place_on_side(at[roles[1]], side)
                name = f"{prefix}{roles[1].removesuffix('_lower')}"
                yield SpringDamper(name, i, j, points, **keys)

    bodies = {
        f"{prefix}{name}": (name, side) for prefix, side in sides.items() for name in of.bodies
    }

    def with_mass(body: Body) -> Body:
        if body.name not in bodies:
            return body
        name, side = bodies[body.name]
        facts = dict(of.bodies[name])
        facts["center_of_mass"] = place_on_side(facts["center_of_mass"], side)
        return replace(body, **facts)

    changed = replace(
        mechanism,
        bodies=[with_mass(body) for body in mechanism.bodies],
        forces=(*mechanism.forces, *springs()),
        bushings=(*mechanism.bushings, *bushings()),
        gravity=STANDARD_GRAVITY if of.bodies else mechanism.gravity,
    )
    return replace(case, mechanism=changed)


def of_chrono(
    table: HardpointTable, template: Template, named: Mapping[str, str]
) -> tuple[Rubber, list[str]]:
    """Return what a file of Project Chrono with bushings has beside its points, and notes.

    A bushing of an arm is at each of its points on the chassis; "DOF" is for what the joint leaves
    free (ChVehicleJoint.cpp). Its spring takes its curve over deflection, tension positive.
    """
    file, sections = table.file, table.beside
    if not any("Bushing Data" in each for each in sections.values()):
        return Rubber(), []

    def value(section: str, key: str, at: Mapping[str, Any]) -> float:
        return number(file, f"{section}/{key}", at.get(key, 0.0))

    def several(section: str, key: str, of: Any) -> list[float]:
        return [number(file, f"{section}/{key}", each) for each in of]

    bushings, bodies = dict[str, Any](), dict[str, list[tuple[float, list[float]]]]()
    inertias, impossible = list[str](), list[str]()
    for section, content in sections.items():
        chassis = f"{section}/Location Chassis"
        roles = [role for role, name in named.items() if name.startswith(chassis)]
        joints = {role: name for role in roles if (name := joint_at(template, role))}
        data: Mapping[str, Any] = content.get("Bushing Data") or {}
        free: Mapping[str, Any] = data.get("DOF") or {}
        stiff, stiff_free = (value(section, "Stiffness Rotational", x) for x in (data, free))
        damping, damping_free = (value(section, "Damping Rotational", x) for x in (data, free))
        for role, joint in joints.items() if data else ():
            axial = template.joint_rows[joint][0] == "revolute"
            bushings[role] = {
                "stiffness": value(section, "Stiffness Linear", data),
                "damping": value(section, "Damping Linear", data),
                "turning_stiffness": (stiff, stiff, stiff_free) if axial else stiff_free,
                "turning_damping": (damping, damping, damping_free) if axial else damping_free,
            }
        body = next((template.joint_rows[name][2] for name in joints.values()), None)
        body = KNUCKLE if section in ("Upright", "Spindle") else body
        if body is None or "Mass" not in content:
            continue
        center = table.points.get(f"{section}/COM")
        place = [*center.position] if center else several(section, "COM", content.get("COM") or ())
        bodies.setdefault(body, []).append((value(section, "Mass", content), place))
        if given := content.get("Moments of Inertia"):
            low, middle, high = sorted(several(section, "Moments of Inertia", given))
            (impossible if high > low + middle else inertias).append(section)
    springs = dict[tuple[str, str], Any]()
    for section, role in (("Spring", "spring"), ("Shock", "damper")):
        ends, content = (f"{role}_upper", f"{role}_lower"), sections.get(section, {})
        if not {*ends} <= named.keys():
            continue
        keys: dict[str, Any] = {"damping": value(section, "Damping Coefficient", content)}
        keys["stiffness"] = value(section, "Spring Coefficient", content)
        if "Free Length" in content:
            keys["free_length"] = value(section, "Free Length", content)
        if curve := content.get("Curve Data"):
            keys["curve"] = tuple(tuple(several(section, "Curve Data", row)) for row in curve)
        springs[ends] = keys
    notes = [f"inertias of {', '.join(inertias)} are left out, as statics need none"] * bool(
        inertias
    )
    notes += [
        f"the inertia of {each!r} is left out: no body has it, one moment exceeds the other two"
        for each in impossible
    ]
    return Rubber(bushings, {x: _together(parts) for x, parts in bodies.items()}, springs), notes


def _together(parts: Sequence[tuple[float, Sequence[float]]]) -> dict[str, Any]:
    """Return mass and centre of mass of parts as one body."""
    mass = sum(each for each, _ in parts)
    moments = [[each * x for x in place] for each, place in parts]
    center = tuple(sum(x) / mass for x in zip(*moments, strict=True))
    return {"mass": mass, "center_of_mass": center}


def with_file(
    case: Case, template: Template, at: Mapping[str, Vector], sides: Mapping[str, int], file: Path
) -> Case:
    """Return the case of a suspension with the bushings of a file, in SI: tables [bushings.ROLE],
    and tables [joints.NAME.bushings.X] as in case files.

    Raises:
        CaseError: the file cannot be read, or a role has no joint for a bushing.
    """
    root, found = bushings_in(file, "bushings", "joints"), dict[str, Any]()
    known = [role for role in at if joint_at(template, role)]
    for role, section in root.at("bushings").each() if root.at("bushings").value else ():
        section.require(role, known, f"a role of a joint of {template.name}")
        keys = section.typed(RoleKeys)
        found[role] = {name: getattr(keys, name) for name in keys.__struct_fields__}
    if not found:
        return with_bushings(case, file, "bushings")
    with root.at("bushings").explained():
        case = with_rubber(case, template, at, sides, Rubber(found))
    return with_bushings(case, file, "bushings") if root.at("joints").value is not None else case


def sample_bushings(template: Template) -> str:
    """Return the text of a file of bushings to begin one's own with; its numbers are invented.

    It has the places on the chassis, but for the steered rod, which has often none.
    """
    lines = [
        f"# bushings of template {template.name}: kincheck kc TABLE --bushings FILE, in SI units"
    ]
    lines.append("# one number serves all axes. The third is the joint's own axis, if it has one")
    for role in (*template.roles, *template.optional):
        if role.name not in template.sample:
            continue
        name = joint_at(template, role.name)
        if name is None or name == template.steered:
            continue
        kind, i, j, first, *_ = template.joint_rows[name]
        if GROUND not in (i, j) or (_is_rod(template, name) and role.name != first):
            continue
        axial = kind == "revolute"
        turning = [SAMPLE_TURNING, SAMPLE_TURNING, 0.0] if axial else [SAMPLE_TURNING] * 3
        lines += ["", f"[bushings.{role.name}]  # {role.meaning}"]
        lines += [f"stiffness = {SAMPLE_STIFFNESS:g}  # N/m", f"turning_stiffness = {turning}"]
    if template.steered:
        lines += ["", f"# {TIEROD_INNER} takes one too, as the stiffness of rack or steering"]
    return "\n".join(lines)


def bushings_in(file: Path, *tables: str) -> Section:
    """Return the tables of a file of bushings.

    Args:
        tables: names of its tables.

    Raises:
        CaseError: the file cannot be read, or has other tables or keys.
    """
    text = read_text(file, LARGEST, "it holds the bushings of one suspension")
    try:
        root = Section(file, "", parse(file, text))
        root.require_keys(tables)
        for _, joint in root.at("joints").each():
            joint.require_keys(("bushings",))
        return root
    except CaseError as error:
        raise CaseError(
            f"{error}. --bushings takes TOML, [bushings.ROLE] as kincheck templates NAME --bushings"
            " prints, or [joints.NAME.bushings.X]"
        ) from None


def with_bushings(case: Case, file: Path, *tables: str) -> Case:
    """Return a case with the bushings in a file of tables [joints.NAME.bushings.X], in SI units,
    beside its own: tables of hardpoints have none.

    Args:
        tables: names of other tables of the file.

    Raises:
        CaseError: the file cannot be read, or names an unknown joint.
    """
    root, joints = bushings_in(file, "joints", *tables), case.mechanism.given_joints
    names = [joint.name for joint in joints]
    for name, section in root.at("joints").each():
        section.require(name, names, "a joint")
    found = read_bushings(root, joints)
    if not found:
        raise root.at("joints").fault(
            "found no bushing, expected tables [joints.NAME.bushings.X], or, for a table of"
            " hardpoints, [bushings.ROLE]. Add one"
        )
    bushings = (*case.mechanism.bushings, *found)
    with root.at("joints").explained():
        return replace(case, mechanism=replace(case.mechanism, bushings=bushings))
