"""What simulators lose of models that they load and save:

    python -m tests.extensions.same.converters FILE ...

Prints a row of a table for each file: the verdict of `kincheck same FILE --converted-by mujoco`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from kincheck.core.doors import offers
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.same.verdict import compare

CONVERTERS = ("mujoco",)


def rows(files: Sequence[Path]) -> Iterator[str]:
    """Yield the rows of the table."""
    yield "| Model | Converter | Verdict |"
    yield "|---|---|---|"
    for file in files:
        for name in CONVERTERS:
            try:
                verdict = converted(file, name)
            except KincheckError as error:
                verdict = f"not judged: {error}".replace(f"{file.parent}/", "")
            yield f"| `{file.name}` | {name} | {' '.join(verdict.split())} |"


def converted(file: Path, name: str) -> str:
    """Return the verdict on a file and what a simulator saves of it."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / "converted.xml"
        out.write_text(offers("converters")[name].load()(file), encoding="utf-8")
        return compare(undriven_file(file), undriven_file(out), {}).text


if __name__ == "__main__":
    for row in rows([*map(Path, sys.argv[1:])]):
        print(row, flush=True)
