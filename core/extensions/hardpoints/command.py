"""The command kincheck templates."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...options import (
    argument,
    options,
    switch,
)

if TYPE_CHECKING:
    pass


@options
class PrintTemplates(Command):
    """Print a table of hardpoints to fill in: `kincheck templates mcpherson > car.csv`, then
    `kincheck run car.csv`.

    Its numbers are examples. Rows marked optional may be left out, and so may the column of
    meanings.
    """

    about = "print a sample table of hardpoints for each suspension template"
    template: tuple[str, ...] = argument("print only these, by default all", "NAME", "*")
    bushings: bool = switch(
        "print a file of bushings by role, for kincheck kc TABLE --bushings FILE"
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .templates import sample_table, samples

        if self.bushings:
            from .rubber import sample_bushings

            print(*samples(self.template, sample_bushings), sep="\n\n")
        else:
            print(*samples(self.template, sample_table), sep="\n")
        return Status.WITHIN
