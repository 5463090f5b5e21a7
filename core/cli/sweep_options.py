"""Options of kincheck sweep, and the names of its files."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..studies.variation.study_choices import Incomplete, Sampling
from . import import_options
from .execution_options import SCHEDULER
from .option_types import add_json, add_several, positive, whole
from .run_options import TOL
from .verbosity import add_verbosity

PART = "sweep.part"
"""File of the finished part of a sweep, in its folder of results until the sweep ends."""

LIMITS = "limits.csv"
"""File of the specification limits, for studies with limits."""

FILES = ("sweep.json", "sweep.html", "envelope.csv", "gradients.csv")


def add_options(sweep: argparse.ArgumentParser) -> None:
    """Add the options to the parser of the command."""
    sweep.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or to another tool's file",
    )
    sweep.add_argument(
        "--vary",
        type=Path,
        required=True,
        metavar="FILE",
        help="file that states what varies, and by how much (kincheck-vary/1)",
    )
    sweep.add_argument("--samples", type=whole(1), metavar="N", help="number of random variants")
    sweep.add_argument(
        "--seed",
        type=whole(0),
        default=0,
        metavar="S",
        help="seed of the random variants; default %(default)s",
    )
    sweep.add_argument(
        "--sampling",
        type=Sampling,
        choices=[*Sampling],
        default=Sampling.RANDOM,
        help=(
            "sampling of the variants: random, Latin hypercube or Sobol sequence;"
            " default %(default)s"
        ),
    )
    sweep.add_argument(
        "--limit",
        action="append",
        default=[],
        metavar="OUTPUT:LOW:HIGH",
        help=(
            "specification limits of an output, as toe:-2:2deg, or in the units of the --vary file;"
            " one may be empty."
            " The study counts the variants inside, with Cp and Cpk"
        ),
    )
    sweep.add_argument(
        "--incomplete",
        type=Incomplete,
        choices=[*Incomplete],
        default=Incomplete.OUTSIDE,
        help=(
            "variants that do not reach all samples: outside of the limits, or left out of the"
            " yield; default %(default)s"
        ),
    )
    add_several(sweep, "--output", "only these outputs; default: all")
    sweep.add_argument(
        "--order",
        type=int,
        choices=(0, 1, 2),
        default=0,
        help="also reduce time derivatives up to this order; default %(default)s",
    )
    sweep.add_argument(
        "--tol",
        type=positive,
        default=TOL,
        metavar="X",
        help=f"largest accepted constraint residual; default {TOL:g}",
    )
    sweep.add_argument(
        "--jobs", type=whole(1), metavar="N", help="number of threads; default: half the processors"
    )
    sweep.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help=SCHEDULER,
    )
    sweep.add_argument(
        "--check",
        metavar="ENGINE[:SHARE]",
        help=(
            "rebuild a share of the variants, at least one, as separate cases, and solve them"
            " with this engine; default share 0.01"
        ),
    )
    sweep.add_argument(
        "--replay",
        type=whole(0),
        nargs="+",
        metavar="INDEX",
        help=(
            "solve only these variants of the seed, each as a separate case, as kincheck run"
            " does; also with the engine of --check"
        ),
    )
    sweep.add_argument(
        "--store", type=Path, metavar="FILE", help="write the values of all variants as Parquet"
    )
    sweep.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"write {', '.join(FILES)} there, and {LIMITS} if there are limits",
    )
    add_json(sweep)
    sweep.add_argument(
        "--resume",
        action="store_true",
        help=(f"continue the same sweep from its finished part, {PART} in the folder of --out"),
    )
    add_verbosity(sweep, quiet="print no progress")
    import_options.add_options(sweep)
