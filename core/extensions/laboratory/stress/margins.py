"""A stress run with each margin of acceptance off in turn: the verdicts that it decides alone.

    python -m kincheck.core.extensions.laboratory.stress.margins [SAMPLES [SEED [FAMILY ...]]]

References are solved once. Each margin is left out in a process and a disk cache of its own:
programs that accept too much must not be kept.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from ....harness.execution import Pair
from ....harness.native_engine import NativeEngine
from ....kinematics.formulation.acceptance_criteria import Block, Candidate, Limits, margins
from .families import FAMILIES
from .run import Draw, specimens
from .verdicts import judge_answer, once, suitable_engine

_ANY: Any = dict.fromkeys(Candidate.__dataclass_fields__, 1.0)
NAMES = (
    *margins(
        Candidate(**_ANY | {"turns": (0.0,), "blocks": [Block(1.0, 1.0, 1.0)]}),
        Limits(1.0, 1.0, 0.0),
    ),
)
"""Names of all margins."""


def verdicts_without(draws: Sequence[Draw], left_out: str = "") -> list[str]:
    """Return the verdicts on all samples by the native engine, without one margin."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_judge, args=(draws, left_out, theirs))
    process.start()
    theirs.close()
    found: list[str] = ours.recv()
    process.join()
    return found


def _judge(draws: Sequence[Draw], left_out: str, to: Any) -> None:
    every = margins

    def fewer(pose: Candidate, limits: Limits) -> Mapping[str, Any]:
        return {name: x for name, x in every(pose, limits).items() if name != left_out}

    for module in [*sys.modules.values()]:
        if vars(module).get("margins") is every:
            vars(module)["margins"] = fewer
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        found = list[str]()
        for draw in draws:
            if (case := draw.case) is not None:
                engine = suitable_engine(NativeEngine(), case, draw.number)
                answer = once(Pair(case, engine, draw.specimen.tol))
                judged = judge_answer(draw.specimen, case, draw.truth, answer)
                found += map(str, judged.verdicts)
        to.send(found)


def main(samples: str = "2000", seed: str = "0", *names: str) -> None:
    """Print the verdicts with all margins, and those that change without each."""
    families = [FAMILIES[name] for name in names or FAMILIES]
    share = max(1, int(samples) // len(families))
    draws = [draw for family in families for draw in specimens(family, int(seed), share)]
    right = verdicts_without(draws)
    print("all margins:", _counted(right))
    for name in NAMES:
        pairs = zip(right, verdicts_without(draws, name), strict=True)
        changed = _counted([f"{x} -> {y}" for x, y in pairs if x != y])
        print(f"without {name}: {changed or 'the same'}", flush=True)


def _counted(values: Sequence[str]) -> str:
    return "; ".join(f"{count} {value}" for value, count in Counter(values).items())


if __name__ == "__main__":
    main(*sys.argv[1:])
