"""kincheck check-joint: check a joint type, a user's or a built-in one."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from .option_types import whole
from .registry import Registry, Status
from .verbosity import add_verbosity


def add(commands: Any) -> None:
    """Add the command to the parser."""
    checking: argparse.ArgumentParser
    checking = commands.add_parser(
        "check-joint",
        help="check your own joint type, or a built-in one",
        description=_check_joint.__doc__,
    )
    checking.set_defaults(do=_check_joint)
    checking.add_argument(
        "joint",
        metavar="JOINT",
        help="a class as MODULE:CLASS, in a module of this folder or an installed one; or a"
        " built-in type, such as revolute",
    )
    checking.add_argument(
        "--seed",
        type=whole(0),
        default=0,
        metavar="N",
        help="seed of the random poses; default %(default)s",
    )
    add_verbosity(checking, quiet="print only the failed checks and the count")


def _check_joint(options: argparse.Namespace, registry: Registry) -> int:
    """Check a joint type: its equations against their derivatives, its branches, and a closed loop
    in every engine.
    """
    from ..studies.checks.check_joint import check_joint
    from .joint_loading import named_joint

    report = check_joint(
        named_joint(options.joint),
        seed=options.seed,
        engines=[*map(registry.engine, registry.engines)],
    )
    report.print(sys.stdout, quiet=options.quiet)
    return Status.WITHIN if report.passed else Status.DEVIATES
