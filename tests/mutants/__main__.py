"""Share of small mistakes that the tests find: python -m tests.mutants 100

One token of core or adapters is changed (an operator, a comparison, a number, a sign, min and max,
a condition, a returned value), and the tests run until one fails: those that enter the
block of its line, first some of each file. Each room has mutants in proportion to its
tokens. Work is done in a temporary copy, with the engines of the interpreter that runs this; what
tests enter and what was found is kept in .mutants/, and the next run goes on from there.

    python -m tests.mutants 0                   only what tests enter, which CI keeps
    python -m tests.mutants 200 --seed 5        other mutants
    python -m tests.mutants --only 3fa9c1d2     one mutant again
    python -m tests.mutants --survivors         those that no test has found, as differences

A mutant that changes nothing that a user sees has an entry with a reason in harmless.toml.
"""

import argparse
import difflib
import json
import random
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..house import WHOLES, budgets, room_of, sizes
from ..support.sources import ROOT, files
from .related import Entered
from .sandbox import Run, Sandbox
from .sites import Mutant, mutants

KEPT = ROOT / ".mutants"
HARMLESS = Path(__file__).with_name("harmless.toml")
ENDS = ("killed", "timeout", "survived", "harmless")
STARTS, SLOWER = 60.0, 5.0
"""Limit of a run of tests: seconds, and times what the tests take without a change."""


