"""Options for files: a user's joint types, and facts that files of other tools lack."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..case.io.reader_options import LEFT_OUT, Supplied
from ..errors import KincheckError
from ..report.progress import complain
from .option_types import add_several, positive
from .registry import add_joint_types

if TYPE_CHECKING:
    from ..case.case import Case


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options to a command's parser."""
    add_joint_types(command)
    command.add_argument(
        "--closure",
        type=positive,
        metavar="X",
        help=(
            "accept gaps up to X [m] that stem from rounded digits of the file: rows that are"
            " redundant within X are left out; default: [closure] tolerance of a case file, else 0;"
            " for a model, from its digits"
        ),
    )
    points = command.add_argument_group(
        "hardpoints",
        (
            "Suspensions of Project Chrono (.json), Adams/Car (.sub), tables (.csv, .xlsx), trees"
            " (.yaml, .json) and scripts (.m)."
        ),
    )
    points.add_argument(
        "--template",
        metavar="NAME",
        help="type of suspension, if the file does not state it; kincheck templates prints them",
    )
    points.add_argument(
        "--units",
        metavar="UNIT",
        help="unit of the coordinates, such as mm or m, if the file does not state it",
    )
    points.add_argument(
        "--axes",
        metavar="X,Y,Z",
        help=(
            "directions of x, y and z, if the file does not state them: forward,left,up or"
            " rearward,right,up, ..."
        ),
    )
    points.add_argument(
        "--side",
        metavar="SIDE",
        help="side of the wheel, left or right; without it, the side follows from the points",
    )
    points.add_argument(
        "--names",
        type=Path,
        metavar="FILE",
        help=(
            'names of the points in the file: TOML, with a line ROLE = "NAME" for each; a new FILE'
            " is written"
        ),
    )
    points.add_argument(
        "--ask-names",
        action="store_true",
        help="refuse names that are only like those of the template, with a guess for each",
    )
    points.add_argument(
        "--wheel-radius",
        metavar="M",
        help=(
            "radius of the loaded wheel, such as 300mm, if no point is its contact: for roll"
            " centre, scrub radius and trail"
        ),
    )
    points.add_argument(
        "--wheelbase",
        metavar="M",
        help="wheelbase [m], for Ackermann, turning circle and anti-values",
    )
    points.add_argument(
        "--rack-per-turn",
        metavar="M",
        help="travel of the rack per turn of the steering wheel [m], for the steering ratio",
    )
    points.add_argument(
        "--axle",
        metavar="MOTION",
        help=(
            "motion of both wheels, the right one a mirror image of the left, and a rack: heave,"
            " roll or steer, over --travel of the left wheel or of the rack"
        ),
    )
    points.add_argument(
        "--travel",
        metavar="M[:SAMPLES]",
        help=(
            "travel of the wheel, up and down, default 50mm:41; or START:STOP:SAMPLES, positive"
            " up: --travel=-40:120mm:33; in metres without a unit"
        ),
    )
    points.add_argument(
        "--rack",
        metavar="M",
        help=(
            "travel of the rack while the wheel goes up, such as 20mm, positive to the left: -M to"
            " M, or START:STOP; in metres without a unit"
        ),
    )
    points.add_argument(
        "--position",
        metavar="AXLE",
        help="axle, front or rear, for anti-values; with --wheelbase, --cg-height and a share",
    )
    points.add_argument(
        "--cg-height",
        metavar="M",
        help="height of the vehicle's centre of gravity above the road [m]",
    )
    points.add_argument(
        "--brake-share", metavar="X", help="share of the braking force at this axle, 0 to 1"
    )
    points.add_argument(
        "--drive-share", metavar="X", help="share of the driving force at this axle, 0 to 1"
    )
    points.add_argument(
        "--corner",
        metavar="NAME",
        help="wheel of a table of the whole car: FL, FR, RL, RR, or in words",
    )
    points.add_argument(
        "--sheet",
        metavar="NAME",
        help="sheet of a workbook with several tables, or section of a tree, such as front",
    )
    model = command.add_argument_group(
        "models",
        "Models (MJCF, URDF, SDF, USD, OpenSim), which do not state drivers, and datasets of Adams"
        " (.adm).",
    )
    model.add_argument(
        "--drive",
        action="append",
        default=[],
        metavar="JOINT:START:STOP[:SAMPLES]",
        help=(
            "a joint that moves, as qpos, in rad or m without a unit: knee:-30:30deg:61; several"
            " move together"
        ),
    )
    add_several(model, "--hold", "joints or free bodies that do not move")
    model.add_argument(
        "--hold-rest",
        action="store_true",
        help="hold as many joints as needed: free bodies, joints with an actuator, others",
    )
    add_several(
        model,
        "--without",
        "elements of a model to leave out, by tag, name or TAG/NAME, or statements of a dataset"
        " of Adams, as BUSHING or BUSHING/3; a note beside every verdict says so",
    )
    add_several(
        model,
        "--start",
        "keyframe:NAME, or JOINT=VALUE, as qpos, in rad or m without a unit, instead of qpos0;"
        " the start is assembled to close, and a note says by how far joints moved",
        metavar="WHERE",
    )


def return_cases(options: argparse.Namespace) -> None:
    """Move files from --hold, --start and --without back to the cases: these options take several
    names, and in `run --hold knee hip model.xml` also the file.
    """
    for given in (options.hold, options.start, options.without):
        files = [name for name in given if os.path.isfile(name)]
        options.case += files
        given[:] = [name for name in given if name not in files]


def supplied(options: argparse.Namespace) -> Supplied:
    """Return the facts supplied by options."""
    given: dict[str, Any] = {
        each.name: getattr(options, each.name, None)  # few commands have bushings
        for each in fields(Supplied)
        if each.name != "recorded"
    }
    given |= {name: (*given[name],) for name in ("drive", "hold", "start", "without")}
    given["recorded"] = bool(getattr(options, "recorded", ()))
    return Supplied(**given)


def tell_left_out(cases: Iterable[Case]) -> None:
    """Print on standard error the parts of other tools' files that were left out."""
    complain(f"{case.name}: {case.source}" for case in cases if LEFT_OUT in case.source)


def driver_value(text: str | None, case: Case) -> float | None:
    """Return the value of the swept driver in an option, in SI; None without one.

    Raises:
        KincheckError: it is no number, or has the unit of something else.
    """
    from ..case.case import TIME
    from ..case.io.document import measure
    from ..case.units import ANGLES, LENGTHS, SECOND

    if text is None:
        return None
    driver = case.sweep.driver
    turns = driver != TIME and case.mechanism.driver(driver).turns
    units = {"s": SECOND} if driver == TIME else ANGLES if turns else LENGTHS
    bare = "s" if driver == TIME else "rad" if turns else "m"
    try:
        return measure(text, units, bare)[0]
    except ValueError:
        raise KincheckError(
            f"--at: {text!r} is not a number with one of the units {', '.join(units)}, or in"
            f" {bare}; give a value of the driver {driver}"
        ) from None
