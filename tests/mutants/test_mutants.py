"""Changes of a source text, and the sample of them."""

import ast
import tomllib

import pytest
from kincheck.core.doors import extensions

from ..support.sources import ROOT, files
from .__main__ import HARMLESS, harmless, sample, table
from .related import Entered, block_of
from .sites import mutants

SOURCE = '''"""Docstring of 1."""
from __future__ import annotations
LIMIT: float = 2.5
@dataclass(frozen=True)
class Case:
    count: int = 1
    def chosen(self, values: list[int] | None, other=0):
        """Docstring of 2."""
        if values is None and not self.ready:
            return f"{other + 1}"
        for k, value in enumerate(values):
            if value:
                continue
        return max(values[0] - other, min(k, 3)) <= -LIMIT
'''
EXPECTED = [
    ["LIMIT: float = 5.0"],
    ["count: int = 0", "count: int = 2"],
    ["def chosen(self, values: list[int] | None, other=1):"],
    ["if values is not None and not self.ready:"],
    ["if values is None or not self.ready:"],
    ["if values is None and self.ready:"],
    ["return None"],
    ["if not value:"],
    ["break"],
    [
        "return None",
        "return min(values[0] - other, min(k, 3)) <= -LIMIT",
    ],
    ["return max(values[1] - other, min(k, 3)) <= -LIMIT"],
    ["return max(values[0] + other, min(k, 3)) <= -LIMIT"],
    ["return max(values[0] - other, max(k, 3)) <= -LIMIT"],
    ["return max(values[0] - other, min(k, 4)) <= -LIMIT"],
    [
        "return max(values[0] - other, min(k, 3)) < -LIMIT",
        "return max(values[0] - other, min(k, 3)) > -LIMIT",
    ],
    ["return max(values[0] - other, min(k, 3)) <= LIMIT"],
]


def test_mutants_change_one_token():
    found = mutants("case.py", SOURCE)
    assert [[each.mutant for each in place] for place in found] == EXPECTED
    for each in (each for place in found for each in place):
        changed = each.applied(SOURCE).splitlines()
        different = [
            (k, new.strip())
            for k, (old, new) in enumerate(zip(SOURCE.splitlines(), changed, strict=True), 1)
            if new != old
        ]
        assert different == [(each.start[0], each.mutant)]
    functions = {each.line: each.function for place in found for each in place}
    assert functions["count: int = 1"] == ""
    assert functions["continue"] == "Case.chosen"


@pytest.mark.nightly
def test_mutant_sample_covers_rooms_and_stays():
    sources = {str(path): (ROOT / path).read_text("utf-8") for path in files("core", "adapters")}
    sites = {path: mutants(path, text) for path, text in sources.items()}
    few, many = (sample(sites, count, 7) for count in (100, 300))
    assert (len({*few}), len({*many})) == (100, 300)
    assert len({*few} - {*many}) < 10  # shares are rounded
    assert len({each.path.split("/")[1] for each in many}) > 12
    for each in few:
        assert ast.dump(ast.parse(each.applied(sources[each.path])))


def test_harmless_mutants_are_of_present_code():
    marks = tomllib.loads(HARMLESS.read_text(encoding="utf-8"))["harmless"]
    sources = {str(path): (ROOT / path).read_text("utf-8") for path in files("core", "adapters")}
    there = {None, *extensions()}
    for mark in (each for each in marks if each.get("of") in there):
        holding = [path for path, text in sources.items() if mark["line"] in text]
        found = (
            each for path in holding for place in mutants(path, sources[path]) for each in place
        )
        assert any(harmless(each) == mark["reason"] for each in found), mark


def test_mutant_has_block_of_line():
    found = [each for place in mutants("case.py", SOURCE) for each in place]
    by_line = {each.line: block_of(each, SOURCE).partition("#")[2] for each in found}
    assert by_line == {
        "LIMIT: float = 2.5": "",
        "count: int = 1": "",
        "def chosen(self, values: list[int] | None, other=0):": "",
        "if values is None and not self.ready:": "0",
        'return f"{other + 1}"': "1",
        "if value:": "2",
        "continue": "3",
        "return max(values[0] - other, min(k, 3)) <= -LIMIT": "0",
    }


def test_tests_of_mutant_enter_its_block(tmp_path):
    """Tests that entered another text of the function may too; further ones never."""
    (mutant,) = (
        each for place in mutants("case.py", SOURCE) for each in place if each.line == "continue"
    )
    block = block_of(mutant, SOURCE)
    blocks = [block, block[:-1] + "0", "case.py Case.chosen 0ld#0", "case.py other 0ld#0"]
    tests = {f"tests/test_x.py::{k}": (1.0, f"{1 << k:x}") for k in range(4)}
    entered = Entered(tmp_path / "map", {}, blocks, tests, [])
    stages = [*entered.stages(mutant, SOURCE)]
    assert sorted(test for tests in stages for test in tests) == [
        "tests/test_x.py::0",
        "tests/test_x.py::2",
    ]
    entered._keep()
    assert [*Entered.read(tmp_path / "map").stages(mutant, SOURCE)] == stages


def test_mutant_table_counts_ends_by_room():
    ends = {"core/a": ["killed", "timeout", "survived", "harmless"], "adapters": ["killed"]}
    rows = table([{"room": room, "end": end} for room, each in ends.items() for end in each])
    assert [line.split() for line in rows.splitlines()[1:]] == [
        ["adapters", "1", "0", "0", "0", "100", "%"],
        ["core/a", "1", "1", "1", "1", "67", "%"],
        ["all", "2", "1", "1", "1", "75", "%"],
    ]
