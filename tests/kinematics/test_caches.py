"""Caches of functions and threads: the last results are kept, and all are cleared."""

from concurrent.futures import ThreadPoolExecutor
from threading import Thread
from weakref import WeakSet

import pytest
from kincheck.core.caches import KEYS, ThreadCache, cache_last, clear_caches


def test_thread_cache_ends_with_thread():
    bound = ThreadCache()
    made = WeakSet()

    class Made:
        pass

    def ask():
        one, other = (bound("key", Made) for _ in range(2))
        assert one is other
        made.add(one)

    ask()
    thread = Thread(target=ask)
    thread.start()
    thread.join()
    assert len(made) == 1


def test_thread_cache_replaces_oldest_key():
    bound, made = ThreadCache(), list[int]()

    def ask(key):
        return bound(key, lambda: made.append(key) or key)

    assert [ask(key) for key in range(KEYS)] == made == [*range(KEYS)]
    ask(0)  # used most recently, so the next key replaces 1
    ask(KEYS)
    ask(0)
    assert made == [*range(KEYS + 1)]
    ask(1)
    assert made == [*range(KEYS + 1), 1]


@pytest.mark.parametrize("per_thread", [False, True])
def test_cache_last_keeps_recent_results(per_thread):
    made = list[int]()

    @cache_last(2, per_thread=per_thread)
    def ask(key):
        made.append(key)
        return [key]

    assert ask(1) is ask(1)
    for key in (2, 1, 3, 1, 2):  # 3 replaces 2
        ask(key)
    assert made == [1, 2, 3, 2]
    with ThreadPoolExecutor(1) as threads:
        other = threads.submit(ask, 1).result()
    assert (other is ask(1)) is not per_thread


@pytest.mark.parametrize("per_thread", [False, True])
def test_clear_caches_reaches_every_thread(per_thread):
    class Large:
        pass

    made = WeakSet()

    @cache_last(2, per_thread=per_thread)
    def ask(key):
        found = Large()
        made.add(found)
        return found

    with ThreadPoolExecutor(1) as threads:  # the other thread lives on
        threads.submit(ask, 1).result()
        ask(2)
        assert len(made) == 2
        clear_caches()
        assert len(made) == 0
