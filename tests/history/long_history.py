"""A history of thousands of runs, and what `report` and `history` take on it.

    python -m tests.history.long_history FILE [RUNS]

Three nights are stored and judged as every night is. The other runs are copies of the last one,
with noise in their times, written as rows.
"""

import json
import random
import subprocess
import sys
from pathlib import Path

import kincheck
from kincheck.core.history.judging import judge_runs
from kincheck.core.history.store import Store
from msgspec.structs import replace

from ..support.history_runs import FACTS

CASES = ["five_bar", "rssr", "mcpherson_strut"]
ENGINES = {"native": "0.3.0", "mujoco": "4.0.0", "pinocchio": "4.1.0"}
MEGABYTES = 20
"""What a report, and a list of the runs, may take of memory, imports apart."""


def make(path, runs):
    """Write a history of so many runs of nine pairs: three cases of the library in three engines.

    The results are those of the native engine, under three names.
    """
    found = kincheck.run(CASES, ["native"], jobs=0)
    records = [
        replace(each, engine=engine, version=version)
        for each in found.records
        for engine, version in ENGINES.items()
    ]
    facts = {**found.run, **FACTS, "command": "kincheck run", "calibration_seconds": 0.02}
    with Store(path) as store:
        for day in range(3):
            known = {**facts, "started": f"2000-01-0{day + 1}T03:00:00+00:00"}
            run = store.begin_run("same", [each.pair for each in records], known)
            for record in records:
                store.add_record(run, record)
            store.finish(run, replace(found, run=known, records=records))
        judge_runs(store)
        with store.transaction():
            _copy(store.connection, run, runs - run)


def _copy(connection, run, count):
    """Add copies of a run, each a day later, with noise of a tenth in its times."""
    noise = random.Random(1)
    later = [(run + day, f"+{day} days") for day in range(1, count + 1)]
    columns = "finished, status, command, identity, owner, plan, circumstances"
    started = "strftime('%Y-%m-%dT%H:%M:%S+00:00', started, ?)"
    connection.executemany(
        f"INSERT INTO runs SELECT ?, {started}, {columns} FROM runs WHERE id = {run}", later
    )
    for table, names in _tables(connection):
        values = ", ".join(
            "? * warm_seconds" if name == "warm_seconds" else ("?" if name in RUNS else name)
            for name in names
        )
        given = [
            [factor if name == "warm_seconds" else number for name in names if name in CHANGED]
            for number, _ in later
            for factor in (noise.uniform(0.9, 1.1),)
        ]
        connection.executemany(
            f"INSERT INTO {table} SELECT {values} FROM {table} WHERE run_id = {run}", given
        )


RUNS = "run_id", "base_run"
CHANGED = (*RUNS, "warm_seconds")
"""Columns of copies that differ."""


def _tables(connection):
    """The tables with a row of a run for each pair or case, and their columns."""
    for table in ("records", "attachments", "states"):
        rows = connection.execute(f"PRAGMA table_info({table})")
        yield table, [name for _, name, *_ in rows]


COUNTED = """
import contextlib, io, json, sys, tracemalloc
from kincheck.core.cli.main import main

calls, said = 0, io.StringIO()

def count(frame, event, argument):
    global calls
    calls += event in ("call", "c_call")

with contextlib.redirect_stdout(io.StringIO()):
    main(sys.argv[1:])  # what is imported, and what stays in memory
with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
    tracemalloc.start()
    sys.setprofile(count)
    status = main(sys.argv[1:])
    sys.setprofile(None)
memory = tracemalloc.get_traced_memory()[1]
print(json.dumps([status, calls, memory / 1e6, said.getvalue()]))
"""


def cost(*words):
    """Status, calls of functions, largest memory [MB] and output of a command.

    Calls are counted, since the time of a processor is another one on each machine.
    """
    command = [sys.executable, "-c", COUNTED, *map(str, words)]
    return json.loads(subprocess.check_output(command, text=True))


if __name__ == "__main__":
    file, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    if not file.exists():
        make(file, count)
    print(f"{file.stat().st_size / 1e6:.0f} MB")
    for words in (("report",), ("history",), ("history", "--case", "rssr"), ("--version",)):
        history = () if words == ("--version",) else ("--history", file)
        status, calls, megabytes, said = cost(*words, *history)
        print(f"{' '.join(words)}: status {status}, {calls} calls, {megabytes:.0f} MB")
        print(said[:300])
