"""The keys of a case file, schema kincheck-case/1: their values and defaults.

The keys of a joint's geometry, of a driver and of a motion are the fields of its class. A new type
needs no change here.

Reference. A case file is TOML, or JSON with the same keys. Points and directions are global, at the
design position, as in a table of hardpoints; directions have any length but zero. Numbers are in SI
units and radians unless [units] states others; results are always in SI. Keys in brackets may be
left out. `kincheck list --joints` prints all types with their keys.

    schema = "kincheck-case/1"
    name, source         name of the case, and source of its numbers
    (formerly)           list of its earlier names, whose history it goes on with
    (gravity), [forces.NAME]   see masses and loads below
    (truth)              kind of the reference, with a reference only: closed_form,
                         third_party_data or in_house_oracle

    [units]              (length) "m" or "mm", (angle) "rad" or "deg"; time is in s and Hz
    [bodies.NAME]        (origin) = [0, 0, 0], (euler_parameters) = [1, 0, 0, 0], e0..e3, body to
                         global; (fixed) = false
                         (mass), (center_of_mass), (inertia): see masses and loads below
                         the body "ground" exists without a declaration
    [joints.NAME]        type, bodies = [first, second], and the keys of the type: point, axis,
                         lengths, ...
                         own types: declare them by --joint-type MODULE:CLASS
                         type, joints = [first, second], for a coupler of two other joints: gear
                         (ratio), rack_pinion (radius)
    [couplers.NAME]      the same couplers; polynomial: joints = [driven, driving], coefficients =
                         [c0, c1, c2, c3, c4], driven = c0 + c1 driving + c2 driving^2 + ...
                         [units of driven by powers of units of driving]; (freedoms), if a joint
                         has several: ["rotation", "translation"], of driven and driving;
                         spline: joints = [driven, driving], points = [[driving, driven], ...], the
                         cubic spline of OpenSim's SimmSpline through them, straight beyond;
                         linear_coupler: joints = [first, second, third, ...], factors = [...], one
                         for each: the sum of factors times coordinates stays zero
                         a joint's rotation and displacement: its second body relative to its
                         first, about and along its axis by the right-hand rule, zero at design
    [points.NAME]        body, position: a point to compare or to drive
    [drivers.NAME]       type = "point_coordinate": point, direction, (relative) = true
                         type = "joint_angle" or "joint_displacement": joint, (relative) = true;
                         for joints with a rotation or a translation: revolute, cylindrical,
                         screw, planar (its turn), translational
                         values are relative to the design position; relative = false: absolute;
                         for joints both are the same
    [drivers.NAME.motion]   motion over time; without it, the driver holds its design value unless
                         it is swept
                         type = "ramp": rate, per second
                         type = "sine": amplitude, frequency [Hz], (phase) = 0:
                         amplitude sin(2 pi frequency t + phase)
                         type = "table": times [s], values: the natural cubic spline through them;
                         the times must cover the sweep
                         type = "formula": formula over TIME, such as "STEP(TIME, 0, 0, 1, 1)",
                         (scale) = 1 and (offset) = 0, in driver units, (second) = 1 [s], TIME's
                         unit: offset + scale formula
    [sweep]              (driver), start, stop, steps: samples with both ends, 1 if they are equal;
                         (rate) = 1, in driver units per second; 0: at rest at every sample, for
                         static efforts and reactions; times are then those of rate 1
                         driver: its samples from start to stop; it has its design value at time
                         zero, and moves at the rate; the sign of the rate gives the direction
                         at = "reference", in place of start, stop and steps: the samples of the
                         reference
                         no driver, or "time": start and stop are times [s], there is no rate, and
                         the motions move everything
                         the solver follows both kinds from the design position, in both directions:
                         from time zero, or from a sample with the design values to six digits;
                         without such a start, all drivers go straight from the design to their
                         values at time zero if it is in the sweep, else at the first sample, and
                         the result says so
    [free]               duration [s], samples, both ends included: the motion without drivers, for
                         `kincheck free`; (rates) = {DRIVER or JOINT = number}: at the start, units
                         per second; with [free], [drivers] and [sweep] may be left out
    [closure]            (tolerance) [length]: points and axes have few digits; rows redundant
                         within the tolerance are left out, with a note; strict without it;
                         --closure of the command line overrides it
                         (carrying) = [JOINT, ...]: joints that keep all their rows, as long as
                         others can close the loops
                         (notes) = [...]: on the closure of the start before the file was written
    [outputs.NAME]       (type) = "coordinate": point, component = "x", "y" or "z", or direction
                         type = "distance": points = [A, B]
                         type = "joint_angle" or "joint_displacement": joint; (at_design) = 0: its
                         value at the design position, as that of a model's coordinate
                         type = "orientation": body, component of its rotation since design, global
                         axes: "x", "y" or "z" of the rotation vector of the smallest rotation, at
                         most pi, or Euler parameter "e0" to "e3", whose sign is continuous
                         type = "angle": bodies = [first, second], directions, one on each
                         type = "toe", "camber", ...: of the wheel in [suspension]; `kincheck list
                         --outputs` prints them with their keys, signs and needs; each has its
                         derivative by wheel travel, NAME.per_travel
                         (relative) = false; true: measured from the design; not for quotients of
                         velocities, such as motion_ratio, nor for measures of zero at design
                         (atol), in the output's unit, (rtol), of the range of the true values:
                         with either, (why), the reason
                         no outputs: x, y and z of every point
    [suspension]         vehicle data of suspension outputs
                         convention = "iso8855" or "sae_j670" (z down), of the signs;
                         side = "left" or "right", of the wheel
                         forward, up: perpendicular directions of the vehicle in the file's axes
                         (wheel_center) = "wheel_center", the name of a point;
                         (center_plane) = [0, 0, 0], a point in the middle
                         (static_toe) = 0, toe-in, and (static_camber) = 0, top outboard: angles of
                         the wheel at design; or (wheel_axis), a point of the carrier on the axis
                         of rotation, outboard
                         (kingpin) = ["lower", "upper"], names of points; or (kingpin_links), of
                         four rods: [["on the body", "on the wheel carrier"], ...], all but the
                         steering rod; (wheel_radius), loaded, to the contact centre; or
                         (wheel_contact), a point of the carrier as far from the wheel centre
                         (axle) = "front" or "rear"; (wheelbase), (cg_height), above the road;
                         (rack_per_turn), travel of the rack per turn of the steering wheel
                         (brakes) = "outboard", (drive) = "inboard": support of the torque; outboard
                         on the wheel carrier, inboard on the vehicle body
                         (brake_share), (drive_share): parts of the vehicle's force at this axle,
                         0 to 1
                         (per_travel) = true: derivatives by travel, upward motion of the wheel
                         centre
                         (travel), name of the travel's driver; default: the driver of the wheel
                         centre; derivatives by travel hold all other drivers
    [suspension.other]   the axle's other wheel: wheel_center, (kingpin) or (kingpin_links),
                         (static_toe), (static_camber), (wheel_axis), (wheel_contact), (travel);
                         the rest is as in [suspension];
                         outputs of one wheel may then have (side)
    [equilibrium]        the case rests with gravity and springs: (held) = [DRIVER, ...], which keep
                         their values or are swept; the others are free, and their efforts vanish;
                         [sweep] may be left out
    [compliance]         of `kincheck kc`: (wheel), the body that carries the wheel; (contact), the
                         point where it touches the road; (held) = [DRIVER, ...], which keep their
                         values, others are free, default: all; (loads) = ["longitudinal",
                         "lateral", "braking", "aligning"]; (tire_stiffness) [N/length], vertical,
                         for the ride rate
    [reference]          true values: file, the name of a CSV file beside the case file, or rows,
                         with (columns); (sheet), the name of one of several in an .xlsx file
                         beside: in its folder or below, also after following links; a foreign case
                         file opens no other file
                         first column: swept values; others: OUTPUT, OUTPUT.velocity,
                         OUTPUT.acceleration; interpolated unless its rows are at samples of the
                         sweep; errors of interpolation and printed digits enter the tolerance
                         a CSV file of suspension outputs names their convention in a comment:
                         # signs: iso8855
                         (citation), source of the true values: author, title, page or address;
                         without it, agreement is never called validated
                         (digest) = "sha256:...", of the file, as sha256sum prints it: a file with
                         another digest is refused

Masses and loads of a case file: their keys, and their numbers in SI.

All keys may be left out. A case without masses and loads has no forces. The motion does
not depend on masses and loads. Mass is in kg, time in s and force in N, for any [units]. All other
numbers follow the file's units of length and angle. With length = "mm" and angle = "deg", as in
Adams: lengths in mm, torque in N mm, stiffness in N/mm, damping in N s/mm, torsional stiffness in
N mm/deg, torsional damping in N mm s/deg, inertia in kg mm^2, gravity in mm/s^2 (-9806.65 on
Earth). Points and vectors are global, at the design position. Results are always in SI.

    (gravity) = [0, 0, 0]   acceleration of free fall, global axes [length/s^2]
    [bodies.NAME]        (mass) = 0 [kg]
                         (center_of_mass), global: the body's origin unless given
                         (inertia) = [Ixx, Iyy, Izz, Ixy, Iyz, Ixz], entries of the matrix about the
                         centre of mass, global axes at design [kg length^2]; the products have the
                         sign of the matrix entry, Ixy = -sum of m x y; default: zero, a point mass
    [joints.NAME.bushings.X]   keys of a bushing; bodies and point are the joint's unless given; it
                         stands for its bushings in `run`, and they for it in `kc`; those of a
                         "distance" are at its points
    [forces.NAME]        type = "spring_damper": bodies = [first, second], points = [on first, on
                         second], stiffness [N/length], (damping) = 0 [N s/length],
                         (free_length), default: the length at design; tension is positive
                         type = "torsion_spring_damper": joint with a rotation, stiffness
                         [N length/angle], (damping) = 0 [N length s/angle], (free_angle) = 0: the
                         joint's angle is zero at design
                         both: (curve) = [[deflection, force or torque], ...], of progressive rates
                         and bump stops, smooth through the rows and straight beyond; it adds to the
                         stiffness, which may then be left out
                         type = "bushing": bodies = [first, second], point, (axes), the first and
                         second, fixed in the first body, default: global; one number or three, by
                         the axes: (stiffness) = 0 [N/length], (damping) = 0 [N s/length],
                         (preload) = 0 [N], on the first body; about them:
                         (turning_stiffness) = 0 [N length/angle], (turning_damping) = 0;
                         (curve), one or one for each axis; (law) = "euler_parameters" or "cardan"
                         type = "force": body, point, vector [N], (frame) = "global": its direction
                         is constant; "body": it turns with the body
                         type = "torque": body, vector [N length], (frame) = "global"
                         `kincheck list --joints` prints these types too
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, fields
from enum import StrEnum
from functools import cache
from typing import Annotated, Any, Literal, TypeAlias, get_args, get_type_hints

import msgspec
from msgspec import Meta

from ...joints import Coupler, Joint, Kind
from ...mechanism.body import ANGLE, SIX_NUMBERS, Inertia, dimension_of
from ...mechanism.loads import Axes, Bushing, ForceElement, SpringDamper, dimensions_of
from ...mechanism.mechanism import Vector
from ...mechanism.motions import Driver, Motion
from ..case import TIME, Truth
from ..measures import NAMES, key_of
from ..quantity import TypedQuantity, own_keys

SCHEMA = "kincheck-case/1"
SCHEMA_FILE = "kincheck-case.schema.json"
"""The output of `kincheck schema case` beside a case file, by which editors complete its keys."""
CITATION = "a text that says where the true values come from: author, title, page or address"
DIGEST = "sha256:"
MOST_SAMPLES = 1_000_000
COORDINATE = "coordinate"
"""The default type of an output."""

Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]
Flag = Annotated[bool, Meta(description="true or false")]
Number = Annotated[float, Meta(description="a number")]
Size = Annotated[float, Meta(ge=0.0, description="a number that is not negative")]
Numbers3 = Annotated[Vector, Meta(description="three numbers [x, y, z]")]
Numbers = Annotated[tuple[float, ...], Meta(description="a list of numbers")]
Numbers4 = Annotated[
    tuple[float, float, float, float], Meta(description="four numbers [e0, e1, e2, e3]")
]
Numbers6 = Annotated[Inertia, Meta(description=SIX_NUMBERS)]
Table = Annotated[dict[str, Any], Meta(description="a table")]
Bodies = Annotated[tuple[str, str], Meta(description='two names ["first body", "second body"]')]
Joints = Annotated[tuple[str, str], Meta(description='two names ["first joint", "second joint"]')]
Several = Annotated[tuple[str, ...], Meta(description="a list of names of joints")]
Points = Annotated[tuple[str, str], Meta(description='two names ["first point", "second point"]')]
Rods = Annotated[
    tuple[tuple[str, str], tuple[str, str], tuple[str, str], tuple[str, str]],
    Meta(description='the ends of four rods [["on the body", "on the wheel carrier"], ...]'),
]
Length = Annotated[float, Meta(gt=0.0, description="a positive length")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="a part of the whole, 0 to 1")]


def one_of(words: Iterable[str]) -> Meta:
    """Return the description of one of some words."""
    return Meta(description=f"one of {', '.join(words)}")


class UnitsKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[units] of all numbers in the file."""

    length: Annotated[Literal["m", "mm"], Meta(description='"m" or "mm"')] = "m"
    angle: Annotated[Literal["rad", "deg"], Meta(description='"rad" or "deg"')] = "rad"


