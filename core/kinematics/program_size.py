"""The size of the compiled programs of a mechanism: unknowns, rows and operations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .compiled.acceptance import ALONE, JOINED
from .compiled.compiled_model import Model


@dataclass(frozen=True)
class ProgramSize:
    """The size of the programs of one mechanism.

    Attributes:
        unknowns: number of unknowns.
        rows: number of solved rows.
        redundant: rows only checked, as "joint: primitive".
        flops: floating-point operations of each program.
    """

    unknowns: int
    rows: int
    redundant: Sequence[str]
    flops: Mapping[str, int]

    @staticmethod
    def of(model: Model) -> ProgramSize:
        """Return the size of the programs of a model."""
        account = model.selection.account
        return ProgramSize(
            account.moving_coordinates,
            len(model.selection.chosen),
            account.redundant_rows,
            {name: each["flops"] for name, each in model.sizes.items()},
        )

    def of_sample(self, iterations: float, *, motions: bool = False) -> float:
        """Return the floating-point operations of a sample: predictor, Newton's iterations, rates,
        outputs and the test of a solution.

        Operations of rejected lanes, and further iterations for a neighbour's sake, do not count.

        Args:
            iterations: Newton's iterations of the sample.
            motions: lanes are motions of their own, of varied geometry, and not samples of one
                motion; the first few samples of a motion use other programs.
        """
        tests = ("extend", *ALONE) if motions else ("extrapolate", *JOINED)
        once = sum(self.flops[name] for name in ("outputs", *tests))
        return iterations * self.flops["newton"] + once
