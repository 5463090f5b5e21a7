"""The mechanism and its motion in a case file: [bodies], [joints], [couplers], [points], [drivers],
[forces] and [sweep], read in SI units and written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...errors import CaseError, with_article
from ...joints import Coupler, Follower, Joint, LinearCoupler
from ...mechanism.body import ACCELERATION, INERTIA, checked_inertia
from ...mechanism.loads import ELEMENTS, Bushing, SpringDamper, TorsionSpringDamper
from ...mechanism.mechanism import Body, Mechanism, Point
from ...mechanism.motions import (
    ROUNDED_TIME,
    Absolute,
    Driver,
    JointAngle,
    JointDisplacement,
    JointDriver,
    Motion,
    PointCoordinate,
    Table,
)
from ...trajectory import Array
from ..case import MARKER, SLOW, TIME, Case, Sweep
from ..units import RADIAN, SECOND, FileUnits, Unit, plain
from .document import Section, explained, shown
from .reference import read_grid
from .schema import (
    MOST_SAMPLES,
    BodyKeys,
    CaseKeys,
    PointKeys,
    ReferenceKeys,
    SweepKeys,
    bushing_keys,
    keys_of,
    own_fields,
)
from .sections import undriven
from .toml_text import toml_table

DRIVERS: Mapping[str, type[Driver]] = {
    cls.type: cls for cls in (PointCoordinate, JointAngle, JointDisplacement)
}
LARGEST = 1_000_000
# Defaults of a body.
PLAIN = Body("plain")
_EVEN: Mapping[str, str] = {
    "start": "a number",
    "stop": "a number",
    "steps": f"a whole number of samples, 1 to {MOST_SAMPLES}",
}
"""Keys of an even grid of samples, and their expected values."""


def read_mechanism(root: Section, keys: CaseKeys) -> Mechanism:
    """Return the mechanism of a case file.

    Raises:
        CaseError: an unknown type, key or name, a name in both tables of joints and couplers, or
            values that no such part can have.
    """
    units = root.units
    bodies = [_body(name, section) for name, section in root.at("bodies").each()]
    points = list[Point]()
    for name, section in root.at("points").each():
        point = section.typed(PointKeys)
        points.append(Point(name, point.body, units.place(point.position)))
    joints, couplers = _joints(root)
    drivers = _drivers(root.at("drivers"), free=undriven(root.table))
    forces = [
        _build(section, section.class_of("force", ELEMENTS), name)
        for name, section in root.at("forces").each()
    ]
    gravity = units.power(ACCELERATION, keys.gravity)
    with explained(root.file, "", units.length):
        return Mechanism(
            *(keys.name, bodies, joints, points, drivers, couplers),
            gravity=gravity,
            forces=forces,
            bushings=read_bushings(root, joints),
        )


def read_bushings(root: Section, joints: Sequence[Joint]) -> list[Bushing]:
    """Return the bushings of joints, [joints.NAME.bushings.X]; bodies and point are by default the
    joint's.
    """
    found = list[Bushing]()
    for joint in joints:
        table = root.at("joints").at(joint.name)
        if table.value is None:
            continue
        given = table.at("bushings")
        for own, section in given.each() if given.value is not None else ():
            keys: Any = section.typed(bushing_keys())
            numbers = _in_si(Bushing, keys, section.units)
            places = joint.points_on()
            if numbers["point"] is None and not places:
                raise section.at("point").fault("missing, expected a point [x, y, z]; add it")
            numbers["point"] = numbers["point"] or places[0]
            i, j = keys.bodies or joint.bodies
            with section.explained():
                name = f"{joint.name}.{own}"
                found.append(Bushing(name, i, j, joint=joint.name, **numbers))
    return found


def _body(name: str, section: Section) -> Body:
    keys, units = section.typed(BodyKeys), section.units
    center, inertia = keys.center_of_mass, keys.inertia
    with explained(section.file, section.key):
        if inertia is not None:  # an error is in the unit of the file
            of_file = INERTIA.of(units.length.name, RADIAN.name)
            inertia = FileUnits(units.length).power(
                INERTIA, checked_inertia(name, inertia, of_file)
            )
        return Body(
            name,
            units.place(keys.origin),
            keys.euler_parameters,
            keys.fixed,
            keys.mass,
            center and units.place(center),
            inertia,
        )


def _build(section: Section, cls: Any, *name: str, driver: Unit | None = None) -> Any:
    """Return a joint, coupler, driver, motion or force element of a class.

    Args:
        driver: unit of the driver of a motion.
    """
    if cls.type in Joint.registry:  # bushings are read with the mechanism
        own = {name: each for name, each in section.table.items() if name != "bushings"}
        section = replace(section, value=own)
    sprung = cls.type in (SpringDamper.type, TorsionSpringDamper.type)
    if sprung and not {"stiffness", "curve"} & section.table.keys():
        raise section.at("stiffness").fault(
            "missing, expected a number; add the key 'stiffness', or a curve"
        )
    keys: Any = section.typed(keys_of(cls))
    given = _in_si(cls, keys, section.units, driver)
    if hasattr(keys, "joints"):
        given["joints"] = keys.joints
    given |= zip("ij", getattr(keys, "bodies", ()), strict=False)
    make: Any = cls  # type checkers would take the classes of the conditions
    with section.explained():
        return make(*name, **given)


def _in_si(cls: Any, keys: Any, units: FileUnits, driver: Unit | None = None) -> dict[str, Any]:
    own = own_fields(cls)
    return {each.name: units.in_si(each, getattr(keys, each.name), driver) for each in own}


def _joints(root: Section) -> tuple[list[Joint], list[Coupler]]:
    sections = dict(root.at("joints").each())
    known = Joint.registry | Coupler.registry
    parts: list[Joint | Coupler] = [
        _build(section, section.class_of("joint", known), name)
        for name, section in sections.items()
    ]
    for name, section in root.at("couplers").each():
        if name in sections:
            raise section.fault(
                f"found {name!r} in [joints] too, expected one name; rename one of them"
            )
        parts.append(_build(section, section.class_of("coupler", Coupler.registry), name))
        sections[name] = section
    freedoms = {part.name: part.freedoms for part in parts if isinstance(part, Joint)}
    couplers = list[Coupler]()
    for part in parts:
        if isinstance(part, Follower | LinearCoupler):
            if "freedoms" not in sections[part.name].table:
                own = ((*freedoms.get(name, ()), "rotation")[0] for name in part.joints)
                part = replace(part, freedoms=(*own,))
            part = part.in_units(root.units.length.size, root.units.angle.size)
        if isinstance(part, Coupler):
            couplers.append(part)
    return [part for part in parts if isinstance(part, Joint)], couplers


def _drivers(section: Section, *, free: bool) -> list[Driver]:
    """Return the drivers. `read_sweep` reads their motions, since they depend on the sweep."""
    if not section.value and not free:
        raise section.fault("found no driver, expected at least one that moves; add [drivers.NAME]")
    if TIME in section.table:
        raise section.at(TIME).fault(
            f"found the name {TIME!r}, which [sweep] has for time itself; rename the driver"
        )
    found: list[Driver] = [
        _build(each, each.class_of("driver", DRIVERS), name) for name, each in section.each()
    ]
    driven = dict[tuple[str, str], str]()
    for each in found:
        if not isinstance(each, JointDriver):
            continue
        other = driven.setdefault((each.joint, each.freedom), each.name)
        if other != each.name:
            raise (
                section.at(each.name)
                .at("joint")
                .fault(
                    f"found {shown(each.joint)}, whose {each.freedom} {other!r} drives already,"
                    " expected another joint; remove one of the drivers"
                )
            )
    return found


def read_sweep(
    root: Section, mechanism: Mechanism, reference: ReferenceKeys | None = None
) -> tuple[Sweep, Unit, bool]:
    """Read the sweep, with the motions of all other drivers.

    Returns:
        The sweep, the unit of the swept values, and whether the sweep has the samples of the
        reference.
    """
    section = root.at("sweep")
    if section.value is None:
        raise section.fault("missing, expected a table; add the key 'sweep'")
    sweep = section.typed(SweepKeys)
    drivers = dict(root.at("drivers").each())
    moved = {
        name: motion
        for name, each in drivers.items()
        if (motion := each.at("motion")).value is not None
    }
    _require_moved(section, sweep, drivers, moved, free=undriven(root.table))
    motions = {name: _motion(mechanism, name, each) for name, each in moved.items()}
    convert, design = SECOND, 0.0
    if sweep.driver != TIME:
        convert = _unit(mechanism.driver(sweep.driver), root.units)
        design = mechanism.design_value(sweep.driver)
    grid = np.array(_samples(section, sweep, convert, reference))
    rate = convert(1.0 if sweep.rate is None else sweep.rate)
    found = Sweep(sweep.driver, grid, rate, design, motions)
    times = found.path.times / (SLOW if found.static else 1.0)
    for name, motion in motions.items():
        _require_defined(moved[name], motion, times)
    return found, convert, sweep.at is not None


def _samples(
    section: Section, sweep: SweepKeys, convert: Unit, reference: ReferenceKeys | None
) -> Sequence[float]:
    """Return the samples [SI]: an even grid, or the reference's samples."""
    if sweep.at is None:
        for key, expected in _EVEN.items():
            if section.at(key).value is None:
                raise section.at(key).fault(
                    f'missing, expected {expected}; add the key {key!r}, or at = "reference" for'
                    " the samples of the reference"
                )
        start, stop, steps = sweep.start or 0.0, sweep.stop or 0.0, sweep.steps or 1
        written, last = (section.at(key).value for key in ("start", "stop"))
        if start == stop and steps > 1:
            raise section.at("stop").fault(
                f"found the start {written!r} again with {steps} steps, expected another value;"
                " give steps = 1 for a single sample"
            )
        if start != stop and steps == 1:
            raise section.at("steps").fault(
                f"found 1 with start {written!r} and stop {last!r}, expected 2 or more samples,"
                " both ends among them; give more, or stop = start for a single sample"
            )
        return [convert(value) for value in np.linspace(start, stop, steps).tolist()]
    for key in _EVEN:
        if (value := section.at(key).value) is not None:
            raise section.at(key).fault(
                f"found {shown(value)} beside at = {shown(sweep.at)}, expected one; remove {key} or"
                " at"
            )
    if reference is None:
        raise section.at("at").fault(
            f"found {shown(sweep.at)}, but the case has no [reference] with samples; add one, or"
            " give start, stop and steps"
        )
    found = read_grid(section.file, reference, convert)
    if len(found) > MOST_SAMPLES:
        raise section.at("at").fault(
            f"found {len(found)} rows of the reference, expected {MOST_SAMPLES} at most; thin them"
            " out, or give start, stop and steps"
        )
    return found