class CaseKeys(msgspec.Struct, forbid_unknown_fields=True):
    """The tables of the file."""

    schema: Annotated[str, Meta(description=f'"{SCHEMA}"')]
    name: Text
    source: Annotated[
        str, Meta(min_length=1, description="a text that says where the numbers come from")
    ]
    bodies: Table
    drivers: Table
    formerly: Annotated[
        list[Text], Meta(description="earlier names of the case, whose history it goes on with")
    ] = []
    sweep: Table | None = None
    truth: Annotated[Truth, one_of(Truth)] | None = None
    units: Table = {}
    joints: Table = {}
    couplers: Table = {}
    points: Table = {}
    closure: Table = {}
    outputs: Table = {}
    reference: Table | None = None
    gravity: Numbers3 = (0.0, 0.0, 0.0)
    forces: Table = {}


class BodyKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[bodies.NAME]; the frame is global and aligned unless given."""

    origin: Numbers3 = (0.0, 0.0, 0.0)
    euler_parameters: Numbers4 = (1.0, 0.0, 0.0, 0.0)
    fixed: Flag = False
    mass: Size = 0.0
    center_of_mass: Numbers3 | None = None
    inertia: Numbers6 | None = None


class PointKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[points.NAME]; global at design."""

    body: Text
    position: Numbers3


class SweepKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[sweep]; start, stop and rate in the driver's unit, or seconds."""

    driver: Text = TIME
    at: Annotated[Literal["reference"], Meta(description='"reference"')] | None = None
    start: Number | None = None
    stop: Number | None = None
    steps: (
        Annotated[
            int,
            Meta(
                ge=1, le=MOST_SAMPLES, description=f"a whole number of samples, 1 to {MOST_SAMPLES}"
            ),
        ]
        | None
    ) = None
    rate: Number | None = None


class ClosureKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[closure]; tolerance of gaps, and of angles times the mechanism's size, due to few digits."""

    tolerance: Annotated[float, Meta(gt=0.0, description="a length greater than zero")] | None = (
        None
    )
    carrying: Annotated[tuple[str, ...], Meta(description="a list of names of joints")] = ()
    notes: Annotated[tuple[str, ...], Meta(description="a list of texts")] = ()


class ToleranceKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[outputs.NAME] of any type: a tolerance with its reason."""

    atol: Size | None = None
    rtol: Size | None = None
    why: Text | None = None


class OutputKeys(ToleranceKeys, forbid_unknown_fields=True, kw_only=True):
    """[outputs.NAME] of a coordinate; component or direction."""

    point: Text
    type: Literal["coordinate"] = COORDINATE
    component: Annotated[Literal["x", "y", "z"], Meta(description='"x", "y" or "z"')] | None = None
    direction: Numbers3 | None = None
    relative: Flag = False


class ReferenceKeys(msgspec.Struct, forbid_unknown_fields=True):
    """Keys of [reference]: `file`, or `rows` with `columns` (default: the driver, then all outputs
    in order), and their source.

    Attributes:
        citation: source of the true values; without it, agreement with them validates nothing.
        digest: digest of the file; a file with another digest is refused.
        sheet: sheet of a workbook with several tables.
    """

    file: (
        Annotated[
            str,
            Meta(min_length=1, description="the name of a CSV or .xlsx file beside the case file"),
        ]
        | None
    ) = None
    sheet: (
        Annotated[str, Meta(min_length=1, description="the name of a sheet of an .xlsx file")]
        | None
    ) = None
    columns: (
        Annotated[
            list[str], Meta(min_length=2, description="a list of column names, the driver first")
        ]
        | None
    ) = None
    rows: (
        Annotated[
            list[list[int | float]], Meta(min_length=1, description="a list of rows of numbers")
        ]
        | None
    ) = None
    citation: Annotated[str, Meta(pattern=r"\S", description=CITATION)] | None = None
    digest: (
        Annotated[
            str,
            Meta(
                pattern=f"^{DIGEST}[0-9a-f]{{64}}$",
                description=f'"{DIGEST}" and 64 hexadecimal digits',
            ),
        ]
        | None
    ) = None


Described: TypeAlias = Joint | Coupler | Driver | Motion | ForceElement
_INHERITED = {each.name for base in (Joint, Coupler, Driver, Motion) for each in fields(base)}
_SHAPES: Mapping[Any, Any] = {
    Kind.POSITION: Vector,
    Kind.DIRECTION: Vector,
    Kind.POSITIONS: tuple[Vector, Vector],
    Kind.DIRECTIONS: tuple[Vector, Vector],
    Kind.LENGTH: float,
}
_OF_JOINTS: Mapping[Any, Any] = {
    "tuple[float, ...]": Numbers,
    "tuple[tuple[float, float], ...]": Annotated[
        tuple[tuple[float, float], ...], Meta(description="a table of pairs of numbers")
    ],
    "tuple[str, str]": Annotated[
        tuple[Literal["rotation", "translation"], Literal["rotation", "translation"]],
        Meta(description='two of "rotation", "translation", of the first and second joint'),
    ],
    "tuple[str, ...]": Annotated[
        tuple[Literal["rotation", "translation"], ...],
        Meta(description='a list of "rotation" and "translation", of each joint'),
    ],
}
"""Shape of a coupler's field with several values, by its annotation."""
_OF_FIELDS: Mapping[Any, Any] = {
    str: Text,
    bool: Flag,
    float: Number,
    Vector: Numbers3,
    tuple[float, ...]: Numbers,
    tuple[str, str, str]: Annotated[
        tuple[str, str, str],
        Meta(description='three names ["first of the axis", "second", "point of the part"]'),
    ],
    str | None: Annotated[str | None, Meta(description="a name")],
    Vector | None: Annotated[Vector | None, Meta(description="a direction [x, y, z]")],
    tuple[Vector, Vector]: Annotated[
        tuple[Vector, Vector], Meta(description="two directions [[x, y, z], [x, y, z]]")
    ],
}
_PAIRS_OF_SPRING = tuple[tuple[float, float], ...] | None
_PAIRS = Annotated[
    tuple[tuple[float, float], ...] | None, Meta(description="a table of pairs of numbers")
]
_CURVES = Annotated[
    tuple[tuple[float | tuple[float, float], ...], ...] | None,
    Meta(description="a table [[displacement, force], ...], or one for each axis"),
]
_ONE_OR_THREE = Annotated[float | Vector, Meta(description="a number, or three along the axes")]
_FRAME = Annotated[Literal["global", "body"], Meta(description='"global" or "body"')]


