"""What is kept on disk between processes: found again where it is whole, and no more than there is
room for.
"""

import os

import pytest
from kincheck.core.program import disk_cache

DAY = 86400.0


@pytest.fixture
def here(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "kincheck"


def fail():
    raise AssertionError("made again")


def test_what_was_made_is_found(here):
    assert disk_cache.size() == 0
    assert disk_cache.kept(b"asked", lambda: b"made") == b"made"
    assert disk_cache.kept(b"asked", fail) == b"made"
    assert disk_cache.size() == disk_cache.DIGEST + len(b"made")


@pytest.mark.parametrize(
    "spoil",
    [lambda was: was[:-1], lambda was: was[::-1], lambda was: b""],
    ids=["short", "turned", "empty"],
)
def test_what_is_not_whole_is_made_again(here, spoil):
    disk_cache.kept(b"asked", lambda: b"made")
    (entry,) = here.iterdir()
    entry.write_bytes(spoil(entry.read_bytes()))
    assert disk_cache.find(b"asked") is None
    assert disk_cache.kept(b"asked", lambda: b"made") == b"made"
    assert disk_cache.find(b"asked") == b"made"


def test_what_was_not_used_for_longest_goes(here, monkeypatch):
    monkeypatch.setattr(disk_cache, "MOST", 1000)
    here.mkdir()
    (here / "a folder").mkdir()
    for days, name in enumerate(["yesterday", "before", "long ago", "read since"], 1):
        (here / name).write_bytes(bytes(300))
        entry = (here / name).stat()
        os.utime(here / name, (entry.st_atime - days * DAY, entry.st_mtime - days * DAY))
    read = (here / "read since").stat()
    os.utime(here / "read since", (read.st_atime + 4 * DAY, read.st_mtime))
    disk_cache.kept(b"asked", lambda: bytes(200))
    assert disk_cache.find(b"asked") == bytes(200)
    assert {each.name for each in here.iterdir() if len(each.name) < 20} == {
        "a folder",
        "yesterday",
        "read since",
    }
    assert disk_cache.size() <= 1000