def _require_moved(
    section: Section,
    sweep: SweepKeys,
    drivers: Mapping[str, Section],
    moved: Mapping[str, Section],
    *,
    free: bool,
) -> None:
    """Refuse a sweep in contradiction to itself or the motions."""
    if sweep.driver == TIME:
        if not moved and not free:
            found = f"found {shown(TIME)}" if "driver" in section.table else "missing"
            raise section.at("driver").fault(
                f"{found}, and no driver has a motion, expected something that moves; name the"
                " driver to sweep, or add [drivers.NAME.motion]"
            )
        if sweep.rate:
            raise section.at("rate").fault(
                f"found {section.at('rate').value!r} in a sweep of time, expected none, for the"
                " motions have rates of their own, or 0 for rest; remove it, or name the driver to"
                " sweep"
            )
    elif sweep.driver not in drivers:
        raise section.at("driver").unknown(sweep.driver, [*drivers, TIME], "a driver")
    elif sweep.driver in moved:
        raise moved[sweep.driver].fault(
            "found a motion of the swept driver, expected the sweep alone to move it; remove it, or"
            f' sweep time: driver = "{TIME}", start and stop in seconds'
        )


def _motion(mechanism: Mechanism, name: str, section: Section) -> Motion:
    cls = section.class_of("motion", Motion.types())
    driver = _unit(mechanism.driver(name), section.units)
    motion = _build(section, cls, driver=driver)
    design = mechanism.design_value(name)
    return Absolute(motion, design) if design else motion


