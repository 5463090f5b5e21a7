"""What parent and worker send each other: pickled objects, each after its length."""

from __future__ import annotations

import pickle
import struct
from typing import Any, BinaryIO

LENGTH = struct.Struct("<Q")

# Longer than any answer (a million samples of a thousand outputs are 24 GB, and no case): what
# looks so is not a length, but something that was written into the channel by mistake.
LONGEST = 1 << 34


def pack(message: Any) -> bytes:
    """A message as bytes."""
    return pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)


def write(stream: BinaryIO, packed: bytes) -> None:
    """Send a packed message."""
    stream.write(LENGTH.pack(len(packed)))
    stream.write(packed)
    stream.flush()


def read(stream: BinaryIO) -> bytes:
    """The next message, packed.

    Raises:
        EOFError: the other side has gone, or what it sent is no message.
    """
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size or (length := LENGTH.unpack(head)[0]) > LONGEST:
        raise EOFError
    packed = stream.read(length)
    if len(packed) < length:
        raise EOFError
    return packed
