"""Histories made up night by night: the same two cases in two engines, with what a test plants in
them.
"""

import math
import random

from kincheck.core.cli.main import main
from kincheck.core.harness.record import Seconds
from kincheck.core.harness.run import run
from kincheck.core.history.comparison import regressions
from kincheck.core.history.runs import find, find_against
from kincheck.core.history.store import Store
from msgspec.structs import replace

from .fakes import Fake, crank, off

FIRST = ("first", "mujoco")
"""The pair in which faults are planted unless another is named."""
ENGINES = [
    Fake("native"),
    Fake("mujoco", answer=off("position", lambda p: p + 5e-13), installed="4.0.0"),
]
RESULTS = run([crank("first"), crank("second")], ENGINES, tol=1e-12)
FACTS = {
    "kincheck": "0.1.0",
    "python": "3.12.3",
    "numpy": "2.0.0",
    "host": "a-host",
    "processor": "a processor",
    "tol": 1e-12,
}


def records(*, noise=None):
    """Records as every night has them, each with 10 ms a solve; noise: a generator of random
    numbers, for up to 10 % about that.
    """

    def timed(record):
        warm = 0.010 * (math.exp(noise.uniform(-0.1, 0.1)) if noise else 1.0)
        seconds = Seconds(build=0.1, first=0.05, warm=warm, waited=0.0, compare=0.001)
        return replace(record, seconds=seconds, us_per_step=1e6 * warm / record.samples)

    return [timed(record) for record in RESULTS.records]


def changed(all_records, *, case="first", engine="mujoco", **changes):
    """The records with one of them changed; a change is a value, or a function of the old one."""

    def one(record):
        if (record.case, record.engine) != (case, engine):
            return record
        values = {
            name: change(getattr(record, name)) if callable(change) else change
            for name, change in changes.items()
        }
        return replace(record, **values)

    return [one(record) for record in all_records]


def times(factor):
    """A change of seconds."""
    return {"seconds": lambda seconds: replace(seconds, warm=factor * seconds.warm)}


def worse(factor, output="x", motion="position"):
    """A change of errors: one output's grows."""

    def change(errors):
        deviation = getattr(errors[output], motion)
        grown = replace(deviation, max_abs=factor * deviation.max_abs)
        return errors | {output: replace(errors[output], **{motion: grown})}

    return {"errors": change}


def keep(path, all_records, *, status="finished", **facts):
    """One more run in a history; its number. facts: circumstances that are not as always."""
    with Store(path) as store:
        day = len(store.runs()) + 1
        git = {"commit": f"{day:02x}" * 20, "branch": "main", "changed": False}
        known = {
            **FACTS,
            "started": f"2026-11-{day:02d}T03:00:00+00:00",
            "command": "kincheck run",
            "git": git,
        }
        known |= {"calibration_seconds": 0.02, "cases": RESULTS.run["cases"], **facts}
        run_number = store.begin_run("same", [each.pair for each in all_records], known)
        for record in all_records:
            store.add_record(run_number, record)
        if status != "running":
            store.finish(run_number, replace(RESULTS, run=known, records=all_records), status)
    return run_number


def keep_changed(path, **changes):
    """One more run, whose records are changed as by `changed`."""
    return keep(path, changed(records(), **changes))


def nights(path, count, seed=1):
    """So many quiet nights."""
    noise = random.Random(seed)
    for _ in range(count):
        keep(path, records(noise=noise))


def report(path, *words):
    """Status of `kincheck report` of a history."""
    return main(["report", "--history", str(path), *map(str, words)])


def history(path, *words):
    """Status of `kincheck history` of a file."""
    return main(["history", "--history", str(path), *map(str, words)])


def kinds(found):
    """Kind, case and engine of the findings of a report."""
    return [(each.kind, each.case, each.engine) for each in found.findings]


def reported(path, run=None, against="last-green"):
    with Store(path, writable=False) as store:
        subject = find(run, store)
        return regressions(subject, *find_against(against, subject, store), store)
