"""Files that are written whole or not at all; and pipes, and disks that are full."""

import os
import stat

import pytest
from kincheck.core.case.io.atomic_files import write_all, written
from kincheck.core.cli.main import main


def test_concurrent_writers_keep_file_whole(tmp_path):
    """One begins while the other is at it: what is there in the end is the whole of the one that
    ended last.
    """
    file = tmp_path / "results.json"

    def first(part):
        part.write_bytes(10 * b"A")
        assert written(file, lambda part: part.write_bytes(4 * b"B")) == []
        assert file.read_bytes() == 4 * b"B"
        with part.open("ab") as more:
            more.write(10 * b"A")

    assert written(file, first) == []
    assert file.read_bytes() == 20 * b"A"
    assert [each.name for each in tmp_path.iterdir()] == ["results.json"]


def test_written_file_keeps_permissions(tmp_path):
    file = tmp_path / "secret.json"
    file.write_text("old")
    file.chmod(0o600)
    assert written(file, b"new") == []
    assert file.read_bytes() == b"new"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_written_file_with_longest_name(tmp_path):
    file = tmp_path / (250 * "n" + ".json")
    assert written(file, b"there") == []
    assert file.read_bytes() == b"there"


@pytest.mark.skipif(os.name != "posix", reason="pipes have no names in the file system")
def test_pipes_take_several_texts(tmp_path):
    named, end = tmp_path / "pipe", os.pipe()
    os.mkfifo(named)
    reader = os.open(named, os.O_RDONLY | os.O_NONBLOCK)
    nameless = named.with_name("link")
    # as a shell has it: what it leads to is a name of nothing
    nameless.symlink_to(f"/proc/self/fd/{end[1]}")
    assert write_all([(named, b"one "), (named, b"two"), (nameless, b"three")]) == []
    assert os.read(reader, 100) == b"one two"
    assert os.read(end[0], 100) == b"three"
    for each in (reader, *end):
        os.close(each)


@pytest.mark.needs("explain", "assemblies")
@pytest.mark.skipif(
    not os.path.exists("/dev/full"), reason="there is no device that is always full"
)
@pytest.mark.parametrize("command", ["explain rssr --samples 3", "assemblies rssr --samples 3"])
def test_full_disk_is_one_message(command, capsys):
    assert main([*command.split(), "--json", "/dev/full"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(
        "kincheck: --json /dev/full: cannot be written (No space left on device); give a file in a"
        " folder that "
    )


def test_two_options_name_one_pipe(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    options = ["--junit", str(pipe), "--markdown", str(pipe)]
    assert main(["run", "rssr", "--engine", "native", *options]) == 0
    text = os.read(reader, 100_000).decode()
    os.close(reader)
    assert "</testsuites>" in text
    assert "| `rssr` |" in text
