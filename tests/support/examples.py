"""Examples of a test file, in a TOML file of its name beside it."""

import tomllib
from pathlib import Path


def examples(file, *names):
    """Return the tables of these names, rows by what tells them apart."""
    tables = tomllib.loads(Path(file).with_suffix(".toml").read_text("utf-8"))
    return [tables[name] for name in names]
