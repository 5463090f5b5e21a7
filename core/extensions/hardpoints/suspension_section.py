"""[suspension] of a case file, read and written: the vehicle around a wheel or an axle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from ...algebra import vec
from ...case.case import Case, size
from ...case.io.document import Section, shown
from ...case.io.outputs import check_point, direction, tolerance
from ...case.io.schema import keys_of
from ...case.io.sections import CaseSection
from ...case.io.toml_text import toml_table
from ...case.quantity import Quantity, TypedQuantity, own_keys
from ...errors import CaseError
from ...joints.base import unit
from ...mechanism.mechanism import Mechanism, Vector
from ...mechanism.motions import PointCoordinate
from .suspension import (
    AxleOutput,
    Camber,
    MotionRatio,
    PerTravel,
    Rate,
    Side,
    SuspensionOutput,
    Toe,
    Vehicle,
    camber_of_front_view,
)
from .suspension_keys import OtherWheelKeys, SuspensionKeys

if TYPE_CHECKING:
    from ...harness.scene_record import SceneWheel
    from ...trajectory import Array

# Axes with nine digits are perpendicular to about 1e-9; a wrong sign or digit gives a far larger
# error.
SQUARE = 1e-8
# A driver's direction so nearly horizontal is no travel.
LEVEL = 1e-8
_LENGTHS = ("wheel_radius", "wheelbase", "cg_height", "rack_per_turn")
_NOT_OF_VEHICLE = ("center_plane", "per_travel", "kingpin_links", "travel", "other")
_OWN = (
    "wheel_center",
    "kingpin",
    "static_toe",
    "static_camber",
    "wheel_axis",
    "wheel_contact",
)
"""Attributes of a vehicle with a value for each wheel of an axle, in addition to the side."""


@dataclass(frozen=True)
class SuspensionTable:
    """The [suspension] table.

    Attributes:
        vehicle: the vehicle with the wheel of the table.
        per_travel: whether outputs get their derivatives by travel.
        other: the vehicle with the axle's other wheel, if the table has it.
    """

    vehicle: Vehicle
    per_travel: bool
    other: Vehicle | None = None


def read_suspension(section: Section, case: Case) -> SuspensionTable:
    """Read the table, in SI.

    Args:
        case: the case read so far.

    Raises:
        CaseError: invalid axes, unknown points or drivers, or a wheel on the wrong side.
    """
    keys, units = section.typed(SuspensionKeys), section.units
    forward, up = (direction(section.at(name), getattr(keys, name)) for name in ("forward", "up"))
    if abs(vec(forward) @ vec(up)) > SQUARE:
        raise section.at("up").fault(
            f"found {shown(keys.up)}, which is not at right angles to forward ="
            f" {shown(keys.forward)}, expected axes of the vehicle's body. Correct one of them"
        )
    given = msgspec.structs.asdict(keys)
    given = {name: each for name, each in given.items() if name not in _NOT_OF_VEHICLE}
    given |= {name: units.length(given[name]) for name in _LENGTHS if given[name] is not None}
    given |= {name: units.angle(given[name]) for name in ("static_toe", "static_camber")}
    given["kingpin"] = _kingpin(section, keys, case.mechanism)
    given |= {"forward": forward, "up": up, "middle": units.place(keys.center_plane)}
    vehicle = _check_vehicle(section, Vehicle(**given), case.mechanism)
    travel = _travel(section, keys.travel, vehicle, case)
    if keys.other is None:
        alone = [travel] == list(case.sweep.path.motions)
        named = () if travel is None or alone else (travel,)
        return SuspensionTable(replace(vehicle, travel=named), keys.per_travel)
    section = section.at("other")
    of_other = section.typed(OtherWheelKeys)
    toe, camber = of_other.static_toe, of_other.static_camber
    other = replace(
        vehicle,
        side=Side.RIGHT if vehicle.side is Side.LEFT else Side.LEFT,
        wheel_center=of_other.wheel_center,
        kingpin=_kingpin(section, of_other, case.mechanism),
        static_toe=vehicle.static_toe if toe is None else units.angle(toe),
        static_camber=vehicle.static_camber if camber is None else units.angle(camber),
        wheel_axis=of_other.wheel_axis,
        wheel_radius=keys.wheel_radius and vehicle.wheel_radius,
        wheel_contact=of_other.wheel_contact,
    )
    other = _check_vehicle(section, other, case.mechanism)
    beside = _travel(section, of_other.travel, other, case)
    both = () if travel is None or beside is None else (travel, beside)
    vehicle, other = (replace(each, travel=both) for each in (vehicle, other))
    return SuspensionTable(vehicle, keys.per_travel, other)


def _kingpin(
    section: Section, keys: SuspensionKeys | OtherWheelKeys, mechanism: Mechanism
) -> tuple[str, str] | tuple[tuple[str, str], ...] | None:
    """Return the points of the steering axis, and check them and the wheel's centre."""
    rods = keys.kingpin_links
    for name, point in (
        ("wheel_center", keys.wheel_center),
        *(("kingpin", point) for point in keys.kingpin or ()),
        *(("kingpin_links", point) for rod in rods or () for point in rod),
    ):
        check_point(section.at(name), point, mechanism)
    if rods and keys.kingpin:
        raise section.at("kingpin_links").fault(
            "found beside kingpin, expected one of them. Remove the other"
        )
    return keys.kingpin or rods


