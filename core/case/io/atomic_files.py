"""Write files whole or not at all, and report write errors, if possible before the work."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias
from uuid import uuid4

from ...errors import KincheckError

Named: TypeAlias = tuple[str, Path | str | None]
"""An option and its file, "-" for standard output; None without the option."""

Content: TypeAlias = bytes | Callable[[Path], object]
"""Content of a file, or a function that writes it to a given path."""


def written(path: Path, content: Content) -> list[str]:
    """Write a file; return the reason if it fails."""
    try:
        _put(path, content)
    except OSError as error:
        return [
            f"{path}: cannot be written ({error.strerror or error}); what else was asked for is"
            " tried"
        ]
    return []


def write_all(contents: Iterable[tuple[Path, Content]]) -> list[str]:
    """Write files; return the reasons of failures."""
    return [problem for path, content in contents for problem in written(path, content)]


def write(option: str, path: Path, content: Content) -> Any:
    """Write the file of an option, and return the result of the write.

    Raises:
        KincheckError: the file cannot be written.
    """
    try:
        return _put(path, content)
    except OSError as error:
        why = error.strerror or error
        raise KincheckError(
            f"{option} {path}: cannot be written ({why}); give a file in a folder that exists and"
            " is writable"
        ) from None


def _put(path: Path, content: Content) -> Any:
    with whole(path) as part:
        return part.write_bytes(content) if isinstance(content, bytes) else content(part)


@contextmanager
def whole(path: Path) -> Generator[Path]:
    """Yield a temporary path, and rename it to the file at the end, unless an error ends the block.

    An earlier file stays until then, and also if the write fails.

    Raises:
        OSError: the file cannot be written.
    """
    there, file = _behind_links(path)
    # a pipe, a device, or a file in a read-only folder: write to it directly
    if there and not (file.is_file() and os.access(file.parent, os.W_OK)):
        yield path
        return
    part = file.with_name(f".{uuid4().hex}.part")  # another run may be writing the same file
    try:
        yield part
        if there:
            shutil.copymode(file, part)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def _behind_links(path: Path) -> tuple[bool, Path]:
    """Return whether a file exists, and its path without links; an unnamed pipe has none.

    Raises:
        OSError: no file can have the path: its links go round, its name is too long, ...
    """
    try:
        path.stat()
        return True, Path(os.path.realpath(path))
    except FileNotFoundError:
        return False, Path(os.path.realpath(path))


def require_writable(files: Iterable[Named], history: Path | None = None) -> None:
    """Raise KincheckError for files of options that cannot be written; see `unwritable`."""
    if problems := unwritable(files, history):
        raise KincheckError("\n".join(problems))


def unwritable(files: Iterable[Named], history: Path | None = None) -> list[str]:
    """Return messages about unwritable files of options, and files named by several options.

    Args:
        history: file of the history; no option may name it.
    """
    found = list[str]()
    seen = {} if history is None else {os.path.realpath(history): "--history"}
    for option, name in files:
        if name in (None, "-"):
            continue
        path = Path(name)
        if path == Path("-"):
            found.append(
                f"{option} -: standard output takes the document of --json alone; give a file"
            )
        elif (why := _obstacle(path)) is not None:
            found.append(
                f"{option} {path}: cannot be written{why}; give a file in a folder that exists and"
                " is writable"
            )
        elif _is_standard_output(path):
            found.append(
                f"{option} {path}: found the file that standard output goes to, expected one of its"
                " own. Give another"
            )
        elif path.exists() and not path.is_file():
            continue  # several options may write to one pipe or device
        elif (other := seen.setdefault(os.path.realpath(path), option)) != option:
            found.append(
                f"{option} {path}: found the file of {other}, expected one of its own. Give another"
            )
    return found


def _obstacle(path: Path) -> str | None:
    """Return None if a file can be written, else the reason in brackets, if it is not plain."""
    try:
        there, file = _behind_links(path)
    except OSError as error:
        return f" ({error.strerror})"
    able = not file.is_dir() if there else file.parent.is_dir()
    return None if able and os.access(path if there else file.parent, os.W_OK) else ""


def _is_standard_output(path: Path) -> bool:
    """Return whether the file, under any name, receives standard output.

    If so, each would overwrite the other.
    """
    try:
        return path.is_file() and os.path.samestat(path.stat(), os.fstat(1))
    except OSError:  # standard output is closed
        return False


def to_standard_output(encoded: bytes) -> None:
    """Write a JSON document to standard output in UTF-8, also if its texts have another
    encoding.
    """
    sys.stdout.flush()
    binary: BinaryIO | None = getattr(sys.stdout, "buffer", None)
    if binary is None:  # a caller has replaced standard output by a text stream
        sys.stdout.write(encoded.decode())
    else:
        binary.write(encoded)
    sys.stdout.flush()