def _require_defined(section: Section, motion: Motion, times: Array) -> None:
    """Refuse a motion unless it defines its driver's value at every sample."""
    (first, last), low, high = motion.span, float(times.min()), float(times.max())
    slack = ROUNDED_TIME * max(abs(low), abs(high))
    if low < first - slack or high > last + slack:
        raise section.fault(
            f"found values from {plain(first)} to {plain(last)} s, expected them for the whole"
            f" sweep, {low:.9g} to {high:.9g} s; add values, or shorten the sweep"
        )
    with np.errstate(all="ignore"):
        finite = np.isfinite(motion.at(times)).all()
    if not finite:
        raise section.fault(
            "found numbers that overflow within the sweep, expected finite ones; correct them"
        )


def _unit(driver: Driver, units: FileUnits) -> Unit:
    """Return the unit of a driver's values in the file."""
    return units.angle if driver.turns else units.length


def mechanism_lines(case: Case) -> Iterator[str]:
    """Yield the lines of the parts of a mechanism and of the motions of its drivers, in SI units.

    Raises:
        CaseError: a motion or a name is not one that a case file can hold.
    """
    mechanism = case.mechanism
    for body in mechanism.bodies:
        own = {f.name: getattr(body, f.name) for f in fields(body) if f.name != "name"}
        given = {key: value for key, value in own.items() if value != getattr(PLAIN, key)}
        yield from toml_table(given, "bodies", body.name)
    for joint in (*mechanism.given_joints, *mechanism.grounded, *mechanism.couplers):
        between = (
            {"joints": joint.joints} if isinstance(joint, Coupler) else {"bodies": joint.bodies}
        )
        yield from toml_table(_table_of(joint, **between), "joints", joint.name)
        for each in mechanism.bushings:
            if each.joint == joint.name:
                own = {key: x for key, x in _table_of(each).items() if key != "type"}
                name = each.name.removeprefix(f"{joint.name}.")
                table = {"bodies": each.bodies, **own}
                yield from toml_table(table, "joints", joint.name, "bushings", name)
    for point in mechanism.points:
        if not point.name.startswith(MARKER):  # the reader of the file creates markers anew
            place = {"body": point.body, "position": point.position}
            yield from toml_table(place, "points", point.name)
    for driver in mechanism.drivers:
        yield from toml_table(_table_of(driver), "drivers", driver.name)
        if motion := case.sweep.motions.get(driver.name):
            moved = _from_design(motion, mechanism.design_value(driver.name))
            yield from toml_table(_table_of(moved), "drivers", driver.name, "motion")
    for force in mechanism.forces:
        ends = {"bodies": force.bodies} if len(force.bodies) == 2 else {}
        yield from toml_table(_table_of(force, **ends), "forces", force.name)