def _check_vehicle(section: Section, vehicle: Vehicle, mechanism: Mechanism) -> Vehicle:
    """Return the vehicle with the radius by the point of the wheel's contact, after checks of its
    side and its points. The most common mistake is hardpoints of the other side, or in mirrored
    axes.
    """
    center = mechanism.point(vehicle.wheel_center)
    if mechanism.is_fixed(center.body):
        raise section.at("wheel_center").fault(
            f"found {shown(center.name)}, which is on {shown(center.body)}, expected a point of a"
            " body that moves. Name the centre of the wheel"
        )
    aside = vehicle.outboard @ (vec(center.position) - vec(vehicle.middle))
    if aside <= 0.0:
        raise section.at("side").fault(
            f"found {shown(str(vehicle.side))}, but {vehicle.wheel_center!r} is"
            f" {section.units.length.written(-aside)} on the other side of the centre plane,"
            " expected the side on which it is, looking forward with up upwards. Correct side,"
            " forward, up or center_plane"
        )
    ends = [vec(mechanism.point(name).position) for name in vehicle.kingpin_points]
    if len(ends) == 2 and vec(vehicle.up) @ (ends[1] - ends[0]) <= 0.0:
        raise section.at("kingpin").fault(
            f"found {[*vehicle.kingpin_points]!r}, the first of which is not the lower, expected"
            " the lower point, then the upper. Give them in this order"
        )
    angles = bool(vehicle.static_toe or vehicle.static_camber)
    for name, given, numbers in (
        ("wheel_axis", angles, "static_toe and static_camber"),
        ("wheel_contact", vehicle.wheel_radius is not None, "wheel_radius"),
    ):
        if (point := getattr(vehicle, name)) is None:
            continue
        check_point(section.at(name), point, mechanism)
        if given:
            raise section.at(name).fault(
                f"found beside {numbers}, expected one of them. Remove the other"
            )
        if (body := mechanism.point(point).body) != center.body:
            raise section.at(name).fault(
                f"found {shown(point)}, which is on {shown(body)}, expected a point of the wheel"
                f" carrier {shown(center.body)}. Name one"
            )
    if vehicle.wheel_axis is not None and vehicle.aside(mechanism) <= 0.0:
        raise section.at("wheel_axis").fault(
            f"found {shown(vehicle.wheel_axis)}, which is not outboard of the wheel's centre,"
            " expected a point that is. Name another"
        )
    radius = vehicle.radius(mechanism)
    if radius == 0.0:
        raise section.at("wheel_contact").fault(
            f"found {shown(vehicle.wheel_contact)}, which is at the wheel's centre, expected a"
            " point at the road. Name another"
        )
    return replace(vehicle, wheel_radius=radius)


def _travel(section: Section, named: str | None, vehicle: Vehicle, case: Case) -> str | None:
    """Return the driver of the wheel's travel; None without such a driver.

    Args:
        named: the driver's name in the file; None for the driver of the wheel centre.
    """
    drivers = case.mechanism.drivers
    if named is None:
        of_wheel = (
            each.name
            for each in drivers
            if isinstance(each, PointCoordinate)
            and each.point == vehicle.wheel_center
            and abs(unit(each.direction) @ unit(vehicle.up)) > LEVEL
        )
        return next(of_wheel, None)
    section.at("travel").require(named, [each.name for each in drivers], "a driver")
    return named


