"""What fuzzing has found, read again: a minimal set of inputs that reaches all that was reached,
and all that failed once.

The fuzzers themselves run by hand: see tests/fuzz/__main__.py.
"""

import importlib.util
import random
from functools import cache

import pytest

from ..fuzz import fuzzing, keeping

READERS = {
    name: keeping.fuzzer(name)
    for name in sorted(keeping.READERS)
    if name != "usd" or importlib.util.find_spec("pxr")
}
# Inputs of a random choice of changes, the same in every run; the fuzzers try millions.
CHANGES = 20


@cache
def seeds(name):
    return READERS[name].seeds()


@pytest.mark.parametrize("name", READERS)
def test_fuzz_seeds_are_read(name, monkeypatch):
    """Were they refused, the fuzzers would see no further than their faults."""
    for module in (fuzzing, READERS[name]):
        monkeypatch.setattr(module, "read_or_refused", lambda read: read(), raising=False)
    for seed in seeds(name):
        READERS[name].one(seed)


@pytest.mark.parametrize("name", READERS)
def test_fuzz_corpus_is_read_or_refused(name):
    for each in [*keeping.kept(name), *keeping.kept(f"{name}.defects")]:
        READERS[name].one(each)


@pytest.mark.parametrize("name", READERS)
def test_mutated_seeds_are_read_or_refused(name):
    rng = random.Random(1)
    changed = [READERS[name].mutate(rng.choice(seeds(name)), rng) for _ in range(CHANGES)]
    assert sum(each not in seeds(name) for each in changed) > CHANGES // 2
    for each in changed:
        READERS[name].one(each)


@pytest.mark.parametrize(
    "message",
    [
        "",
        "elsewhere: found x; correct it",
        "{file}: found x",
        "{file}: found \x1b; correct it",
        "{file}: " + "x" * 5000 + "; correct it",
    ],
)
def test_fuzzer_reports_unclear_message(message):
    def refuse():
        raise fuzzing.KincheckError(message.format(file=fuzzing.FOLDER / "a.toml"))

    with pytest.raises(AssertionError):
        fuzzing.read_or_refused(refuse)


def test_fuzzer_reports_other_exception(tmp_path):
    with pytest.raises(ZeroDivisionError):
        fuzzing.read_or_refused(lambda: 1 / 0)
