"""A stress run with one margin of acceptance off, to see what it decides.

    python -m kincheck.core.extensions.laboratory.stress.margins "regular between" --samples 2000

Options are those of kincheck stress. The disk cache is another one: programs that accept too much
must not be kept.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping
from typing import Any

from ....cli.main import main
from ....kinematics.formulation.acceptance_criteria import Candidate, Limits, margins


def run_without(name: str, options: list[str]) -> int:
    """Run kincheck stress without a margin; return its exit status."""

    def fewer(pose: Candidate, limits: Limits) -> Mapping[str, Any]:
        found = margins(pose, limits)
        del found[name]
        return found

    for module in map(vars, [*sys.modules.values()]):
        if module.get("margins") is margins and module["__name__"] != __name__:
            module["margins"] = fewer
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        return main(["stress", *options])


if __name__ == "__main__":
    sys.exit(run_without(sys.argv[1], sys.argv[2:]))
