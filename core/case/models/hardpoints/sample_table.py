"""A sample table of hardpoints for each template, which the reader of tables reads."""

from __future__ import annotations

import csv
import io

from .templates import Template

AXES = "forward,left,up"


def sample_table(template: Template) -> str:
    """Return the text of a table of one's own to begin with, in mm; its numbers are made up."""
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
