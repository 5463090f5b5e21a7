"""Histories made up by a seed: cases, engines, modes and machines that come and go, names and
tolerances that change, clocks that jump, versions, noise, and at most one planted fault.
"""

import math
import random
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from kincheck import Outcome
from kincheck.core.harness.record import Seconds
from kincheck.core.history.findings import Kind
from msgspec.structs import replace

from .history_runs import RESULTS, keep, times, worse

NIGHTS = 30
TEMPLATE = RESULTS.record("first", "mujoco")
FACTS = RESULTS.run["cases"]["first"]
ERROR = 2.5e-14
"""Usual error of a quiet night [m]; it must not be below what the report takes for round-off."""

PLANTED = {
    Kind.DRIFTED: worse(30000.0),
    Kind.SLOWER: times(2.6),
    Kind.FAILURE: {"outcome": Outcome.FAIL, "message": "x is off"},
    Kind.LOST: {"solved": 7},
    Kind.UNJUDGED: {"outcome": Outcome.UNJUDGED, "errors": {}},
}


@dataclass
class Machine:
    """A processor: how much slower it is than another in a solve, and in the calibration loop."""

    name: str
    solve: float = 1.0
    loop: float = 1.0


KNOWN = 5
"""Fewest nights on a machine before a slowdown there: with fewer its noise is unknown."""


def seen_before(machine, missed, begin, repair):
    """Whether each machine of the nights of a fault is known before it."""
    before = [machine[night].name for night in range(begin) if night not in missed]
    return all(before.count(machine[night].name) >= KNOWN for night in range(begin, repair))


@dataclass
class Plan:
    """What happens in the nights of a seed.

    Attributes:
        pairs: case, engine and mode.
        machine: of each night.
        fault: kind, pair, first night and the night of its repair; None for quiet nights.
        events: night of each change: a name, a tolerance, a version, a jump of the clock.
        absent: nights without an engine or a case, by its name.
        missed: nights without a run.
    """

    seed: int
    noise: random.Random
    pairs: list[tuple[str, str, str]]
    machine: list[Machine]
    fault: tuple[Kind, tuple[str, str, str], int, int] | None
    events: dict[str, int]
    absent: dict[str, range]
    missed: set[int]

    @staticmethod
    def of(seed, *, quiet):
        """The plan of a seed."""
        noise = random.Random(seed)
        cases = [f"case{k}" for k in range(noise.randrange(1, 5))]
        engines = ["native", *noise.sample(["mujoco", "exudyn", "drake"], noise.randrange(1, 3))]
        modes = {engine: ["projection"] for engine in engines}
        if noise.random() < 0.5:
            modes[engines[-1]].append("simulate")
        pairs = [
            (case, engine, mode) for case in cases for engine in engines for mode in modes[engine]
        ]
        machines = [
            Machine("one"),
            Machine("two", noise.uniform(0.6, 1.7), noise.uniform(0.6, 1.7)),
        ]
        share = noise.choice([0.0, 0.3, 0.5])
        machine = [machines[noise.random() < share] for _ in range(NIGHTS)]
        begin = noise.randrange(10, 20)
        repair = begin + noise.randrange(3, 8)
        kind, pair = noise.choice([*PLANTED]), noise.choice(pairs)
        events = {
            name: noise.choice([begin, noise.randrange(3, NIGHTS), NIGHTS])
            for name in ("rename", "tolerance", "version", "clock")
        }
        gone = noise.randrange(3, NIGHTS)
        absent = {noise.choice(engines[1:]): range(gone, gone + noise.randrange(1, 6))}
        if len(cases) > 1:  # one joins or leaves
            absent[cases[-1]] = noise.choice([range(gone), range(gone, NIGHTS)])
        missed = {night for night in range(NIGHTS) if noise.random() < 0.1}
        if not quiet:
            missed -= {begin, repair}
            absent = {name: nights for name, nights in absent.items() if name not in pair}
            if kind is Kind.SLOWER and not seen_before(machine, missed, begin, repair):
                machine = [machines[0]] * NIGHTS
        fault = None if quiet else (kind, pair, begin, repair)
        return Plan(seed, noise, pairs, machine, fault, events, absent, missed)

    def now(self, case, night):
        """The name of a case in a night: the case of the fault, or the first one, gets another."""
        changing = self.fault[1][0] if self.fault else self.pairs[0][0]
        return f"new_{case}" if case == changing and night >= self.events["rename"] else case

    def records(self, night):
        """The records of a night."""
        machine, noise = self.machine[night], self.noise
        found = []
        for pair in self.pairs:
            case, engine, mode = pair
            if any(night in self.absent.get(name, ()) for name in (case, engine)):
                continue
            warm = 0.010 * machine.solve * math.exp(noise.gauss(0.0, 0.06))
            version = "2.0" if night >= self.events["version"] else "1.0"
            looser = 10.0 if night >= self.events["tolerance"] else 1.0
            record = replace(
                TEMPLATE,
                case=self.now(case, night),
                engine=engine,
                mode=mode,
                version=version,
                seconds=Seconds(build=0.1, first=0.05, warm=warm, waited=0.0, compare=0.001),
                us_per_step=1e6 * warm / TEMPLATE.samples,
                errors={
                    output: replace(
                        each,
                        **{
                            motion: replace(
                                one,
                                max_abs=ERROR * 2.0 ** noise.uniform(-0.5, 0.5),
                                tolerance=looser * one.tolerance,
                            )
                            for motion, one in each.items()
                        },
                    )
                    for output, each in TEMPLATE.errors.items()
                },
            )
            if self.fault and pair == self.fault[1] and self.fault[2] <= night < self.fault[3]:
                for name, change in PLANTED[self.fault[0]].items():
                    value = change(getattr(record, name)) if callable(change) else change
                    record = replace(record, **{name: value})
            found.append(record)
        return found

    def facts(self, night):
        """The circumstances of a night."""
        machine = self.machine[night]
        day = datetime(2026, 1, 1, 3, tzinfo=UTC) + timedelta(days=night)
        if night >= self.events["clock"]:
            day -= timedelta(days=400)
        cases = {}
        for case in dict.fromkeys(case for case, _, _ in self.pairs):
            name = self.now(case, night)
            cases[name] = FACTS | ({"formerly": [case]} if name != case else {})
        return {
            "started": day.isoformat(),
            "processor": machine.name,
            "host": f"runner{self.noise.randrange(1000)}",
            "calibration_seconds": 0.02 * machine.loop * self.noise.uniform(0.9, 1.1),
            "numpy": "2.1.0" if night >= self.events["version"] else "2.0.0",
            "cases": cases,
        }

    def nights(self, path):
        """Keep the nights one by one; yield each with the number of its run."""
        for night in range(NIGHTS):
            if night not in self.missed:
                yield night, keep(path, self.records(night), **self.facts(night))
