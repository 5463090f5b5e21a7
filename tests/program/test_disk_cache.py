"""What is kept on disk between processes: found again where it is whole and the user's own, and no
more than there is room for.
"""

import os
from hashlib import sha256
from pathlib import Path

import pytest
from kincheck.core.program import disk_cache


@pytest.fixture
def cache_folder(monkeypatch, tmp_path):
    """The folder of a cache of the test's own, which is not there yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "kincheck"


DAY = 86400.0


def fail():
    raise AssertionError("made again")


def kept(make=lambda: b"made"):
    return disk_cache.load_or_make(b"asked", make, bytes)


def found():
    return disk_cache.find(b"asked", bytes)


def test_cache_entry_is_found(cache_folder):
    assert disk_cache.size() == 0
    assert kept() == b"made"
    assert kept(fail) == b"made"
    assert disk_cache.size() == disk_cache.DIGEST + len(b"made")


@pytest.mark.parametrize(
    "spoil",
    [lambda was: was[:-1], lambda was: was[::-1], lambda was: b""],
    ids=["short", "turned", "empty"],
)
def test_damaged_entry_is_remade(cache_folder, spoil):
    kept()
    (entry,) = cache_folder.iterdir()
    entry.write_bytes(spoil(entry.read_bytes()))
    assert found() is None
    assert kept() == b"made"
    assert found() == b"made"


def test_least_recently_used_entries_are_removed(cache_folder):
    cache_folder.mkdir(mode=0o700)
    (cache_folder / "a folder").mkdir()
    for name, days in {"yesterday": 1, "before": 2, "long ago": 3, "read since": 4}.items():
        (cache_folder / name).touch()
        os.truncate(cache_folder / name, disk_cache.MOST * 2 // 5)  # sparse: it takes no room
        entry = (cache_folder / name).stat()
        read = 0 if name == "read since" else days
        os.utime(cache_folder / name, (entry.st_atime - read * DAY, entry.st_mtime - days * DAY))
    kept(lambda: bytes(200))
    assert found() == bytes(200)
    left = {each.name for each in cache_folder.iterdir() if len(each.name) < 20}
    assert left == {"a folder", "yesterday", "read since"}
    assert disk_cache.size() <= disk_cache.MOST


posix = pytest.mark.skipif(os.name == "nt", reason="Windows has no owners and modes of this kind")


@posix
def test_cache_permissions_are_private(cache_folder):
    cache_folder.mkdir(mode=0o755)  # as older versions made it
    kept()
    (entry,) = cache_folder.iterdir()
    assert [path.stat().st_mode & 0o777 for path in (cache_folder, entry)] == [0o700, 0o600]


def opened(cache_folder):
    cache_folder.chmod(0o777)


def opened_as_tmp(cache_folder):
    cache_folder.chmod(0o1777)


def opened_above(cache_folder):
    cache_folder.parent.chmod(0o777)


def linked(cache_folder):
    cache_folder.rename(cache_folder.with_name("elsewhere"))
    cache_folder.symlink_to("elsewhere")


def linked_through_an_open_folder(cache_folder):
    (cache_folder.parent / "open").mkdir()
    (cache_folder.parent / "open").chmod(0o777)
    (cache_folder.parent / "open" / "on").symlink_to(cache_folder.parent)
    os.environ["XDG_CACHE_HOME"] = str(cache_folder.parent / "open" / "on")


SPOILT = opened, opened_as_tmp, opened_above, linked, linked_through_an_open_folder


@posix
@pytest.mark.parametrize("spoil", SPOILT)
def test_replaceable_cache_folder_is_unused(cache_folder, spoil, capsys):
    kept()
    disk_cache._usable.cache_clear()  # as another process
    spoil(cache_folder)
    assert kept(lambda: b"made again") == b"made again"
    assert found() is None
    (note,) = capsys.readouterr().err.splitlines()
    assert note.startswith("kincheck: note: compiled code is not kept: ")
    assert disk_cache.REMEDY in note


@posix
def test_foreign_cache_folder_is_unused(cache_folder, monkeypatch, capsys):
    kept()
    disk_cache._usable.cache_clear()
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)  # as with sudo and the user's HOME
    assert kept(lambda: b"made again") == b"made again"
    assert "belongs to another user" in capsys.readouterr().err


@posix
def test_cache_below_sticky_folder_is_used(cache_folder):
    cache_folder.parent.chmod(0o1777)
    kept()
    assert kept(fail) == b"made"


@posix
def test_writable_or_foreign_entry_is_remade(cache_folder):
    kept()
    (entry,) = cache_folder.iterdir()
    entry.chmod(0o666)
    assert found() is None
    assert kept(lambda: b"made again") == b"made again"
    assert entry.stat().st_mode & 0o777 == 0o600
    if os.geteuid() == 0:  # only root gives files away
        os.chown(entry, 12345, -1)
        assert found() is None
        os.chown(entry, 0, -1)
    assert found() == b"made again"
    entry.rename(cache_folder / "elsewhere")
    entry.symlink_to(cache_folder / "elsewhere")
    assert found() is None


def test_unreadable_entry_is_remade(cache_folder):
    kept()
    (entry,) = cache_folder.iterdir()
    entry.write_bytes(sha256(entry.name.encode() + b"forged").digest() + b"forged")
    assert disk_cache.load_or_make(b"asked", lambda: b"7", int) == 7
    assert found() == b"7"


@pytest.mark.parametrize("home", ["", "relative"])
def test_relative_cache_folder_is_unused(home, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    monkeypatch.setenv("HOME", home)
    monkeypatch.setattr(Path, "home", lambda: Path(home))  # Windows asks another variable
    assert kept() == b"made"
    assert disk_cache.folder() is None
    assert not [*tmp_path.iterdir()]