def own_fields(cls: type[Described]) -> list[Field[Any]]:
    """Return the fields of a class itself, without the fields of its kind; case files give them."""
    return [
        each
        for each in fields(cls)
        if each.name not in _INHERITED and not each.metadata.get("hidden")
    ]


@cache
def keys_of(cls: type[Described | TypedQuantity]) -> type[msgspec.Struct]:
    """Return the keys of a type: `type`, what it joins, its own fields, and for an output its
    tolerance and the reason.
    """
    keys: list[Any] = [("type", Text)]
    quantity = issubclass(cls, TypedQuantity)
    if issubclass(cls, Coupler):
        keys.append(("joints", Joints if cls.count else Several))
    elif issubclass(cls, Joint | SpringDamper | Bushing):
        keys.append(("bodies", Bodies))
    elif issubclass(cls, TypedQuantity):
        keys += [(key, *shape) for key, shape in cls.further.items()]
    # classes of users may have annotations that only their own modules can resolve
    hints = {} if issubclass(cls, Joint | Coupler) else get_type_hints(cls)
    for each in own_keys(cls) if quantity else own_fields(cls):
        key = (key_of(each), _shape(each, hints.get(each.name)))
        keys.append(key if each.default is MISSING else (*key, each.default))
    if issubclass(cls, Driver):
        keys.append(("motion", Table | None, None))
    bases = (ToleranceKeys,) if quantity else None
    return msgspec.defstruct(
        cls.__name__, keys, bases=bases, kw_only=True, forbid_unknown_fields=True
    )


