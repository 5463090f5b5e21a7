"""Machine code of programs: compiled by LLVM for this processor, kept on disk by content, processor and version."""

from __future__ import annotations

import ctypes
import hashlib
import importlib
import importlib.util
import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

DIGEST = 32
"""Bytes of the checksum at the head of what is cached."""


def available() -> bool:
    """Whether llvmlite is installed."""
    return importlib.util.find_spec("llvmlite") is not None


@cache
def _llvm() -> Any:
    llvm: Any = importlib.import_module("llvmlite.binding")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


@cache
def _target() -> tuple[Any, str]:
    """The target machine, and what identifies it together with the compiler."""
    llvm = _llvm()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    # level 1: the optimiser's passes cost ten times the time and gain nothing on straight-line code
    machine = llvm.Target.from_default_triple().create_target_machine(cpu=cpu, features=features, opt=1)
    return machine, "\n".join((cpu, features, machine.triple, importlib.import_module("llvmlite").__version__))


@cache
def vector_width() -> int:
    """Doubles in a vector register of this processor."""
    features = _llvm().get_host_cpu_features()
    return 8 if features.get("avx512f") else 4 if features.get("avx") else 2


class Code:
    """Machine code of functions; calls of them release Python's lock.

    Args:
        signatures: by function, how many arguments it takes: addresses and whole numbers. All return a whole number, or nothing
            of sense. Others are known by their address.
    """

    def __init__(self, code: bytes, signatures: Mapping[str, int]) -> None:
        llvm = _llvm()
        self._owner = llvm.create_mcjit_compiler(llvm.parse_assembly(""), llvm.Target.from_default_triple().create_target_machine())
        self._owner.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._owner.finalize_object()
        # whole numbers are passed as addresses are: ctypes takes a third of the time for those
        types = {name: ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * count) for name, count in signatures.items()}
        self.calls: dict[str, Callable[..., int]] = {name: kind(self.address(name)) for name, kind in types.items()}

    def address(self, name: str) -> int:
        """Where a function stands."""
        return self._owner.get_function_address(name)


def load(content: str, text: Callable[[], str], signatures: Mapping[str, int] | None = None) -> Code:
    """Compile the text, or fetch from the cache what the content meant before."""
    machine, _ = _target()
    code = kept(told(content), lambda: machine.emit_object(_llvm().parse_assembly(text())))
    return Code(code, signatures or {})


def find(content: str) -> Code | None:
    """What the content meant before, if it is in the cache."""
    code = _read(_entry(told(content)))
    return None if code is None else Code(code, {})


def known(content: bytes) -> bool:
    """Whether there is something in the cache that the content meant before."""
    return _entry(content).exists()


def told(content: str) -> bytes:
    """What determines machine code: this for any processor and compiler, and both of them."""
    _, identity = _target()
    return f"{identity}\n{content}".encode()


def kept(content: bytes, make: Callable[[], bytes]) -> bytes:
    """What the content meant before, from the cache; or made now, and kept."""
    entry = _entry(content)
    found = _read(entry)
    if found is None:
        found = make()
        _write(entry, found)
    return found


def _entry(content: bytes) -> Path:
    return folder() / hashlib.sha256(content).hexdigest()


def folder() -> Path:
    """Where compiled code and traced programs are kept; below XDG_CACHE_HOME where that is set."""
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "kincheck"


def _read(entry: Path) -> bytes | None:
    """What is cached, or None where there is nothing that is whole."""
    try:
        kept = entry.read_bytes()
    except OSError:
        return None
    code = kept[DIGEST:]
    return code if _checksum(entry, code) == kept[:DIGEST] else None


def _write(entry: Path, code: bytes) -> None:
    """Keep it; a place that cannot be written only costs the next process a compilation."""
    import tempfile  # slow to import, and what is cached already needs none

    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=entry.parent) as folder:
            whole = Path(folder) / entry.name
            whole.write_bytes(_checksum(entry, code) + code)
            whole.replace(entry)  # whole or not at all, whoever else is writing it
    except OSError:
        return


def _checksum(entry: Path, code: bytes) -> bytes:
    """Of an entry under its name: what was written for another is none."""
    return hashlib.sha256(entry.name.encode() + code).digest()
