"""Printed numbers against the numbers they stand for, colours of a terminal, and JUnit files."""

import io
import math
import re
import xml.etree.ElementTree as ET


def assert_printed(text, value):
    """A text is a word, a count, a dash for what is unknown, or a number of three digits, from
    1,000 up to 100,000 of as many as there are before the point.
    """
    text = " ".join(text.replace("\N{MINUS SIGN}", "-").split())
    if value is None:
        assert text == "–"
    elif isinstance(value, int | str):
        assert text == str(value)
    elif value == 0.0:
        assert text == "0"
    else:
        place = math.floor(math.log10(abs(value)))
        unit = 1.0 if 3 <= place < 5 else 10.0 ** (place - 2)
        assert abs(float(text) - value) <= 0.5001 * unit, f"{text} for {value}"


def assert_row(cells, values):
    """The cells of a row in their order."""
    assert len(cells) == len(values), cells
    for text, value in zip(cells, values, strict=True):
        assert_printed(text, value)


def blocks(text, indent=""):
    """Return the rows of tables on a narrow terminal: their first cells, and the other cells, each
    after its head.
    """
    found = re.findall(rf"^{indent}(\S.*)\n((?:{indent}  .*\n)+)", text, re.MULTILINE)
    return [(title.strip(), " ".join(cells.split())) for title, cells in found]


def cells_of(block, heads):
    """Return the cells of a row by the heads in their order."""
    found = re.fullmatch(" ".join(f"{re.escape(head)} (.+)" for head in heads), block)
    assert found, f"{block}: expected {', '.join(heads)}"
    return [*found.groups()]


class Terminal(io.StringIO):
    """A terminal, by its own word."""

    def isatty(self):
        return True


def coloured(text):
    """Return what a terminal shows in red and in green, in its order."""
    return {
        colour: [each.strip() for each in re.findall(rf"\x1b\[{code}m(.*?)\x1b\[0m", text)]
        for colour, code in (("red", "1;31"), ("green", "32"))
    }


def junit_tests(text):
    """Return the verdicts of the test cases of a JUnit file with messages, by class and name."""
    return {
        f"{test.get('classname')} {test.get('name')}": [
            (child.tag, child.get("message", "")) for child in test if child.tag != "system-out"
        ]
        for test in ET.fromstring(text).iter("testcase")
    }


def junit_messages(text, kind):
    """Return the messages of a kind in a JUnit file."""
    return [each.get("message", "") for each in ET.fromstring(text).iter(kind)]
