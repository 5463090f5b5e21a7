"""Fixtures of tests of programs."""

from shutil import copytree

import pytest
from kincheck import clear_caches
from kincheck.core.extensions.llvm import compiler, jit, machine_code


@pytest.fixture(scope="session")
def loops(tmp_path_factory):
    """A cache with the loops that run any program, and nothing else."""
    folder = tmp_path_factory.mktemp("loops")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        clear_caches()
        for name in ("interpret", "follow"):
            jit._loop(name, compiler.vector_width())
        clear_caches()
    return folder / "kincheck"


@pytest.fixture
def no_programs_kept(tmp_path, monkeypatch, loops):
    """The cache is without programs, so that none is compiled at first."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    copytree(loops, tmp_path / "kincheck")


@pytest.fixture
def cache_folder(monkeypatch, tmp_path):
    """The folder of a cache of the test's own, which is not there yet."""
    machine_code.works()  # its loops are kept where others are
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "kincheck"
