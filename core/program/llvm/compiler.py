"""Interface to LLVM by llvmlite: processor features, compilation of a text, and loading of the
result.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ..disk_cache import kept
from . import elf_loader

TRAITS = b"vendor_id", b"cpu family", b"model", b"stepping", b"flags"
"""Fields of /proc/cpuinfo that LLVM depends on."""


class Processor(NamedTuple):
    """Target of machine code: LLVM's processor name, its features, the system, and llvmlite's
    version.
    """

    name: str
    features: str
    triple: str
    version: str


def available() -> bool:
    """Return whether llvmlite is installed and its library loads, or did when first needed."""
    return importlib.util.find_spec("llvmlite") is not None and _loads()


@cache
def _loads() -> bool:
    try:
        # asks LLVM only without a cached answer
        processor()
    except (ImportError, OSError):  # `kincheck doctor` reports it
        return False
    return True


@cache
def llvm() -> Any:
    """Return LLVM's binding. Its import takes three times as long as loading a cached model; cached
    code needs none.
    """
    found: Any = importlib.import_module("llvmlite.binding")
    found.initialize_native_target()
    found.initialize_native_asmprinter()
    return found


@cache
def processor() -> Processor:
    """Return LLVM's description of the processor; with `elf_loader` from the cache, keyed by the
    system's description.

    An emulator that hides instructions of the processor (valgrind) needs a separate cache.
    """
    known = _described()
    return _read(_ask_llvm()) if known is None else kept(known, _ask_llvm, _read)


def _read(description: bytes) -> Processor:
    return Processor(*description.decode().split("\n"))


@cache
def vector_width() -> int:
    """Return the doubles in a vector register of this processor."""
    features = processor().features.split(",")
    return 8 if "+avx512f" in features else 4 if "+avx" in features else 2


def emitted(text: str) -> bytes:
    """Return the machine code of a text: an object file."""
    here = processor()
    # level 1: the optimiser's passes cost ten times the time and gain nothing on straight-line
    # code
    options = (
        {"opt": 1, "reloc": "pic", "codemodel": "small"} if elf_loader.possible() else {"opt": 1}
    )
    machine = (
        llvm()
        .Target.from_default_triple()
        .create_target_machine(cpu=here.name, features=here.features, **options)
    )
    return machine.emit_object(llvm().parse_assembly(text))


def loaded(file: bytes) -> Callable[[str], int]:
    """Load an object file by LLVM; return a function from name to address, which also keeps the
    code alive.
    """
    engine = llvm().create_mcjit_compiler(
        llvm().parse_assembly(""), llvm().Target.from_default_triple().create_target_machine()
    )
    engine.add_object_file(llvm().ObjectFileRef.from_data(file))
    engine.finalize_object()
    return engine.get_function_address


def _ask_llvm() -> bytes:
    binding = llvm()
    features, version = (
        binding.get_host_cpu_features().flatten(),
        importlib.import_module("llvmlite").__version__,
    )
    return "\n".join(
        (binding.get_host_cpu_name(), features, binding.get_default_triple(), version)
    ).encode()


def _described() -> bytes | None:
    """Return the system's description of the first processor and the llvmlite version; None if
    unknown.
    """
    if not elf_loader.possible():
        return None
    found = importlib.util.find_spec("llvmlite")
    if found is None or found.origin is None:
        return None
    try:
        # the import of importlib.metadata takes longer than loading a cached model
        version = Path(found.origin).with_name("_version.py").read_bytes()
        with Path("/proc/cpuinfo").open("rb") as file:
            lines = iter(file.readline, b"\n")
            traits = [line for line in lines if line.split(b"\t")[0] in TRAITS]
    except OSError:
        return None
    return b"".join([*traits, version]) if len(traits) == len(TRAITS) else None
