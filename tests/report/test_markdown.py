"""Markdown in which foreign text is text."""

import pytest
from kincheck.core.report.table import code, escape_markdown, row

from ..support.examples import examples

(ESCAPED,) = examples(__file__, "escaped")


@pytest.mark.parametrize(
    ("text", "expected"),
    ESCAPED,
)
def test_markdown_escapes_foreign_text(text, expected):
    assert escape_markdown(text) == expected


def test_markdown_row_with_code():
    assert row([code("a`b|c"), "d"]) == r"| `a'b\|c` | d |"
