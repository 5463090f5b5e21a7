"""kincheck templates: print a sample table of hardpoints for each suspension template."""

from __future__ import annotations

from typing import ClassVar

from ..errors import KincheckError
from ..options import (
    argument,
    options,
    switch,
)
from .parser import Command
from .registry import Registry, Status


@options
class PrintTemplates(Command):
    """Print a table of hardpoints to fill in: `kincheck templates mcpherson > car.csv`, then
    `kincheck run car.csv`.

    Its numbers are examples. Rows marked optional may be left out, and so may the column of
    meanings.
    """

    about: ClassVar[str] = "print a sample table of hardpoints for each suspension template"
    template: tuple[str, ...] = argument("print only these; default: all", "NAME", "*")
    bushings: bool = switch(
        "print a file of bushings by role, for kincheck kc TABLE --bushings FILE"
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..case.models.hardpoints.templates import sample_table, samples

        if self.bushings:
            from ..case.models.hardpoints.rubber import sample_bushings

            texts = samples(self.template, sample_bushings)
            for name, text in zip(self.template, texts, strict=False):
                if not text:
                    raise KincheckError(
                        f"template {name}: its links are rods without joints, so no role takes a"
                        " bushing; kincheck import TABLE writes a case file, and [forces.NAME] type"
                        ' = "bushing" is a bushing there'
                    )
            print(*filter(None, texts), sep="\n\n")
        else:
            print(*samples(self.template, sample_table), sep="\n")
        return Status.WITHIN
