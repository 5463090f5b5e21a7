"""LLVM, as llvmlite has it: what it says of this processor, what it makes of a text, and how it
loads that.
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
"""What the system says of a processor, and LLVM goes by."""


class Processor(NamedTuple):
    """What machine code is made for and by: as LLVM names the processor, what that can do, its
    system, and llvmlite's version.
    """

    name: str
    features: str
    triple: str
    version: str


def available() -> bool:
    """Whether llvmlite is installed, and its library could be loaded here when that was needed
    first.
    """
    return importlib.util.find_spec("llvmlite") is not None and _loads()


@cache
def _loads() -> bool:
    try:
        # asks LLVM only if it was never asked here: whoever has its products does without
        processor()
    except (ImportError, OSError):  # `kincheck doctor` tells it
        return False
    return True


@cache
def llvm() -> Any:
    """Its binding. Importing it takes three times as long as making a known model ready: whoever
    has its products does without.
    """
    found: Any = importlib.import_module("llvmlite.binding")
    found.initialize_native_target()
    found.initialize_native_asmprinter()
    return found


@cache
def processor() -> Processor:
    """LLVM's opinion; where machine code runs without LLVM, the one it had before, of a processor
    that the system called the same.

    An emulator that hides instructions of the processor (valgrind) needs a cache of its own.
    """
    known = _described()
    said = _asked() if known is None else kept(known, _asked)
    return Processor(*said.decode().split("\n"))


@cache
def vector_width() -> int:
    """Doubles in a vector register of this processor."""
    features = processor().features.split(",")
    return 8 if "+avx512f" in features else 4 if "+avx" in features else 2


def emitted(text: str) -> bytes:
    """Machine code of a text: an object file."""
    here = processor()
    # level 1: the optimiser's passes cost ten times the time and gain nothing on straight-line code
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
    """Have LLVM put an object file into memory, for as long as what is returned is kept: where each
    function stands.
    """
    engine = llvm().create_mcjit_compiler(
        llvm().parse_assembly(""), llvm().Target.from_default_triple().create_target_machine()
    )
    engine.add_object_file(llvm().ObjectFileRef.from_data(file))
    engine.finalize_object()
    return engine.get_function_address


def _asked() -> bytes:
    binding = llvm()
    features, version = (
        binding.get_host_cpu_features().flatten(),
        importlib.import_module("llvmlite").__version__,
    )
    return "\n".join(
        (binding.get_host_cpu_name(), features, binding.get_default_triple(), version)
    ).encode()


def _described() -> bytes | None:
    """What the system says of the first processor, and which llvmlite is installed; None where that
    is not known.
    """
    if not elf_loader.possible():
        return None
    found = importlib.util.find_spec("llvmlite")
    if found is None or found.origin is None:
        return None
    try:
        # importing importlib.metadata takes longer than making a model ready
        version = Path(found.origin).with_name("_version.py").read_bytes()
        with Path("/proc/cpuinfo").open("rb") as file:
            lines = iter(file.readline, b"\n")
            traits = [line for line in lines if line.split(b"\t")[0] in TRAITS]
    except OSError:
        return None
    return b"".join([*traits, version]) if len(traits) == len(TRAITS) else None