@cache
def bushing_keys() -> type[msgspec.Struct]:
    """Return the keys of a joint's bushing: bodies and point are by default the joint's."""
    hints = get_type_hints(Bushing)
    place = Annotated[Vector | None, Meta(description="a point [x, y, z]")]
    keys: list[Any] = [
        ("bodies", Annotated[Bodies | None, Meta(description="two names of bodies")], None),
        ("point", place, None),
    ]
    keys += [
        (each.name, _shape(each, hints[each.name]), each.default)
        for each in own_fields(Bushing)
        if each.name != "point"
    ]
    return msgspec.defstruct("BushingKeys", keys, kw_only=True, forbid_unknown_fields=True)


def _shape(each: Field[Any], hint: Any) -> Any:
    """Return the annotation of a field, by its kind, dimension, name or type.

    Args:
        hint: type of the field; None for that of a joint or coupler.
    """
    if (kind := each.metadata.get("kind")) is not None:
        return Annotated[_SHAPES[kind], Meta(description=kind.value)]
    if dimensions_of(each) is not None:
        return _PAIRS if hint == _PAIRS_OF_SPRING else _CURVES
    dimension = dimension_of(each)
    if dimension and hint == Vector and each.default is not MISSING:
        return _ONE_OR_THREE
    if dimension and hint != Vector:
        return Number if dimension is ANGLE else Size
    if hint is None:
        return _OF_JOINTS.get(each.type, Number)
    if hint is Axes:
        return _FRAME
    for words in (hint, *get_args(hint)):
        if isinstance(words, type) and issubclass(words, StrEnum):
            return Annotated[hint, one_of(words)]
    if hint == tuple[str, str]:
        what = NAMES.get(key_of(each), "point")
        return Annotated[hint, Meta(description=f'two names ["first {what}", "second {what}"]')]
    return _OF_FIELDS[hint]
