"""Isolation: whatever an engine does in a worker process, its pair gets the right record and no
other pair is touched.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import msgspec
import pytest
from kincheck import Outcome
from kincheck.core.extras import THREADS
from kincheck.core.harness.execution import LONGEST_MESSAGE, solve_in_process
from kincheck.core.harness.resource_limits import Limits
from kincheck.core.harness.run import run
from kincheck.core.harness.workers.pool import in_workers

from ..support.bad_engine import Bad, Elsewhere, Leaking, Unimportable
from ..support.examples import examples
from ..support.fake_command import Slow
from ..support.fakes import Fake, crank, raising, record_of, run_case

(EXPECTED,) = examples(__file__, "expected")

ROOT = Path(__file__).parents[2]
TOL = 1e-12
# Long for a crank even on a busy machine, short for a test that waits for it.
LIMITS = Limits(timeout=2.0, memory=1.0)
PATIENT = Limits(timeout=60.0, memory=1.0)


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    """Workers find the engines of the tests where their parent does."""
    monkeypatch.syspath_prepend(str(ROOT))


def timeless(records):
    """What two runs must have in common."""
    return [msgspec.structs.replace(each, seconds=None, us_per_step=None) for each in records]


def test_engine_faults_become_records():
    cases = [crank(kind) for kind in EXPECTED]
    results = run(cases, [Bad(), Fake("good")], tol=TOL, solver=in_workers(2, LIMITS))
    found = {(each.case, each.engine): each for each in results.records}
    assert list(found) == [(kind, engine) for kind in EXPECTED for engine in ("bad", "good")]
    for kind, (outcome, message) in EXPECTED.items():
        record = found[kind, "bad"]
        assert (kind, record.outcome) == (kind, outcome)
        assert message in record.message
        assert len(record.message) < LONGEST_MESSAGE + 100
        assert " left out ..." not in record.message or len(record.message) >= LONGEST_MESSAGE
        assert record.version == "1.2"  # it was told before the fault
        assert found[kind, "good"].outcome is Outcome.PASS
    # the line that crashed, the end of what was printed, and no more
    assert 'bad_engine.py", line' in found["abort", "bad"].message
    assert "solving segfault" in found["segfault", "bad"].details["printed"]
    assert "Current thread 0x..." in found["segfault", "bad"].details["printed"]
    assert found["nan", "bad"].seconds.build is not None
    assert found["nan", "bad"].seconds.warm is None


def test_flood_of_output_is_discarded():
    record = record_of(Bad(), crank("flood"), solver=in_workers(1, PATIENT))
    assert (record.outcome, record.message) == (Outcome.PASS, "")
    assert "printed" not in record.details


def test_unimportable_engine_is_error():
    results = run_case(crank(), Unimportable(), Fake("good"), solver=in_workers(1, PATIENT))
    assert [each.outcome for each in results.records] == [Outcome.ERROR, Outcome.PASS]
    assert "No module named 'no_such_simulator_anywhere'" in results.records[0].message


def test_worker_is_replaced_after_crash():
    cases = [crank(name) for name in ("a", "b", "segfault", "c", "d")]
    results = run(cases, [Elsewhere()], tol=TOL, solver=in_workers(1, PATIENT))
    a, b, crash, c, d = (each.details.get("process") for each in results.records)
    assert os.getpid() != a == b
    assert crash is None
    assert b != c == d


@pytest.mark.parametrize("given", [None, "2"])
def test_workers_use_one_algebra_thread(monkeypatch, given):
    """Two that wait for each other on a busy machine made Exudyn's steps 30 times as long."""
    started, start = list[str](), subprocess.Popen
    for name in THREADS:
        if given is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, given)

    def noted(*command, **options):
        started.extend(options["env"][name] for name in THREADS)
        return start(*command, **options)

    monkeypatch.setattr(subprocess, "Popen", noted)
    record = record_of(Elsewhere(), crank("a"), solver=in_workers(1, PATIENT))
    assert record.outcome is Outcome.PASS
    assert started == [given or "1"] * len(THREADS)


def test_memory_leak_costs_no_pair():
    """Each pair keeps 0.3 GB of the half that there is: the second fails in the process of the
    first, and passes in its own.
    """
    results = run(
        [crank(name) for name in "ab"],
        [Leaking()],
        tol=TOL,
        solver=in_workers(1, Limits(memory=0.5)),
    )
    assert [each.message for each in results.records] == ["", ""]


def test_records_do_not_depend_on_jobs():
    """Without a reference the others wait for the native engine, which is the last to be
    through.
    """
    cases = [crank("a", reference=False), crank("b"), crank("c", reference=False)]
    engines = [Fake(), Fake("missing", installed=None), Slow("native", seconds=0.05)]
    three, one, none = (
        run(cases, engines, tol=TOL, solver=solver).records
        for solver in (in_workers(3, PATIENT), in_workers(1, PATIENT), solve_in_process)
    )
    assert timeless(three) == timeless(one) == timeless(none)
    assert [each.errors["x"].position.against for each in three if each.engine == "fake"] == [
        "native",
        "closed_form",
        "native",
    ]


def test_crash_of_baseline_is_reported():
    case = crank("segfault", reference=False)
    record = record_of(Fake(), case, baseline=Bad("native"), solver=in_workers(2, PATIENT))
    assert record.outcome is Outcome.UNJUDGED
    why = (
        "the case has no reference, and the native engine has no answer (crashed: the process died"
        " of SIGSEGV"
    )
    assert record.message.startswith(why)


def test_unpicklable_engine_names_remedy():
    record = record_of(Fake(answer=raising(ValueError())), solver=in_workers(1, PATIENT))
    assert record.outcome is Outcome.ERROR
    assert record.message.startswith("cannot be sent to a worker process: ")
    assert "--jobs 0" in record.message


@pytest.fixture
def deaf(monkeypatch, tmp_path):
    """Waits for a worker to be in the middle of what it will never end."""
    told = tmp_path / "deaf"
    monkeypatch.setenv("KINCHECK_TEST_DEAF", str(told))
    return lambda: until(told.exists)


def until(condition):
    """Wait for it, not for ever; whether it has come."""
    deadline = time.monotonic() + 60.0
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    return condition()


def test_interrupt_ends_workers(deaf):
    def interrupt(record, done, total):
        assert deaf()
        raise KeyboardInterrupt

    marker = mark()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_case(crank("deaf"), Bad(), Fake(), solver=in_workers(2, Limits()), progress=interrupt)
    assert marked(marker) == []
    assert time.monotonic() - begin < Limits().timeout


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere only between pairs")
def test_hanging_worker_dies_with_parent(deaf):
    marker = mark()
    code = (
        "from tests.harness.test_workers import *; run([crank('deaf')], [Bad()], tol=TOL,"
        " solver=in_workers(1, Limits()))"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT) as parent:
        assert deaf()
        assert len(marked(marker)) == 2
        parent.kill()
    assert until(lambda: marked(marker) == [])


def mark():
    """Mark the processes that are started from now on."""
    os.environ["KINCHECK_TEST_MARKER"] = marker = f"{os.getpid()}-{time.monotonic_ns()}"
    return marker


def marked(marker):
    """The processes that are there and have the mark: others than this one, whose environment was
    read before it.
    """
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if marker.encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:  # another user's, or gone
            continue
    return found
