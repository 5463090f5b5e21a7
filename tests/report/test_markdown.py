"""Markdown in which foreign text is text."""

import pytest
from kincheck.core.report.table import code, escape_markdown, row


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("half_track of lower_case", "half_track of lower_case"),
        ("position [m]", "position [m]"),
        ("2 · 1e-3 ± 4", "2 · 1e-3 ± 4"),
        ("_a_ *b* ~c~ `d`", r"\_a\_ \*b\* \~c\~ \`d\`"),
        ("[here](https://example.org)", r"[here]\(https://example.org)"),
        ("a|b", r"a\|b"),
        ("\\|", r"\\\|"),
        ("<b>&lt;</b>", "&lt;b&gt;&amp;lt;&lt;/b&gt;"),
        ("to @all, not a@b", "to @\u2060all, not a@b"),
        (" two\n\nlines\t", "two lines"),
        ("\x1b[31m", r"\\x1b[31m"),
    ],
)
def test_markdown_escapes_foreign_text(text, expected):
    assert escape_markdown(text) == expected


def test_markdown_row_with_code():
    assert row([code("a`b|c"), "d"]) == r"| `a'b\|c` | d |"
