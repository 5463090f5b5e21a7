"""Options for files: a user's joint types, and facts that files of other tools lack."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from ..case.io.reader_options import Supplied
from ..errors import KincheckError
from ..options import group, joint_types, options, with_values
from . import parser
from .registry import tell_left_out as tell_left_out

if TYPE_CHECKING:
    from ..case.case import Case

T = TypeVar("T")


@options
class _Files:
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied)


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options to a command's parser."""
    parser.add_options(command, _Files)


def return_cases(cases: Sequence[T], supplied: Supplied) -> tuple[list[T | str], Supplied]:
    """Return cases and facts with the files of --hold, --start and --without among the cases: these
    options take several names, and in `run --hold knee hip model.xml` also the file.
    """
    given = {name: getattr(supplied, name) for name in ("hold", "start", "without")}
    files = [name for each in given.values() for name in each if os.path.isfile(name)]
    left = {
        option: tuple(name for name in each if name not in files) for option, each in given.items()
    }
    return [*cases, *files], replace(supplied, **left)


def supplied(options: argparse.Namespace) -> Supplied:
    """Return the facts supplied by options."""
    own = {name: getattr(options, name, None) for name in ("bushings",)}
    return with_values(parser.values_of(Supplied, options), **own)


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
            f" {bare}. Give a value of the driver {driver}."
        ) from None
