"""Numbers of cases in the pages are those of the library."""

import re

import kincheck.cases
import pytest
from kincheck.core.case.case import Truth

from ..support.sources import ROOT

PAGE = ROOT / "docs/pages/start/simulator.md"
SENTENCE = re.compile(
    r"The library has (\d+) cases\. (\d+) of them have closed forms that share nothing with any"
    r" engine; (\d+) have masses"
)


@pytest.mark.needs("free", "hardpoints")
def test_counts_of_cases_in_pages():
    library = [kincheck.cases.load(name) for name in kincheck.cases.names()]
    closed = [case for case in library if case.truth is Truth.CLOSED_FORM]
    with_forces = [case for case in library if case.forces]
    (found,) = SENTENCE.findall(PAGE.read_text("utf-8"))
    assert [*map(int, found)] == [len(library), len(closed), len(with_forces)]
