"""kincheck templates: print a sample table of hardpoints for each suspension template."""

from __future__ import annotations

import argparse
from typing import Any

from .registry import Registry, Status


def add(commands: Any) -> None:
    """Add the command to the parser."""
    templates: argparse.ArgumentParser
    templates = commands.add_parser(
        "templates",
        help="print a sample table of hardpoints for each suspension template",
        description=_templates.__doc__,
    )
    templates.set_defaults(do=_templates)
    templates.add_argument(
        "template", nargs="*", metavar="NAME", help="print only these; default: all"
    )
    templates.add_argument(
        "--bushings",
        action="store_true",
        help="print a file of bushings by role, for kincheck kc TABLE --bushings FILE",
    )


def _templates(options: argparse.Namespace, registry: Registry) -> int:
    """Print a table of hardpoints to fill in: `kincheck templates mcpherson > car.csv`, then
    `kincheck run car.csv`.

    Its numbers are examples. Rows marked optional may be left out, and so may the column of
    meanings.
    """
    from ..case.models.hardpoints.templates import sample_table, samples

    if options.bushings:
        from ..case.models.hardpoints.rubber import sample_bushings

        print(*samples(options.template, sample_bushings), sep="\n\n")
    else:
        print(*samples(options.template, sample_table), sep="\n")
    return Status.WITHIN
