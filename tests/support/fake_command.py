"""A command line with made-up cases and engines, for runs that are killed, in processes of their
own. SIZE=500x7 in the environment makes 500 cases, 7 engines and a case in which the first engine
hangs.
"""

import os
import sys
import time
from dataclasses import dataclass

import kincheck.adapters
import kincheck.cases
from kincheck.core.cli import main as cli
from kincheck.core.harness import provenance

from .bad_engine import Bad
from .fakes import Fake, crank, solution


@dataclass
class Slow(Fake):
    """Takes its time for each solve."""

    seconds: float = 0.005

    def solve(self, model, case, tol):
        time.sleep(self.seconds)
        return solution(case)


# the crash comes last: a worker after it would be one more to start
CASES = {name: crank(name, reference=name != "free") for name in ("first", "free", "segfault")}
ENGINES = {"native": Slow("native"), "bad": Bad()}


if size := os.environ.get("SIZE"):
    cases, engines = map(int, size.split("x"))
    names = [*(f"c{k}" for k in range(cases)), "deaf"]
    CASES = {name: crank(name) for name in names}
    names = ["native", *(f"slow{k}" for k in range(2, engines))]
    slow = [Slow(name, seconds=6.0 / (cases * engines)) for name in names]
    ENGINES = {each.name: each for each in (Bad(), *slow)}


def main():
    """`kincheck` with these, on the arguments of the process."""
    kincheck.adapters.ENGINES = dict.fromkeys(ENGINES, "")
    kincheck.adapters.SIMULATIONS = {}
    kincheck.adapters.engine = lambda name, mode="projection": ENGINES[name]
    kincheck.cases.names = lambda: tuple(CASES)
    kincheck.cases.load = CASES.__getitem__
    kincheck.cases.summary = lambda name: ("closed form", "made up")
    provenance.calibration = lambda: 0.02  # its own work takes longer than a run
    return cli.main(sys.argv[1:])
