"""Files of an output directory: written under names that nobody can guess, never through a link, put aside unharmed."""

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO


def unused(path: Path) -> Path:
    """A name beside `path` for what is to take its place; nobody can have prepared a file or a link there."""
    return path.with_name(f"{path.name}.{secrets.token_hex(6)}.part")


@contextmanager
def replaced(path: Path) -> Iterator[BinaryIO]:
    """A new file to write to, which takes the place of `path` at the end; after an error nothing has changed."""
    part = unused(path)
    file = part.open("xb")  # x: O_EXCL, which does not follow links
    try:
        with file:
            yield file
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def write(path: Path, text: str) -> None:
    """Replace a file by a text, in UTF-8."""
    with replaced(path) as file:
        file.write(text.encode(errors="backslashreplace"))


def opened(path: Path, flags: int) -> int:
    """Open, or make, a regular file that is not a link to another; returns its handle. Raises OSError and ValueError.

    `flags` are those of `os.open`; O_NONBLOCK, since a named pipe planted there would wait for its other end.
    """
    if path.is_symlink():
        raise ValueError("it is a symbolic link, which is not followed")
    handle = os.open(path, flags | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink > 1:
        os.close(handle)
        raise ValueError("it is not a regular file, or another file is linked to it")
    return handle


def contents(path: Path) -> bytes:
    """All of a regular file; raises OSError, and ValueError for anything else, a link too."""
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    with open(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise ValueError("it is no regular file")
        return file.read()


def text(path: Path) -> str:
    """As `contents`, in UTF-8."""
    return contents(path).decode(errors="replace")


def is_the_file(path: Path, handle: int) -> bool:
    """Whether a path still leads to the file that was opened."""
    try:
        return os.path.samestat(os.fstat(handle), path.lstat())
    except OSError:
        return False


def put_aside(path: Path) -> Path | None:
    """Rename what has a name to `NAME.aside`, or `NAME.aside-2` ...; returns the new name, None if nothing did."""
    if not os.path.lexists(path):
        return None
    number, target = 1, path.with_name(f"{path.name}.aside")
    while os.path.lexists(target):
        number += 1
        target = path.with_name(f"{path.name}.aside-{number}")
    path.rename(target)
    return target
