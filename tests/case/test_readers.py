"""Readers of files by the door of extensions: names that two of them claim, and unknown tables."""

from dataclasses import dataclass

import pytest
from kincheck import CaseError, KincheckError
from kincheck.core.case.io import reader_options, readers
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.readers import Reader, ReaderOptions
from kincheck.core.options import option


@dataclass(frozen=True)
class Ours(ReaderOptions):
    """Options of a reader."""

    grain: str | None = option("size of grains")


@dataclass(frozen=True)
class Theirs(ReaderOptions):
    """Options of another reader."""

    grain: str | None = option("sort of grains")


@dataclass(frozen=True)
class Loaded:
    """An offer of a reader."""

    reader: Reader

    def load(self):
        return self.reader


def test_readers_share_no_suffix(monkeypatch):
    offered = {name: Loaded(Reader(name, suffixes=(".grain",))) for name in ("ours", "theirs")}
    monkeypatch.setattr(readers, "offers", lambda _: offered)
    with pytest.raises(KincheckError, match=r"ours and theirs both read \.grain files"):
        readers.readers.__wrapped__()


def test_readers_share_no_option(monkeypatch):
    found = [Reader("a", Ours), Reader("b", Theirs)]
    monkeypatch.setattr(reader_options, "readers", lambda: found)
    with pytest.raises(KincheckError, match="2 readers have an option 'grain'"):
        reader_options._options_of_all()


def test_unknown_table_names_extensions(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text('schema = "kincheck-case/1"\n[hydraulics]\npressure = 1.0\n')
    with pytest.raises(CaseError, match=r"hydraulics: unknown key.*install the extension"):
        load_case(file)
