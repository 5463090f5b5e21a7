"""Machine code of programs, compiled for this processor and cached by content, processor and
version.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import msgspec

from .. import disk_cache
from . import compiler, elf_loader


class Code:
    """Machine code of functions; calls release the GIL.

    Args:
        signatures: number of arguments by function: addresses and integers. All return an integer,
            which is meaningless for functions without a result. Other functions are reached by
            address only.

    Attributes:
        address: return the address of a function by name.
        calls: functions with a signature; each keeps the code alive.
    """

    def __init__(self, code: bytes, signatures: Mapping[str, int]) -> None:
        self.address = (
            elf_loader.placed(msgspec.msgpack.decode(code, type=elf_loader.Image))
            if elf_loader.possible()
            else compiler.loaded(code)
        )
        # integers are passed as addresses: ctypes takes a third of the time for those
        types = {
            name: ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * count)
            for name, count in signatures.items()
        }
        self.calls: dict[str, Callable[..., int]] = {}
        for name, kind in types.items():
            call: Any = kind(self.address(name))
            call.alive = self.address
            self.calls[name] = call


def load(
    content: str, text: Callable[[], str], signatures: Mapping[str, int] | None = None
) -> Code:
    """Return the cached code of a content; compile the text if there is none."""
    return disk_cache.kept(
        cache_key(content), lambda: _made(text()), lambda code: Code(code, signatures or {})
    )


def find(content: str) -> Code | None:
    """Return the cached code of a content, or None."""
    return disk_cache.find(cache_key(content), lambda code: Code(code, {}))


def cache_key(content: str) -> bytes:
    """Return the cache key: content, processor, compiler, and sources that process its output."""
    return "\n".join(
        (*compiler.processor(), str(elf_loader.possible()), _sources(), content)
    ).encode()


@cache
def _sources() -> str:
    """Return the source of the modules that compile and link."""
    return "".join(inspect.getsource(each) for each in (compiler, elf_loader))


def _made(text: str) -> bytes:
    file = compiler.emitted(text)
    return msgspec.msgpack.encode(elf_loader.joined(file)) if elf_loader.possible() else file
