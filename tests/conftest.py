"""Settings and fixtures of all tests."""

import gc
import os
import re
import signal
from functools import cache
from pathlib import Path

import kincheck.adapters
import kincheck.cases
import pytest
from hypothesis import settings
from kincheck import Joint, clear_caches
from kincheck.core.cli import main as cli
from kincheck.core.doors import extensions
from kincheck.core.harness import execution, provenance
from kincheck.core.harness.provenance import truth_of

from .support import browser
from .support.fakes import Fake, crank

# For the workers of pytest-xdist, which inherit it: two threads each on two processors wait for
# each other, and a matrix of 150 rows takes ten times as long.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Processes that tests start keep their bytecode, as those of users do: each would compile its own.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# Processes that tests start take Ctrl-C, also where the tests run in the background.
signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ.pop("COLUMNS", None)  # pytest-xdist sets it for its workers; logs have their own width

# A change is judged by the same examples on every machine. `--hypothesis-profile=search` draws new
# ones, as the nightly run does.
settings.register_profile("repeatable", derandomize=True)
settings.register_profile("search", derandomize=False)
settings.load_profile("repeatable")

# By default Python searches for garbage after 700 new objects. With the syntax trees of two hundred
# test files in memory, that takes a third of the collection of tests.
gc.set_threshold(50_000, 20, 20)

NATIVE = Fake("native")
OF_EXTENSION = re.compile(r"(kincheck\.core\.extensions|kincheck\.adapters|tests\.extensions)\.\w+")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Leave out test files that import an extension that is not there."""
    report = yield
    error = report.call.excinfo and report.call.excinfo.value.__cause__
    if isinstance(error, ModuleNotFoundError) and OF_EXTENSION.fullmatch(error.name or ""):
        report.outcome = "skipped"
        report.longrepr = str(collector.path), 0, f"{error.name} is not there"
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark parameters of a test with `by_day(step)` as nightly, all but each step-th. Several lists
    count by the sum of their places, so that their values take turns.
    """
    for item in items:
        for step in (each.args[0] for each in item.iter_markers("by_day")):
            lists = [each.args[0] for each in item.iter_markers("parametrize")]
            names = [each.split(",")[0] if isinstance(each, str) else each[0] for each in lists]
            if sum(item.callspec.indices[name] for name in names) % step:
                item.add_marker("nightly")


def pytest_runtest_setup(item):
    """Skip a test that `needs(name)` an extension that is not there."""
    for each in item.iter_markers("needs"):
        if absent := set(each.args) - extensions().keys():
            pytest.skip(f"without {', '.join(sorted(absent))}")


def pytest_collection_finish():
    """Exclude the collected tests, a million objects, from garbage collection."""
    gc.collect()
    gc.freeze()


class Changes(pytest.MonkeyPatch):
    """Changes of a test, which empty the caches with changed code and after it, so that no other
    test sees its models.

    Other tests share models: without that the suite takes a tenth more.
    """

    is_code = False

    def setattr(self, *given, **more):
        self.is_code = True
        clear_caches()
        super().setattr(*given, **more)

    def setenv(self, *given, **more):
        self.is_code = True  # it can say where machine code is kept
        clear_caches()
        super().setenv(*given, **more)

    def undo(self):
        super().undo()
        if self.is_code:
            clear_caches()


@pytest.fixture
def monkeypatch():
    with Changes.context() as patch:
        yield patch


@pytest.fixture
def patch():
    """Changes that are no code of models: the caches stay."""
    with pytest.MonkeyPatch.context() as patch:
        yield patch


@pytest.fixture(autouse=True, scope="session")
def known_circumstances():
    """Replace the measured speed of the machine by a constant, and read the state of the repository
    once: both take longer than most tests. The tests of these functions call the functions
    themselves.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "calibration", lambda: 0.02)
        patch.setattr(provenance, "git_state", cache(provenance.git_state))
        yield


@pytest.fixture(autouse=True, scope="session")
def one_warm_solve():
    """Repeat a timed solve once, because most tests do not read the time. Tests of times restore
    the number of a user's run.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(execution, "WARM_SOLVES", 1)
        yield


@pytest.fixture
def cluster(monkeypatch):
    """A dask.distributed cluster of two workers, with a real scheduler, on loopback."""
    distributed = pytest.importorskip("distributed")
    # for its workers too, which are spawned from here
    monkeypatch.syspath_prepend(str(Path(__file__).parent.parent))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as found:
        yield found


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """Where one Chromium listens for all tests, each with a page of its own."""
    if browser.CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with browser.chromium(tmp_path_factory.mktemp("chromium")) as host:
        yield host


@pytest.fixture(name="browser")
def page_of_browser(chromium):
    """A page in a browser; anything on its console is a failure."""
    page = browser.Browser(chromium)
    yield page
    complaints = page.complaints()
    page.close()
    assert complaints == []


@pytest.fixture
def path(tmp_path):
    """The file of a history."""
    return tmp_path / "history.sqlite"


@pytest.fixture
def own_joint_types(patch):
    """Joint types that a test makes are forgotten after it."""
    patch.setattr(Joint, "registry", dict(Joint.registry))


@pytest.fixture
def in_folder(monkeypatch):
    """In the folder of the joint types of users, as a user is."""
    monkeypatch.chdir(Path(__file__).parent / "user_joints")
    monkeypatch.syspath_prepend("")


@pytest.fixture
def kincheck_main():
    """main() with the cases and engines of the test; its first argument may hold several words.

    These are no code of models: each call has a patch of its own, so that the caches stay.
    """

    def main(*argv, engines=(NATIVE,), cases=None, jobs="0"):
        cases = {"crank": crank(), "crank_two": crank("crank_two")} if cases is None else cases
        by_name = {engine.name: engine for engine in engines}
        with pytest.MonkeyPatch.context() as patch:
            patch.delenv("KINCHECK_HISTORY", raising=False)
            patch.setattr(kincheck.adapters, "ENGINES", dict.fromkeys(by_name, "Fake"))
            patch.setattr(kincheck.adapters, "SIMULATIONS", {})
            patch.setattr(kincheck.adapters, "engine", lambda name, _: by_name.get(name, NATIVE))
            patch.setattr(kincheck.cases, "names", lambda: tuple(cases), raising=False)
            patch.setattr(kincheck.cases, "load", lambda name: cases[name], raising=False)
            about = {name: (truth_of(case), case.source) for name, case in cases.items()}
            patch.setattr(kincheck.cases, "summary", about.__getitem__)
            # in this process, to which fakes with answers of their own belong; isolation has a room
            # of its own
            first, *others = argv
            words = [*first.split(), *map(str, others)]
            return cli.main([*words, *(["--jobs", jobs] if words[0] == "run" and jobs else [])])

    return main
