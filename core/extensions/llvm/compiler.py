"""Interface to LLVM by llvmlite, and a loader of the object files that it writes.

LLVM can load its own object files, but its import takes three times as long as loading a cached
model. An `Image` needs no LLVM: one position-independent block of machine code, linked once. Its
source is an ELF object for x86-64 (System V ABI with its AMD64 supplement, chapter 4). Its sections
refer to each other by relative addresses only, for it calls nothing outside itself.
"""

from __future__ import annotations

import importlib
import importlib.util
import mmap
import sys
from collections.abc import Callable, Mapping
from ctypes import CDLL, addressof, c_char, c_size_t, c_void_p, get_errno
from functools import cache
from pathlib import Path
from platform import machine
from struct import Struct, pack_into, unpack_from
from typing import Any, NamedTuple

from ...program.disk_cache import load_or_make

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
    """Return LLVM's description of the processor; with `possible` from the cache, keyed by the
    system's description.

    An emulator that hides instructions of the processor (valgrind) needs a separate cache.
    """
    known = _describe()
    return _read(_ask_llvm()) if known is None else load_or_make(known, _ask_llvm, _read)


def _read(description: bytes) -> Processor:
    return Processor(*description.decode().split("\n"))


@cache
def vector_width() -> int:
    """Return the doubles in a vector register of this processor."""
    features = processor().features.split(",")
    return 8 if "+avx512f" in features else 4 if "+avx" in features else 2


def emit(text: str) -> bytes:
    """Return the machine code of a text: an object file."""
    here = processor()
    # level 1: the optimiser's passes cost ten times the time and gain nothing on straight-line
    # code
    options = {"opt": 1, "reloc": "pic", "codemodel": "small"} if possible() else {"opt": 1}
    machine = (
        llvm()
        .Target.from_default_triple()
        .create_target_machine(cpu=here.name, features=here.features, **options)
    )
    return machine.emit_object(llvm().parse_assembly(text))


def load_object(file: bytes) -> Callable[[str], int]:
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


def _describe() -> bytes | None:
    """Return the system's description of the first processor and the llvmlite version; None if
    unknown.
    """
    if not possible():
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


SECTIONS_AT, SECTIONS = 0x28, 0x3C
"""Offsets in the file header: address and number of sections."""
PROGRAM, SYMBOLS, RELOCATIONS, ALLOCATED = 1, 2, 4, 2
"""Types of sections, and the flag of those in memory at run time."""
DISTANCES = 2, 4
"""Types of relocations, R_X86_64_PC32 and R_X86_64_PLT32: a 32-bit distance from its own address.
"""


class Image(NamedTuple):
    """Machine code, and the offset of each function in it."""

    code: bytes
    places: Mapping[str, int]


class _Section(NamedTuple):
    name: int
    type: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    align: int
    entry_size: int


class _Symbol(NamedTuple):
    name: int
    info: int
    other: int
    section: int
    value: int
    size: int


_SECTION, _SYMBOL, _RELOCATION = Struct("<IIQQQQIIQQ"), Struct("<IBBHQQ"), Struct("<QQq")


@cache
def possible() -> bool:
    """Return whether images run here: x86-64 under Linux, with permission to execute written
    memory.
    """
    if sys.platform != "linux" or machine() != "x86_64":
        return False
    try:
        _runnable(b"\0")
    except OSError:  # some systems forbid it
        return False
    return True


def image_of(file: bytes) -> Image:
    """Return the image of an object file. Raise ValueError for a relocation other than a relative
    address.
    """
    (at,), (count,) = unpack_from("<Q", file, SECTIONS_AT), unpack_from("<H", file, SECTIONS)
    sections = [_Section(*_SECTION.unpack_from(file, at + k * _SECTION.size)) for k in range(count)]

    def held(section: _Section) -> bytes:
        return file[section.offset : section.offset + section.size]

    code, begins = bytearray(), dict[int, int]()
    for k, section in enumerate(sections):
        if section.type == PROGRAM and section.flags & ALLOCATED:
            code += bytes(-len(code) % section.align)
            begins[k] = len(code)
            code += held(section)
    (table,) = (each for each in sections if each.type == SYMBOLS)
    symbols: list[_Symbol] = [_Symbol(*each) for each in _SYMBOL.iter_unpack(held(table))]
    names = held(sections[table.link])

    def named(symbol: _Symbol) -> str:
        return names[symbol.name : names.index(0, symbol.name)].decode()

    for section in sections:
        if section.type != RELOCATIONS or section.info not in begins:
            continue
        for offset, info, addend in _RELOCATION.iter_unpack(held(section)):
            kind, symbol = info & 0xFFFFFFFF, symbols[int(info) >> 32]
            if kind not in DISTANCES or symbol.section not in begins:
                raise ValueError(
                    f"machine code refers to {named(symbol)!r} by relocation {kind}: no distance"
                    " between parts of itself"
                )
            place = begins[section.info] + offset
            pack_into("<i", code, place, begins[symbol.section] + symbol.value + addend - place)
    places = {
        named(each): begins[each.section] + each.value
        for each in symbols
        if each.section in begins and each.name
    }
    return Image(bytes(code), places)


def load_image(image: Image) -> Callable[[str], int]:
    """Load an image; return a function from name to address, which also keeps the memory alive."""
    memory = _runnable(image.code)
    start = _address(memory)

    def address(name: str, _alive: object = memory) -> int:
        return start + image.places[name]

    return address


def _runnable(code: bytes) -> mmap.mmap:
    """Return executable, read-only memory with the code."""
    memory = mmap.mmap(
        -1, len(code), mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, mmap.PROT_READ | mmap.PROT_WRITE
    )
    memory[:] = code
    if CDLL(None, use_errno=True).mprotect(
        c_void_p(_address(memory)), c_size_t(len(code)), mmap.PROT_READ | mmap.PROT_EXEC
    ):
        raise OSError(get_errno(), "memory cannot be made to run")
    return memory


def _address(memory: mmap.mmap) -> int:
    return addressof(c_char.from_buffer(memory))
