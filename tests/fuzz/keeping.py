"""Inputs of fuzzers that are kept as tests: NAME.json, a minimal set that reaches all that was
reached; NAME.defects.json.
"""

import importlib.util
import json
from pathlib import Path

KEPT = Path(__file__).parent.parent / "data" / "fuzz"
SEEDS = Path(__file__).parent / "seeds"


def kept(name: str) -> list[bytes]:
    """The inputs in the file of that name; none without it."""
    return _inputs(KEPT / f"{name}.json")


def seeds_in_file(name: str) -> list[bytes]:
    """The seeds in the file of that name; workbooks where they can be read."""
    readable = importlib.util.find_spec("openpyxl") is not None
    inputs = _inputs(SEEDS / f"{name}.json")
    return [each for each in inputs if readable or not each.startswith(b"PK")]


def _inputs(file: Path) -> list[bytes]:
    return (
        [text.encode("latin-1") for text in json.loads(file.read_text())] if file.exists() else []
    )


def keep(name: str, inputs: list[bytes]) -> None:
    """Write the inputs to keep, the shortest first, a line each."""
    lines = ",\n".join(
        json.dumps(each.decode("latin-1"))
        for each in sorted(set(inputs), key=lambda each: (len(each), each))
    )
    (KEPT / f"{name}.json").write_text(f"[\n{lines}\n]\n")
