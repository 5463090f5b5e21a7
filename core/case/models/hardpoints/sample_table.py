"""A sample table of hardpoints for each template, fit for the reader of tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from ....errors import CaseError, unknown
from .templates import TEMPLATES, Template

AXES = "forward,left,up"


def sample_tables(names: Sequence[str]) -> list[str]:
    """Return the sample tables of the templates of these names; of all templates without names.

    Raises:
        CaseError: there is no such template.
    """
    for name in names:
        if name not in TEMPLATES:
            raise CaseError(unknown("template", name, TEMPLATES))
    return [sample_table(TEMPLATES[name]) for name in names or TEMPLATES]


def sample_table(template: Template) -> str:
    """Return the text of a table to begin one's own with, in mm; its numbers are invented."""
    text = io.StringIO()
    text.write(f"# template: {template.name}\n# units: mm\n# axes: {AXES}\n")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "x", "y", "z", "meaning"))
    for roles, note in ((template.roles, ""), (template.optional, "optional: ")):
        for role in roles:
            if role.name in template.sample:
                place = (f"{1000.0 * x:.6g}" for x in template.sample[role.name])
                rows.writerow((role.name, *place, f"{note}{role.meaning}"))
    return text.getvalue()
