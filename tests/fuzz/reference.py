"""Reference tables beside a case file: CSV, and proved references in JSON."""

import json

import kincheck.cases
from kincheck.core.harness.reading.casefile import load_case

from ..case_texts import BASE, CSV
from .fuzzing import changing, read_or_refused, written
from .trees import changed_json, changed_lines

LONGEST = 3000
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
    "samples": [{"proved": True}, {"proved": True, "alone": 0.1}, {"proved": False, "reason": "singular"}],
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
    """Read one input as the table of a case with one output, or of a suspension where it is about one."""
    is_json = data.lstrip().startswith(b"{")
    table = "table.json" if is_json else "table.csv"
    text = (kincheck.cases.FOLDER / f"{SUSPENSION}.toml").read_text() if b"camber" in data else BASE
    head, _, _ = text.partition("[reference]")
    file = written("case.toml", f'{head}\n[reference]\nfile = "{table}"\n'.replace("steps = 33", "steps = 5").encode())
    written(table, data)
    read_or_refused(lambda: load_case(file))


def seeds() -> list[bytes]:
    """A table, a proved reference, and five rows of a suspension's."""
    lines = (kincheck.cases.FOLDER / f"{SUSPENSION}.csv").read_text().splitlines()
    comments, (head, *rows) = [x for x in lines if x.startswith("#")], [x for x in lines if not x.startswith("#")]
    few = "\n".join([*(each for each in comments if "signs" in each), head, *rows[:: (len(rows) - 1) // 4]])
    return [CSV.encode(), json.dumps(PROVED).encode(), few.encode()]


mutate = changing(changed_json, changed_lines, words=WORDS)
