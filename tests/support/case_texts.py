"""A small case file, ways to change it, and what a wrong one has to give: exactly one CaseError."""

import re
from functools import partial

import pytest
from kincheck import CaseError, Supplied
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.models.files import load
from kincheck.core.cli.lists import schema_of
from kincheck.core.errors import OpenError

from ..support.examples import examples

(BASE,) = examples(__file__, "base")


INLINE = """
[reference]
columns = ["push", "tip_x", "tip_x.velocity"]
rows = [[-0.1, 1.4, 2.0], [0.0, 1.5, 2.0], [0.1, 1.6, 2.0]]
"""


def write(folder, text, name="case.toml"):
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def edited(*edits, base=BASE):
    for old, new in edits:
        assert base.count(old) == 1, f"{old!r} occurs {base.count(old)} times"
        base = base.replace(old, new)
    return base


CSV = "# made up\n\npush, tip_x, tip_x.velocity\n-0.1, 1.4, 2.0\n 0.0, 1.5, 2.0\n0.1, 1.6, 2.0\n"
BY_FILE = '\n[reference]\nfile = "tip.csv"\n'


def refused(act, message):
    """The one message, on one line, of a CaseError; it has the parts of the given one, between
    which " ... " stands for others.
    """
    with pytest.raises(CaseError) as caught:
        act()
    found = str(caught.value)
    assert caught.type in (CaseError, OpenError)
    assert "\n" not in found
    assert [part for part in message.split(" ... ") if part not in found] == [], found
    return found


def complains(file, message, supplied=None):
    """As `refused`, of a case file, or of any file with options; it begins with the folder."""
    read = load_case if supplied is None else partial(load, supplied=supplied)
    assert refused(lambda: read(file), message).startswith(str(file.parent))


def rows(text, named=True):
    """Parameters of a test from a table in a text, cells between bars; the first names the row.
    A line that begins with a bar goes on with the row above.
    """
    table = []
    for line in re.sub(r"\n *\|", "|", text.strip()).splitlines():
        cells = [cell.strip().replace(r"\n", "\n") for cell in line.split("|")]
        table.append(pytest.param(*cells[named:], id=cells[0]))
    return table


def at_hand(table, names):
    """The rows of a table whose first word is one of some names, such as of commands: extensions
    bring them.
    """
    return [row for row in table if re.match(r"[-\w]+", row.values[0])[0] in names]


def supplied(text):
    """Options of a reader from words NAME=VALUE, of which the last counts; without a value none."""
    pairs = (word.split("=", 1) for word in text.split())
    return Supplied(**{name: value or None for name, value in pairs})


def line_with(text, number):
    """The line of a text with a number."""
    (line,) = (k for k, line in enumerate(text.splitlines(), 1) if str(number) in line)
    return line


def validator(name):
    """The validator of a schema; skips without jsonschema."""
    jsonschema = pytest.importorskip("jsonschema")
    schema = schema_of(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)
