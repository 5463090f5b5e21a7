"""The part of the lock of kincheck's own dependencies that some extras need.

    python -m kincheck.core.extensions.nightly.lock EXTRA,EXTRA      # prints it

It uses no other package, since it runs before they are installed.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

LOCK = Path(__file__).with_name("kincheck.lock")
"""All dependencies, those of the engines and of some other extras too, by versions and hashes."""


def locked(extras: Iterable[str], lock: Path = LOCK) -> tuple[str, list[str]]:
    """Return the entries of a lock that kincheck with some extras needs, and the names of packages
    that it lacks.
    """
    wanted = _packages(extras)
    entries = re.split(r"^(?=\w)", lock.read_text("utf-8"), flags=re.M)
    by_name = [(each.partition("==")[0], each) for each in entries if "==" in each]
    lacking = sorted(wanted - {name for name, _ in by_name})
    count = 0
    while count < len(wanted):
        count = len(wanted)
        wanted |= {name for name, entry in by_name if not wanted.isdisjoint(_parents(entry))}
    kept = "".join(entry for name, entry in by_name if name in wanted)
    return re.sub(r"^ +#.*\n", "", kept, flags=re.M), lacking


def _parents(entry: str) -> list[str]:
    """Return the packages that need an entry, which its comments name."""
    return re.findall(r"^ +# +(?:via )?([\w.-]+)$", entry, flags=re.M)


def _packages(extras: Iterable[str]) -> set[str]:
    """Return the names of kincheck's own requirements with some extras."""
    every = [each.partition(";") for each in metadata.requires("kincheck") or ()]
    found, waiting, known = set[str](), ["", *extras], set[str]()
    while waiting:
        extra = waiting.pop()
        known.add(extra)
        for requirement, _, condition in every:
            if re.findall(r"""extra == ['"]([\w-]+)""", condition) != [extra] * bool(extra):
                continue
            name, _, more = re.split(r"[^\w.\[,\]-]", requirement)[0].partition("[")
            if name == "kincheck":
                waiting += {*more.rstrip("]").split(",")} - known
            else:
                found.add(name.lower())
    return found


if __name__ == "__main__":
    text, missing = locked(each for each in "".join(sys.argv[1:]).split(",") if each)
    print(text, end="")
    if missing:
        print(f"not locked: {', '.join(missing)}", file=sys.stderr)
