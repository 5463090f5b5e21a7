"""Blocks of a page, and the comparison of shown with printed output."""

import importlib
import re
from pathlib import Path

import pytest
from kincheck.core.cli import every_command

from ..support.examples import examples
from ..support.sources import ROOT
from .builder import module
from .page import blocks, commands, differences

ALIKE, PAGE = examples(__file__, "alike", "page")


def test_page_blocks_with_status_and_output():
    file, console, python, left_out = blocks(PAGE)
    assert (file.title, file.text, file.line) == ("a.toml", "x = 1\n", 2)
    assert (console.status, console.excuse) == (1, None)
    assert [*commands(console.text)] == [("kincheck run a.toml", "1 fail"), ("ls", "a.toml")]
    assert (python.text, python.shown) == ("print(2)\n", "2\n")
    assert left_out.excuse == "takes hours"


PRINTED = "case  error\n\nrssr  1.5e-16  pass\nnote: long, and longer\n1 pass\n"


@pytest.mark.parametrize(
    ("shown", "lacks"),
    ALIKE,
)
def test_shown_output_may_differ_in_numbers(shown, lacks):
    assert differences(shown, PRINTED) == lacks


def test_reference_pages_list_commands_and_types():
    pages = module("generated").PAGES()
    commands_page = pages["reference/command-line.md"]
    assert [name for name in every_command() if f"\n## {name}\n" not in commands_page] == []
    assert "`--missing-is-failure`" in commands_page
    assert "| `revolute` |" in pages["reference/types.md"]
    assert "[closure]" in pages["reference/case-file.md"]


def test_site_finds_described_names():
    """It reads sources, so what an extension offers by kincheck.core is described where it is
    defined.
    """
    page = ROOT / "docs" / "pages" / "reference" / "python.md"
    text = module("collected").in_site(page.read_text(), Path("docs/pages"), "reference/python.md")
    found = re.findall(r"^::: (kincheck\.core(?:\.\w+)*)\.(\w+)$", text, re.MULTILINE)
    assert len(found) > 30
    for package, name in found:
        where = importlib.import_module(package)
        assert name in getattr(where, "__all__", vars(where)), f"{package}.{name}"