def suspension_lines(case: Case) -> list[str]:
    """Return the lines of [suspension] and [suspension.other], in SI units; none without suspension
    outputs.

    Raises:
        CaseError: the outputs belong to wheels of several axles.
    """
    wheels = wheels_of(case)
    if not wheels:
        return []
    first, *others = wheels
    per_travel = any(isinstance(each, PerTravel) for each in case.outputs)
    lines = toml_table({**_keys(first, 0), "per_travel": per_travel}, "suspension")
    if not others:
        return lines
    other, *more = others
    own = (*_OWN, "wheel_radius") if other.wheel_contact is not None else _OWN
    alike = replace(other, side=first.side, **{name: getattr(first, name) for name in own})
    if more or alike != first or other.side is first.side:
        raise CaseError(
            f"case {case.name!r}: its outputs are of several axles, and [suspension] is of one."
            " Leave out the others"
        )
    names = {*_OWN, "kingpin_links", "travel"}
    of_other = {key: value for key, value in _keys(other, -1).items() if key in names}
    always = ("wheel_center", "static_toe", "static_camber")
    given = {name: getattr(other, name) for name in always}
    return [*lines, *toml_table({**given, **of_other}, "suspension", "other")]


def wheels_of(case: Case) -> list[Vehicle]:
    """Return the wheels of the outputs of a case; the first belongs in [suspension]."""
    outputs = [each for each in case.outputs if isinstance(each, SuspensionOutput)]
    first = [each.vehicle for each in outputs if isinstance(each, AxleOutput)]
    return [*dict.fromkeys([*first, *(wheel for each in outputs for wheel in each.vehicles)])]


def _keys(wheel: Vehicle, place: int) -> dict[str, Any]:
    """Return the keys of a vehicle unequal to their defaults.

    Args:
        place: index of the wheel's driver of travel among the axle's drivers of travel.
    """
    keys = {
        _key(each.name, value): value
        for each in fields(Vehicle)
        if (value := getattr(wheel, each.name)) != each.default
    }
    if wheel.wheel_contact is not None:
        del keys["wheel_radius"]
    if names := keys.pop("travel", ()):
        keys["travel"] = names[place]
    return keys


def _key(name: str, value: Any) -> str:
    """Return the key of an attribute of a vehicle."""
    if name == "kingpin" and not isinstance(value[0], str):
        return "kingpin_links"
    return "center_plane" if name == "middle" else name


def _of_wheel(
    name: str,
    section: Section,
    cls: type[SuspensionOutput],
    table: SuspensionTable | None,
    case: Case,
) -> SuspensionOutput:
    suspension = Section(section.file, "suspension", None)
    what = f"for {section.key} of type {cls.type!r}"
    if table is None:
        raise suspension.fault(f"missing, expected a table {what}. Add [suspension]")
    keys: Any = section.typed(keys_of(cls))
    if issubclass(cls, AxleOutput) and table.other is None:
        raise suspension.at("other").fault(
            f"missing, expected the other wheel {what}. Add [suspension.other]"
        )
    vehicle = _wheel(section, table, getattr(keys, "side", None))
    for need in cls.needs:
        if getattr(vehicle, need) is None:
            raise suspension.at(need).fault(f"missing, expected it {what}. Add it")
    given: dict[str, Any] = {each.name: getattr(keys, each.name) for each in own_keys(cls)}
    if issubclass(cls, AxleOutput):
        given["other"] = table.other
    _, convert = section.units.of(cls.measure)
    given_tolerance = tolerance(section, keys, convert, size(case), cls.measure)
    output = cls(name, vehicle, *given_tolerance, **given)
    if problem := output.problem:
        raise section.fault(problem)
    for each in own_keys(cls):
        value = given[each.name]
        names: tuple[str, ...] = (value,) if type(value) is str else value  # of points
        for point in names if isinstance(names, tuple) else ():  # pyright: ignore[reportUnnecessaryIsInstance]
            check_point(section.at(each.name), point, case.mechanism)
    moving = [*case.sweep.path.motions]
    if isinstance(output, Rate) and len(moving) > 1 and not output.vehicle.travel:
        raise section.at("type").fault(
            f"found {output.type!r} while {', '.join(moving)} move, expected one of them to be the"
            " wheel's travel, for it is a derivative by that. Name it by suspension.travel"
        )
    return output


def _wheel(section: Section, table: SuspensionTable, side: Side | None) -> Vehicle:
    """Return the vehicle with the wheel of an output."""
    for wheel in filter(None, (table.vehicle, table.other)):
        if side in (None, wheel.side):
            return wheel
    raise section.at("side").fault(
        f"found {shown(str(side))}, expected {table.vehicle.side}, the side in [suspension]."
        " Correct it, or add [suspension.other]"
    )


