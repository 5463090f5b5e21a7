"""kincheck kc: kinematics and compliance of a suspension on its bushings."""

from __future__ import annotations

import argparse
import math
import re
import sys
from pathlib import Path
from typing import Any

from ..errors import KincheckError
from . import import_options
from .registry import Registry, Status

_UNITS = {
    "": 1.0, "m": 1.0, "mm": 1e-3, "cm": 1e-2, "rad": 1.0, "deg": math.pi / 180.0,
    "N": 1.0, "kN": 1e3, "Nm": 1.0, "kNm": 1e3,
}  # fmt: skip
MOST = 100_000


def add(commands: Any) -> None:
    """Add the command to the parser."""
    command: argparse.ArgumentParser
    command = commands.add_parser(
        "kc",
        help="kinematics and compliance: equilibria on bushings over travel and loads",
        description=_kc.__doc__,
    )
    command.set_defaults(do=_kc)
    command.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or a hardpoint table",
    )
    command.add_argument(
        "--load",
        action="append",
        default=[],
        metavar="NAME=A:B:N",
        help=(
            "curve over a load at design, as lateral=-3000:3000:31 [N, N m]: longitudinal, lateral,"
            " braking or aligning; one number is a load that acts over all travel; may be repeated"
        ),
    )
    command.add_argument(
        "--bushings",
        type=Path,
        metavar="FILE",
        help=(
            "bushings of the joints, for a table of hardpoints: TOML, tables"
            " [joints.NAME.bushings.X] as in case files, in SI"
        ),
    )
    command.add_argument("--csv", metavar="FILE", help="write the curves, in mm, deg, N, kN")
    command.add_argument(
        "--json", metavar="FILE", help="write the results in SI; - for standard output"
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="write the page DIR/kc.html")
    import_options.add_options(command)


def _kc(options: argparse.Namespace, registry: Registry) -> int:
    """Find the equilibria of a suspension with springs, bushings and loads, and their compliance.

    Joints with bushings give way to them. --travel=A:B:N is of the wheel, from design, in m or with
    a unit: --travel=-60mm:60mm:25. --axle heave, roll or steer moves both wheels of an axle.

    Exit status: 0 all samples have an equilibrium; 2 one has none, and its message gives the last
    load that has one, or the tool could not do its work.
    """
    from ..case.io.atomic_files import require_writable, write
    from ..report.progress import complain
    from ..report.terminal import with_json
    from ..studies.compliance import study, views

    travel = None if options.travel is None else _values("--travel", options.travel)
    table = Path(options.case).suffix.lower() not in ("", ".toml", ".json")
    axle, given = options.axle, options.travel
    if not table:
        options.axle = options.travel = None
    elif given is not None and travel is not None:
        options.travel = f"{travel[0]}:{travel[-1]}:{len(travel)}"
    case = registry.find_case(options.case, import_options.supplied(options), driven=False)
    import_options.tell_left_out([case])
    if options.bushings is not None:
        from ..case.io.mechanism_sections import with_bushings

        case = with_bushings(case, options.bushings)
    page = None if options.out is None else options.out / "kc.html"
    if page is not None:
        page.parent.mkdir(parents=True, exist_ok=True)
    require_writable([("--json", options.json), ("--csv", options.csv), ("--out", page)])
    loads = dict(map(_load, options.load))
    results = study.compliance(case, travel, loads, axle or study.AxleMotion.HEAVE)
    if options.csv is not None:
        write("--csv", Path(options.csv), views.table(results).encode())
    if page is not None:
        write("--out", page, views.page(results).encode())
    out = sys.stderr if options.json == "-" else sys.stdout
    with with_json(views.as_data(results), options.json):
        print(*views.lines(results), sep="\n", file=out)
        complain(f"note: {note}" for note in results.travel.notes)
    if results.failures:
        raise KincheckError("\n".join(results.failures))
    return Status.WITHIN


def _load(text: str) -> tuple[str, Any]:
    name, _, values = text.partition("=")
    if not values:
        raise KincheckError(f"--load {text}: expected NAME=A:B:N, as lateral=-3000:3000:31")
    found = _values(f"--load {name}", values)
    return name, found if ":" in values else found[0]


def _values(option: str, text: str) -> list[float]:
    """Return the samples A:B:N, or one number, in SI."""
    parts = text.split(":")
    numbers = [_number(each) for each in parts[:2]]
    known = [x for x in numbers if x is not None]
    count = parts[2] if len(parts) == 3 else "1" if len(parts) == 1 else ""
    if len(known) < len(numbers) or not count.isdecimal() or not 1 <= int(count) <= MOST:
        raise KincheckError(
            f"{option} {text}: expected START:STOP:SAMPLES, numbers with a unit such as mm, deg or"
            f" kN or none for SI, and 1 to {MOST} samples; write -60mm:60mm:25"
        )
    start, stop, steps = known[0], known[-1], max(1, int(count) - 1)
    return [start + (stop - start) * (k / steps) for k in range(int(count))]


def _number(text: str) -> float | None:
    found = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z]*)\s*", text)
    if found is None or found[2] not in _UNITS:
        return None
    return float(found[1]) * _UNITS[found[2]]
