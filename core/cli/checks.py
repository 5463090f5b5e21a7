"""The command kincheck check-joint."""

from __future__ import annotations

import sys

from ..options import (
    argument,
    option,
    options,
    verbosity,
    whole,
)
from .parser import Command
from .registry import Registry, Status


@options
class CheckJoint(Command):
    """Check a joint type: its equations against their derivatives, its branches, and a closed loop
    in every engine.
    """

    about = "check your own joint type, or a built-in one"
    joint: str = argument(
        "a class as MODULE:CLASS, in a module of this folder or an installed one; or a"
        " built-in type, such as revolute",
        "JOINT",
    )
    seed: int = option("seed of the random poses; default %(default)s", whole(0), "N", default=0)
    quiet: bool = verbosity("print only the failed checks and the count")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..studies.checks.check_joint import check_joint
        from .joint_loading import named_joint

        report = check_joint(
            named_joint(self.joint),
            seed=self.seed,
            engines=[*map(registry.engine, registry.engines)],
        )
        report.print(sys.stdout, quiet=self.quiet)
        return Status.WITHIN if report.passed else Status.DEVIATES