def with_slopes(outputs: Sequence[Quantity], size: float) -> tuple[Quantity, ...]:
    """Return the outputs, each output of a wheel followed by its derivative by travel.

    Args:
        size: size of the mechanism [m]. If a pose error changes an output by d, it changes the
            slope by about d / size.
    """
    both = list[Quantity]()
    for output in outputs:
        both.append(output)
        if isinstance(output, SuspensionOutput) and not isinstance(output, AxleOutput):
            both.append(PerTravel(output, output.atol / size))
    return tuple(both)


class SuspensionSection(CaseSection):
    """[suspension], and the outputs of a wheel or an axle."""

    key = "suspension"
    keys = SuspensionKeys
    heading = "outputs of a wheel: type, and"
    remark = (
        "each with its derivative by wheel travel, jounce: NAME.per_travel [unit/m]; the table"
        " [suspension] says of which wheel"
    )
    types = SuspensionOutput.registry

    def read(self, section: Section, case: Case) -> tuple[Case, SuspensionTable]:
        """Return the case with its wheels, and the table."""
        table = read_suspension(section, case)
        wheels = tuple(each for each in (table.vehicle, table.other) if each)
        return replace(case, wheels=wheels), table

    def output(
        self, name: str, section: Section, cls: type[TypedQuantity], table: Any, case: Case
    ) -> Quantity:
        """Return the output of a wheel or an axle."""
        assert issubclass(cls, SuspensionOutput)
        return _of_wheel(name, section, cls, table, case)

    def with_derived(self, case: Case, table: SuspensionTable) -> Case:
        """Return the case with derivatives by travel, unless the table wants none."""
        if not table.per_travel:
            return case
        return replace(case, outputs=with_slopes(case.outputs, size(case)))

    def convention(self, section: Section) -> str:
        """Return the convention of signs of the vehicle."""
        return str(section.at("convention").value or "")

    def lines(self, case: Case) -> Sequence[str]:
        """Return the lines of the vehicle."""
        return suspension_lines(case)

    def further(self, case: Case, output: TypedQuantity) -> Iterator[tuple[str, Any]]:
        """Yield the side of a wheel, if the case has several."""
        if "side" in output.further and len(wheels_of(case)) > 1:
            yield "side", output.side

    def wheels(self, case: Case) -> Mapping[str, SceneWheel]:
        """Return the wheels of outputs; those without a radius cannot be drawn."""
        from ...harness.scene_record import SceneWheel

        outputs = [each for each in case.outputs if isinstance(each, SuspensionOutput)]
        found: dict[str, SceneWheel] = {}
        for vehicle in (vehicle for output in outputs for vehicle in output.vehicles):
            if (radius := vehicle.radius(case.mechanism)) is not None:
                center = case.mechanism.point(vehicle.wheel_center)
                moved = {case.sweep.driver, *case.sweep.motions}
                alone = not vehicle.travel or moved <= {*vehicle.travel}
                two = len(vehicle.kingpin or ()) == len(vehicle.kingpin_points) == 2
                found[center.name] = SceneWheel(
                    body=center.body,
                    center=list(center.position),
                    spin=[float(x) for x in vehicle.spin(case.mechanism)],
                    up=list(vehicle.up),
                    radius=radius,
                    kingpin=[*vehicle.kingpin_points] if two else [],
                    middle=[*vehicle.middle] if alone else [],
                )
        return found

    def springs(self, case: Case) -> Iterator[tuple[tuple[Vector, Vector], tuple[str, str], bool]]:
        """Yield the springs and dampers of motion ratios."""
        for output in case.outputs:
            if isinstance(output, MotionRatio):
                a, b = (case.mechanism.point(name) for name in output.between)
                yield (a.position, b.position), (a.body, b.body), "damper" in output.name

    def definitions(
        self, case: Case, output: str, values: Mapping[str, Array]
    ) -> Iterator[tuple[str, Callable[[Array], Array]]]:
        """Yield the camber seen from the front, if toe is known."""
        camber = next(each for each in case.outputs if each.name == output)
        if not isinstance(camber, Camber):
            return
        for toe in case.outputs:
            if isinstance(toe, Toe) and toe.vehicle == camber.vehicle and toe.name in values:
                yield (
                    f"taken as the camber seen from the front, with tan(seen) cos({toe.name}) ="
                    f" tan({camber.name}),",
                    partial(camber_of_front_view, toe=values[toe.name]),
                )


SECTION = SuspensionSection()
