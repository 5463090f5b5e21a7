"""Reference tables beside a case file: CSV, and proved references in JSON."""

import json
import tomllib
from functools import cache
from pathlib import Path

import kincheck.cases
from kincheck.core.case.io.case_file import load_case

from ..support.case_texts import BASE, CSV
from .fuzzing import changing, read_or_refused, written
from .hardpoints import workbook
from .trees import changed_json, changed_lines

LONGEST = 8000
PROVED = {
    "schema": "kincheck-reference/1",
    "case": "slider",
    "kincheck": "0.1.0",
    "numbers": "double",
    "note": "made up",
    "digits": 17,
    "bits": 100,
    "rows": ["guide: dot11"],
    "redundant": [],
    "driver": {"push": [-0.1, 0.0, 0.1]},
    "outputs": {
        "tip_x": {
            "position": ["1.4", "1.5", None],
            "velocity": ["2.0", "2.0", "2.0"],
            "acceleration": [None, None, None],
            "radius": [1e-17, 1e-17, None],
            "unit": "m",
            "signs": "",
        }
    },
    "samples": [
        {"proved": True},
        {"proved": True, "alone": 0.1},
        {"proved": False, "reason": "singular"},
    ],
    "seconds": 0.1,
}
SUSPENSION = "mcpherson_suspension"
WORDS = (
    *[
        "push",
        "tip_x",
        "tip_x.velocity",
        "tip_x.acceleration",
        "stroke",
        "toe",
        "camber",
        "#",
        "signs:",
        "iso8855",
        "sae_j670",
        "time",
    ],
    *PROVED,
)


def one(data: bytes) -> None:
    """Read one input as the table of a case with one output, or of a suspension where it is about
    one.
    """
    name = "table.json" if data.lstrip().startswith(b"{") else "table.csv"
    name = "table.xlsx" if data.startswith(b"PK") else name
    written(name, data)
    read_or_refused(lambda: load_case(case(name, b"camber" in data)))


@cache
def case(table: str, suspension: bool) -> Path:
    """A case file that names the table; JSON, which takes less time to read than TOML."""
    text = (kincheck.cases.FOLDER / f"{SUSPENSION}.toml").read_text() if suspension else BASE
    tables = tomllib.loads(text.replace("steps = 33", "steps = 5")) | {"reference": {"file": table}}
    return written(f"case_of_{table}_{suspension}.json", json.dumps(tables).encode())


def seeds() -> list[bytes]:
    """A table, a proved reference, and five rows of a suspension's."""
    lines = (kincheck.cases.FOLDER / f"{SUSPENSION}.csv").read_text().splitlines()
    comments, (head, *rows) = (
        [x for x in lines if x.startswith("#")],
        [x for x in lines if not x.startswith("#")],
    )
    few = "\n".join(
        [*(each for each in comments if "signs" in each), head, *rows[:: (len(rows) - 1) // 4]]
    )
    head, *rows = CSV.removeprefix("# made up\n\n").replace(",", ";").splitlines()
    german = "\n".join(["sep=;", "Rig 3", head, *(row.replace(".", ",") for row in rows)])
    sheet = workbook([line.split(",") for line in CSV.splitlines()])
    return [
        *(text.encode() for text in (CSV, json.dumps(PROVED), few)),
        german.encode("utf-16"),
        *sheet,
    ]


mutate = changing(changed_json, changed_lines, words=WORDS)
