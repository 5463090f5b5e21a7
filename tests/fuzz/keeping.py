"""The fuzzers, a module for each reader, here or beside the tests of its extension; and beside
each the inputs that are kept as tests: NAME.json, a minimal set that reaches all that was reached;
NAME.defects.json; NAME.seeds.json.
"""

import importlib
import importlib.util
import json
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1]
SHARED = {"__main__", "fuzzing", "keeping", "trees"}
READERS = {
    path.stem: path
    for pattern in ("fuzz/*.py", "extensions/*/fuzz/*.py")
    for path in sorted(TESTS.glob(pattern))
    if path.stem not in SHARED
}


def fuzzer(name: str) -> Any:
    """Return the module of a reader's fuzzer."""
    return importlib.import_module(".".join(_path(name).relative_to(TESTS.parent).parts))


def kept(name: str) -> list[bytes]:
    """The inputs in the file of that name; none without it."""
    return _inputs(_path(f"{name}.json"))


def seeds_in_file(name: str) -> list[bytes]:
    """The seeds in the file of that name; workbooks where they can be read."""
    readable = importlib.util.find_spec("openpyxl") is not None
    inputs = kept(f"{name}.seeds")
    return [each for each in inputs if readable or not each.startswith(b"PK")]


def _path(file: str) -> Path:
    """The path of a file beside its reader's fuzzer."""
    return READERS[file.partition(".")[0]].with_name(file)


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
    _path(f"{name}.json").write_text(f"[\n{lines}\n]\n")


if __name__ == "__main__":
    print(*sorted(READERS))
