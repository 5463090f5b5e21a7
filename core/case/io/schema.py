"""The keys of a case file, schema kincheck-case/1: their values and defaults.

The keys of a joint's geometry, of a driver and of a motion are the fields of its class. A new type
needs no change here.

Reference. A case file is TOML, or JSON with the same keys. Points and directions are global, at the
design position, as in a table of hardpoints; directions have any length but zero. Numbers are in SI
units and radians unless [units] states others; results are always in SI. Keys in brackets may be
left out. `kincheck list --joints` prints all types with their keys.

    schema = "kincheck-case/1"
    name, source         name of the case, and source of its numbers
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
                         has several: ["rotation", "translation"], of driven and driving
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
                         (rate) = 1, in driver units per second
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
    [closure]            (tolerance) [length]: points and axes have few digits; rows redundant
                         within the tolerance are left out, with a note; strict without it;
                         --closure of the command line overrides it
                         (carrying) = [JOINT, ...]: joints that keep all their rows, as long as
                         others can close the loops
                         (notes) = [...]: on the closure of the start before the file was written
    [outputs.NAME]       (type) = "coordinate": point, component = "x", "y" or "z", or direction
                         type = "distance": points = [A, B]
                         type = "joint_angle" or "joint_displacement": joint
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
                         (axle) = "front" or "rear"; (wheelbase), (cg_height), above the road
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
    [reference]          true values: file, the name of a CSV file beside the case file, or rows,
                         with (columns)
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
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from ...mechanism.body import SIX_NUMBERS, Inertia
from ...mechanism.mechanism import Vector
from ..case import TIME, Truth

SCHEMA = "kincheck-case/1"
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
Truths = Annotated[Truth, Meta(description=f"one of {', '.join(Truth)}")]


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
    sweep: Table
    truth: Truths | None = None
    units: Table = {}
    joints: Table = {}
    couplers: Table = {}
    points: Table = {}
    closure: Table = {}
    suspension: Table | None = None
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