def _table_of(item: Any, **between: Any) -> Mapping[str, Any]:
    """Return type and fields for a file, without optional fields at their defaults."""
    described: Any = type(item)  # pyright: ignore[reportUnknownVariableType]
    own = {f.name: getattr(item, f.name) for f in own_fields(described)}
    known = {key: value for key, value in own.items() if value is not None}
    return {"type": item.type, **between, **known}


def _from_design(motion: Motion, design: float) -> Motion:
    """Return a motion with the given design value, as a case file needs it."""
    if not isinstance(motion, Absolute):
        return motion
    if (shift := motion.design - design) == 0.0:
        return motion.motion
    if not isinstance(motion.motion, Table):
        raise CaseError(
            f"{with_article(motion.motion.type)} motion of values that are {motion.design!r} at"
            f" design, expected {design!r} as in a case file; give a table"
        )
    return replace(motion.motion, values=tuple(x - shift for x in motion.motion.values))


def values_in_file(case: Case) -> Array:
    """Return the swept values in the form of a case file, shape (n,): relative to the design."""
    sweep = case.sweep
    if sweep.driver == TIME:
        return sweep.values
    return sweep.values - (sweep.design - case.mechanism.design_value(sweep.driver))


def sweep_lines(case: Case, values: Array, *, own_grid: bool) -> list[str]:
    """Return the lines of [sweep].

    Args:
        values: see `values_in_file`.
        own_grid: the case has a reference; an uneven grid can then be the reference's samples.

    Raises:
        CaseError: the samples are on no even grid.
    """
    sweep, start, stop = case.sweep, float(values[0]), float(values[-1])
    rate = {} if sweep.driver == TIME and not sweep.static else {"rate": sweep.rate}
    # round-off of start + k * step, once in the file's units and once here
    rounding = 4.0 * np.spacing(np.abs([*sweep.values, *values]).max())
    if (np.abs(np.linspace(start, stop, len(values)) - values) <= rounding).all():
        grid = {"start": start, "stop": stop, "steps": len(values)}
    elif own_grid and case.origin and not case.origin.grid:
        grid = {"at": "reference"}
    else:
        raise CaseError(
            f"case {case.name!r}: its samples are no even grid, which is all that [sweep] can say;"
            " give an even one"
        )
    return toml_table({"driver": sweep.driver, **grid, **rate}, "sweep")
