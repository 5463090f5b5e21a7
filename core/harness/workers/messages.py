"""Messages between parent and worker: the length of a pickled object, then the object."""

from __future__ import annotations

import pickle
import struct
from typing import Any, BinaryIO

LENGTH = struct.Struct("<Q")

# Longest message [bytes]; no answer reaches it (a million samples of a thousand outputs take 24 GB,
# and no case has them). A larger length is foreign data, written into the channel by mistake.
LONGEST = 1 << 34


def pack(message: Any) -> bytes:
    """Return a message as bytes."""
    return pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)


def write(stream: BinaryIO, packed: bytes) -> None:
    """Send a packed message."""
    stream.write(LENGTH.pack(len(packed)))
    stream.write(packed)
    stream.flush()


def read(stream: BinaryIO) -> bytes:
    """Return the next message, packed.

    Raises:
        EOFError: the other side has ended, or sent no valid message.
    """
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size or (length := LENGTH.unpack(head)[0]) > LONGEST:
        raise EOFError
    packed = stream.read(length)
    if len(packed) < length:
        raise EOFError
    return packed
