"""Reference tables beside a case file: CSV, and proved references in JSON; and measured curves
given with a case.
"""

import json
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import kincheck.cases
from kincheck.core.case.case import Case
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.reader_options import CurveOptions
from kincheck.core.cli.shared_options import with_references
from kincheck.core.doors import offers

from ..support.case_texts import BASE
from .fuzzing import changing, read_or_refused, written
from .keeping import seeds_in_file
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
CURVE = b"# curve"
OPTIONS = CurveOptions(["Spur=-camber [deg]"])
SUSPENSION = "mcpherson_suspension"
KNOWN = SUSPENSION in kincheck.cases.names()
KEYS = """push tip_x tip_x.velocity tip_x.acceleration stroke toe camber # signs: iso8855
sae_j670 time [mm] (deg) _deg [deg/mm] travel KPI mm deg [-]"""
WORDS = (*KEYS.split(), "Toe Angle", *PROVED)


def one(data: bytes) -> None:
    """Read one input as the table of a case with one output, or of a suspension where it is about
    one.
    """
    if data.startswith(CURVE) and offers("references"):
        file = written("curve.csv", data)
        read_or_refused(lambda: with_references([car()], [file], OPTIONS, None)[0][0])
        return
    name = "table.json" if data.lstrip().startswith(b"{") else "table.csv"
    name = "table.xlsx" if data.startswith(b"PK") else name
    written(name, data)
    read_or_refused(lambda: load_case(case(name, b"camber" in data)))


@cache
def car() -> Case:
    """The case that a curve is of."""
    return replace(load_case(case("", True)), reference={}, origin=None)


@cache
def case(table: str, suspension: bool) -> Path:
    """A case file that names the table; JSON, which takes less time to read than TOML."""
    text = kincheck.cases.file(SUSPENSION).read_text() if suspension and KNOWN else BASE
    tables = tomllib.loads(text.replace("steps = 33", "steps = 5"))
    tables = {key: value for key, value in tables.items() if key not in ("reference", "truth")}
    if table:
        tables |= {"truth": "closed_form", "reference": {"file": table}}
    return written(f"case_of_{table}_{suspension}.json", json.dumps(tables).encode())


def seeds() -> list[bytes]:
    """A table, a proved reference, five rows of a suspension's, and curves of a rig."""
    every, whole = seeds_in_file("reference"), KNOWN and offers("references")
    return [each for each in every if whole or not (each.startswith(CURVE) or b"camber" in each)]


mutate = changing(changed_json, changed_lines, words=WORDS)
