"""The page of definitions names every output of a suspension, with a formula."""

import re

from kincheck.core.case.measures import Measure
from kincheck.core.extensions.hardpoints.suspension import SuspensionOutput

from ...support.sources import ROOT

DOCS = ROOT / "core/extensions/hardpoints/docs"
PAGE = (DOCS / "theory/outputs.md").read_text()


def test_definitions_have_every_output():
    rows = [line.split("|") for line in PAGE.splitlines() if line.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row[1]) if row[2].strip()}
    assert {*SuspensionOutput.registry} - named == set()
    motions = {name for name, cls in Measure.registry.items() if not hasattr(cls, "of_key")}
    assert all(f"`{name}`" in PAGE for name in motions)


def test_drawings_of_definitions_are_there():
    found = re.findall(r"\]\(\.\./(figures/\w+\.svg)\)", PAGE)
    assert len(found) == 6
    assert all((DOCS / each).is_file() for each in found)
