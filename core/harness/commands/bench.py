"""kincheck bench: measure the formulation, its programs and the engines."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ...errors import KincheckError
from .house import House, Status


def add(commands: Any) -> None:
    """Add the command to the parser."""
    bench: argparse.ArgumentParser = commands.add_parser("bench", help="measure the formulation and its programs")
    benchmarks = bench.add_subparsers(title="benchmarks", required=True, metavar="BENCHMARK")
    formulation = benchmarks.add_parser(
        "formulation", help="operation counts and round-off of the paper's rows", description=_formulation.__doc__
    )
    formulation.set_defaults(do=_formulation)
    formulation.add_argument("--seed", type=int, default=943745, metavar="N", help="of the random states; default %(default)s")
    formulation.add_argument("--out", type=Path, metavar="DIR", help="write bench_formulation.json and .html there")
    formulation.add_argument("--json", metavar="FILE", help="write the results as JSON; - for standard output")


def _formulation(options: argparse.Namespace, house: House) -> int:
    """Measure the paper's claims: operation counts (Table 3), round-off of rows, errors of a whole sweep. Needs mpmath."""
    from ..bench import formulation as bench_formulation
    from ..bench import pages as bench
    from ..reporting import deliver as delivery

    problems: list[str] = []
    names = [f"{bench_formulation.NAME}.{kind}" for kind in ("json", "html")]
    delivery.check_destinations(problems, out=options.out, json=options.json, names=names)
    if problems:
        raise KincheckError("\n".join(problems))
    found = bench_formulation.measure(house.case("mcpherson_strut"), options.seed, bench_formulation.STATES)
    bench.deliver(bench_formulation.report(found), found, out=options.out, json=options.json)
    return Status.WITHIN
