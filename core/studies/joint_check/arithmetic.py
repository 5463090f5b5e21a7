"""Checks of the arithmetic of a joint's equations: number of operations and rounding errors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...kinematics import Style
from ...primitives.base import NoFormError
from ...trajectory import Array
from ..findings import Finding, Verdict, judged
from .checks import ROUND_OFF, ROUND_OFF_WHY, Specimen
from .manifold import design
from .scalars import execute, precise
from .traced import TracedJoint


def cost(s: Specimen) -> Iterator[Finding]:
    """Count the operations of the traced equations, and of the conventional
    form where one exists.
    """

    def flops(t: TracedJoint) -> dict[str, int]:
        return {name: t.programs[name].flops for name in ("phi", "rows", "gamma")}

    own, other = flops(s.traced), _conventional(s)
    text = ", ".join(f"{name} {count}" for name, count in own.items())
    if other is not None:
        text += "; in conventional form " + ", ".join(
            f"{name} {count}" for name, count in flops(other).items()
        )
    yield Finding("operations", Verdict.PASS, float(sum(own.values())), message=f"flops {text}")


def _conventional(s: Specimen) -> TracedJoint | None:
    try:
        return TracedJoint(s.joint, s.place, Style.CONVENTIONAL)
    except NoFormError:  # a user's primitive has no conventional form
        return None


def round_off(s: Specimen) -> Iterator[Finding]:
    """Check rounding errors against the same operations with 40 digits, at the poses and very
    near the design.
    """
    try:
        kind, lift = precise(40)
    except ModuleNotFoundError:
        yield Finding(
            "round-off", Verdict.SKIP, message="mpmath is not installed: pip install mpmath"
        )
        return

    def error(t: TracedJoint, state: Array) -> Array:
        true = execute(t.programs["phi"], kind, lift(state), lift)
        return np.abs(
            np.array(
                [
                    np.broadcast_to(lift(a) - b, state.shape[1:])
                    for a, b in zip(t.phi(state), true, strict=True)
                ]
            ).astype(float)
        )

    few = s.state[:, :8]
    tiny = 1e-8
    near = s.traced.retract(design(s.traced, 8), tiny * s.rng.normal(size=(s.traced.columns, 8)))
    lost = {"here": error(s.traced, near).max() / tiny}
    other = _conventional(s) if not s.traced.coordinates else None
    if other is not None:
        lost["in conventional form"] = error(other, near).max() / tiny
    text = f"of a displacement of {tiny:g} from the design phi loses " + ", ".join(
        f"{x:.1g} {where}" for where, x in lost.items()
    )
    yield judged(
        "round-off",
        error(s.traced, few),
        ROUND_OFF,
        ROUND_OFF_WHY,
        s.traced.names,
        text,
        "a difference of large numbers is formed: start from what changed",
    )
