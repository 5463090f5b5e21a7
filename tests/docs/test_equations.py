"""The index of equations leads to the lines where they stand."""

import re
from pathlib import Path

from ..support.sources import ROOT, tree
from .builder import module

PAGE = (ROOT / "docs/pages/theory/equations.md").read_text()
IS_ABSENT = module("collected").is_absent
PLACE = re.compile(r"`(\S+\.py):(\d+)` `([\w.]+)`")


def line_of(file, name):
    found = tree(file)
    for part in name.split("."):
        found = next((x for x in found.body if getattr(x, "name", None) == part), None)
        if found is None:
            return 0
    return found.lineno


def test_places_of_equations():
    places = {
        (file, name): int(line)
        for file, line, name in PLACE.findall(PAGE)
        if not IS_ABSENT(Path(file))
    }
    assert places == {(file, name): line_of(file, name) for file, name in places}


def test_every_equation_has_place():
    named = set()
    for row in PAGE.splitlines():
        if row.startswith("| (") and PLACE.search(row):
            for first, last in re.findall(r"\((\d+)\)(?:–\((\d+)\))?", row.split("|")[1]):
                named |= {*range(int(first), int(last or first) + 1)}
    assert named == {1, *range(3, 33)}  # the formulation uses all but (2)
