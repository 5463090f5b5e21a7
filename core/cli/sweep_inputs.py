"""Outputs and limits of kincheck sweep from its options."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from ..errors import unknown
from ..report.progress import complain

if TYPE_CHECKING:
    from ..case.case import Case
    from ..studies.variation.variation import Variation


def only(case: Case, names: list[str], problems: list[str]) -> Case:
    """Return the case with the named outputs only, or with all if none is named."""
    there = [output.name for output in case.outputs]
    problems += [unknown("output", name, there) for name in names if name not in there]
    wanted = tuple(output for output in case.outputs if output.name in names or not names)
    return replace(case, outputs=wanted)


def limited(
    options: argparse.Namespace, variation: Variation, whole: Case, case: Case
) -> Variation:
    """Return the variation with limits for the outputs of the case; limits of the options replace
    those of the file.
    """
    from ..studies.variation.variation_file import limits_of_texts

    given = limits_of_texts(options.limit, whole, variation.units)
    limits = {each.output: each for each in (*variation.limits, *given)}
    there = {output.name for output in case.outputs}
    kept = {
        name: each
        for name, each in limits.items()
        if name in there or name.rpartition(".")[0] in there
    }
    if left_out := [name for name in limits if name not in kept]:
        complain(
            [f"limits of {', '.join(left_out)}: left out, as --output leaves out these outputs"]
        )
    return replace(variation, limits=tuple(kept.values()))