def main(argv: Sequence[str]) -> int:
    """Judge mutants and print the shares by room."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("count", nargs="?", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", type=Path, help="file of results (default .mutants/SEED.json)")
    parser.add_argument("--quick", action="store_true", help="a minute's choice of related tests")
    parser.add_argument("--again", action="store_true", help="judge those of the list again")
    parser.add_argument("--only", metavar="ID", nargs="+", help="judge these of the list again")
    parser.add_argument("--survivors", action="store_true", help="print them and end")
    options = parser.parse_args(argv)
    KEPT.mkdir(exist_ok=True)
    file = options.list or KEPT / f"{options.seed}.json"
    found: dict[str, dict[str, Any]] = json.loads(file.read_text("utf-8")) if file.exists() else {}
    sources = {str(path): (ROOT / path).read_text("utf-8") for path in files("core", "adapters")}
    sites = {path: mutants(path, text) for path, text in sources.items()}
    by_id = {each.id: each for places in sites.values() for site in places for each in site}
    if options.survivors:
        for name, result in found.items():
            if result["end"] == "survived" and name in by_id:
                print(_difference(by_id[name], sources[by_id[name].path]))
        return 0
    if options.only:
        chosen = [by_id[name] for name in options.only]
    else:
        chosen = sample(sites, options.count, options.seed)
    again = options.again or options.only
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the copy goes
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        Path(folder).chmod(0o755)  # some tests are another user for a while
        sandbox = Sandbox(Path(folder), sources)
        entered = Entered.read(KEPT / "entered.json.gz")
        entered.renew(sandbox)
        for number, mutant in enumerate(chosen, 1):
            if again or mutant.id not in found:
                text = sources[mutant.path]
                found[mutant.id] = judge(mutant, text, sandbox, entered, options.quick)
                file.write_text(json.dumps(found, indent=1), encoding="utf-8")
            result = found[mutant.id]
            print(
                f"{number:4} {result['end']:8} {result['seconds']:6.0f} s  {mutant.id} "
                f"{mutant.path}:{mutant.start[0]} {mutant.line}  ->  {mutant.mutant}"
                f"  {result['by']}",
                flush=True,
            )
    if chosen:
        print(table([found[mutant.id] for mutant in chosen]))
    return 0


def sample(sites: Mapping[str, Sequence[Sequence[Mutant]]], count: int, seed: int) -> list[Mutant]:
    """Return mutants of every room in proportion to its tokens.

    A larger number has those of a smaller one, apart from rounding.
    """
    tokens = {
        room: size.tokens
        for room, size in sizes(budgets()).items()
        if room not in WHOLES and not room.startswith("tests")
    }
    exact = {room: count * n / sum(tokens.values()) for room, n in tokens.items()}
    shares = {room: int(share) for room, share in exact.items()}
    for room in sorted(exact, key=lambda room: shares[room] - exact[room]):
        shares[room] += sum(shares.values()) < count
    rooms: dict[str, list[Sequence[Mutant]]] = {room: [] for room in tokens}
    for path, places in sites.items():
        rooms[room_of(Path(path), rooms)] += places
    chosen = []
    for room, places in rooms.items():
        drawn = random.Random(f"{seed} {room}")
        drawn.shuffle(places)
        chosen += [drawn.choice(place) for place in places[: shares[room]]]
    return chosen


def judge(
    mutant: Mutant, text: str, sandbox: Sandbox, entered: Entered, quick: bool
) -> dict[str, Any]:
    """Run the tests of a mutant until one fails."""
    started = time.monotonic()
    end, by = "survived", ""
    if reason := harmless(mutant):
        end, by = "harmless", reason
    else:
        stages = [*entered.stages(mutant, text)]
        for tests in stages[:1] if quick else stages:
            run = _run(mutant, sandbox, tests, entered)
            if run.outcome != "passed":
                end = "timeout" if run.outcome == "timeout" else "killed"
                by = [*run.failing, *reversed(run.output.strip().splitlines()), "no output"][0]
                break
    return {
        "end": end,
        "by": by,
        "seconds": round(time.monotonic() - started, 1),
        "room": room_of(Path(mutant.path), budgets()),
        "path": mutant.path,
        "function": mutant.function,
        "line": mutant.line,
        "mutant": mutant.mutant,
    }


def _run(mutant: Mutant, sandbox: Sandbox, tests: Sequence[str], entered: Entered) -> Run:
    """Run tests with the change. A test that fails finds it if it fails again, and passes without:
    others fail because the machine is busy.
    """
    limit = STARTS + SLOWER * sum(map(entered.seconds, tests))
    while tests:
        with sandbox.changed(mutant):
            run = sandbox.run(tests, limit)
            if run.outcome == "unknown":  # some names of tests come from the changed code
                every = {test: test.partition("[")[0] for test in tests}
                found = (
                    each if f"{each}\n" in run.output else test for test, each in every.items()
                )
                run = sandbox.run([*dict.fromkeys(found)], limit)
            if not run.failing:
                return run
            again = sandbox.run(run.failing, limit).outcome != "passed"
        if again and sandbox.run(run.failing, limit).outcome == "passed":
            return run
        tests = [test for test in tests if test not in run.failing]
    return Run("passed", (), "")


def harmless(mutant: Mutant) -> str:
    """Return why a mutant changes nothing that a user sees, or ""."""
    marks = tomllib.loads(HARMLESS.read_text(encoding="utf-8"))["harmless"]
    here = {"function": mutant.function, "line": mutant.line, "mutant": mutant.mutant}
    return next((mark["reason"] for mark in marks if here.items() <= mark.items()), "")


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Return the number of each end and the share of those found, by room."""
    rooms: dict[str, Counter[str]] = {}
    for result in results:
        for room in (result["room"], "all"):
            rooms.setdefault(room, Counter())[result["end"]] += 1
    whole = rooms.pop("all")
    lines = [f"{'room':32}" + "".join(f"{end:>9}" for end in ENDS) + "    share"]
    for room, ends in (*sorted(rooms.items()), ("all", whole)):
        seen = ends["killed"] + ends["timeout"]
        judged = seen + ends["survived"]
        share = f"{100 * seen / judged:7.0f} %" if judged else ""
        lines.append(f"{room:32}" + "".join(f"{ends[end]:9}" for end in ENDS) + share)
    return "\n".join(lines)


def _difference(mutant: Mutant, text: str) -> str:
    changed = difflib.unified_diff(
        text.splitlines(),
        mutant.applied(text).splitlines(),
        f"{mutant.path} {mutant.function}",
        mutant.id,
        lineterm="",
    )
    return "\n".join(changed)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
