"""Hardpoint files: Project Chrono (JSON with comments), Adams/Car blocks, plain tables, onto a
template.
"""

from pathlib import Path

from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.hardpoints.templates import TEMPLATES

from .fuzzing import changing, read_or_refused, written
from .trees import changed_json, changed_lines

LONGEST = 3000
DATA = Path(__file__).parent.parent / "data" / "hardpoints"
ROLES = [
    name
    for template in TEMPLATES.values()
    for role in template.roles
    for name in (role.name, *role.also)
]
KEYS = """name x y z mm cm inch [HARDPOINT] [UNITS] {hardpoint_name symmetry x_value y_value z_value} left/right single right LENGTH
= Type Template Suspension Spindle COM Location // /* */ $ # units: axes: rearward,right,up
sep=; (VARIANTS) 1,5 -1.234,5 1,234 "2,5" point;"""  # noqa: E501
WORDS = (
    *KEYS.split(),
    *ROLES,
    *TEMPLATES,
    *(name for each in TEMPLATES.values() for name in each.also),
)


def one(data: bytes) -> None:
    """Read one input as the kind of file that it begins like."""
    start = data.lstrip()[:1]
    if start in (b"{", b"/"):
        read_or_refused(
            lambda: load(
                written("car.json", data),
                Supplied(template=None if b"Template" in data else "mcpherson"),
            )
        )
        return
    template = (
        "mcpherson"
        if b"strut" in data
        else "five_link"
        if b"trailing" in data
        else "double_wishbone"
    )
    if b"[" in data.split(b"\n", 1)[0] or b"[HARDPOINT]" in data:
        read_or_refused(lambda: load(written("car.sub", data), Supplied(template)))
        return
    said = Supplied(
        template, None if b"unit" in data else "mm", None if b"axes" in data else "adams"
    )
    read_or_refused(lambda: load(written("car.csv", data), said))


def seeds() -> list[bytes]:
    """The files of the tests, and their points as tables."""
    adams = (DATA / "adams_front_suspension.sub").read_text()
    rows = [
        line.replace("'", "").split()
        for line in adams.split("z_value}")[1].split("[")[0].splitlines()
        if line.strip().startswith("'")
    ]
    table = "name,x,y,z\n" + "\n".join(",".join([row[0], *row[-3:]]) for row in rows)
    other = "# units: mm\n# axes: rearward,right,up\n" + table.replace(",", "\t")
    german = "Car\nsep=;\nname;x [mm];y [mm];z [mm];mass;\n" + "\n".join(
        ";".join([row[0], *row[-3:], "1;"]).replace(".", ",") for row in rows
    )
    variants = adams.replace(
        "[PARAMETER]", "(VARIANTS)\n 'lca_outer' 'left/right' 1 2 3\n[PARAMETER]"
    )
    return [
        *(file.read_bytes() for file in sorted(DATA.glob("*.json"))),
        *(text.encode() for text in (adams, table, other, variants)),
        german.removeprefix("Car\n").encode("utf-16"),
        german.replace("sep=;\n", "").encode(),
    ]


mutate = changing(changed_json, changed_lines, words=WORDS)
