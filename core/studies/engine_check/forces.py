"""Check of an engine's forces beside their values: whether it gives all that are determined, no
others, and the balance of power.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...case.case import Case
from ...errors import shortened
from ...harness.execution import Answer, Attempt
from ...harness.verdict import NAMED


def faults_of_forces(case: Case, mode: str, attempt: Attempt, native: Attempt) -> Iterator[str]:
    """Yield what is wrong with the forces of an answer beside their values.

    An engine may leave out the reactions of joints for which it solves others. A simulation need
    not give forces.

    Args:
        native: the native engine's attempt at the same case.
    """
    found, right = attempt.result, native.result
    if not (case.forces and isinstance(found, Answer) and isinstance(right, Answer)):
        return
    replaced = {joint.name for joint in case.mechanism.joints if "equivalents" in found.details}
    outputs = [output for output in case.outputs if output.forces]
    lacking = [
        output.name
        for output in outputs
        if not found.outputs[output.name].possible and not replaced.issuperset(output.forces)
    ]
    if lacking and not (mode == "simulate" and found.power is None):
        yield (
            f"gives no {shortened(lacking, NAMED)}: return them in Trajectory.forces, or let"
            " unsupported() refuse cases with such outputs"
        )
    loose = [
        output.name
        for output in outputs
        if right.outputs[output.name].reason
        and np.isfinite(found.outputs[output.name].position).any()
    ]
    if loose:
        yield (
            f"gives values of {shortened(loose, NAMED)}, which rigid bodies leave undetermined:"
            " Reaction.free is to hold the undetermined directions"
        )
    if found.power is not None and right.power is not None:
        missing = np.isfinite(right.power) & np.isnan(found.power)
        if missing.any():
            yield (
                f"gives no balance of power at {missing.sum()} of {len(missing)} samples:"
                " Forces.power is the drivers' power less the change of energy and the dissipation"
            )
