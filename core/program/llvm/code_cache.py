"""Machine code of programs: compiled for this processor, kept by content, processor and version."""

from __future__ import annotations

import ctypes
import inspect
import pickle
from collections.abc import Callable, Mapping
from functools import cache

from .. import disk_cache
from . import compiler, elf_loader


class Code:
    """Machine code of functions; calls of them release Python's lock.

    Args:
        signatures: by function, how many arguments it takes: addresses and whole numbers. All
            return a whole number; what those without a result return means nothing. Others are
            known by their address.

    Attributes:
        address: where the function of a name stands.
        calls: functions of known signatures.
    """

    def __init__(self, code: bytes, signatures: Mapping[str, int]) -> None:
        self.address = (
            elf_loader.placed(elf_loader.Image(*pickle.loads(code)))
            if elf_loader.possible()
            else compiler.loaded(code)
        )
        # whole numbers are passed as addresses are: ctypes takes a third of the time for those
        types = {
            name: ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * count)
            for name, count in signatures.items()
        }
        self.calls: dict[str, Callable[..., int]] = {
            name: kind(self.address(name)) for name, kind in types.items()
        }


def load(
    content: str, text: Callable[[], str], signatures: Mapping[str, int] | None = None
) -> Code:
    """Compile the text, or fetch what the content meant before."""
    return Code(disk_cache.kept(told(content), lambda: _made(text())), signatures or {})


def find(content: str) -> Code | None:
    """What the content meant before, if it was kept."""
    code = disk_cache.find(told(content))
    return None if code is None else Code(code, {})


def told(content: str) -> bytes:
    """What determines machine code: this for any processor and compiler, both of them, and what is
    made of it here.
    """
    return "\n".join(
        (*compiler.processor(), str(elf_loader.possible()), _sources(), content)
    ).encode()


@cache
def _sources() -> str:
    """The text that says how code is compiled, and put together."""
    return "".join(inspect.getsource(each) for each in (compiler, elf_loader))


def _made(text: str) -> bytes:
    file = compiler.emitted(text)
    return pickle.dumps(tuple(elf_loader.joined(file))) if elf_loader.possible() else file
