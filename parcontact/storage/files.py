"""Files of an output directory: written under names that nobody can guess, never through a link, put aside unharmed."""

import mmap
import os
import secrets
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

MARK = "made by the program parcontact"  # in pages and in pictures, where their kind has a place for it


def unused(path: Path) -> Path:
    """A name beside `path` for what is to take its place; nobody can have prepared a file or a link there."""
    return path.with_name(f"{path.name}.{secrets.token_hex(6)}.part")


@contextmanager
def replaced(path: Path, is_ours: Callable[[Path], bool] | None = None) -> Iterator[BinaryIO]:
    """A new file to write to, which takes the place of `path` at the end; after an error nothing has changed.

    With `is_ours`, what has the name and is not ours is put aside, and standard error says so.
    """
    part = unused(path)
    file = part.open("xb")  # x: O_EXCL, which does not follow links
    try:
        with file:
            yield file
        if is_ours is not None:
            make_room(path, is_ours)
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


def is_marked(path: Path) -> bool:
    """Whether this program has made a page or a picture; raises OSError."""
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        if not os.fstat(handle).st_size:
            return False
        with mmap.mmap(handle, 0, access=mmap.ACCESS_READ) as data:
            return data.find(MARK.encode()) >= 0
    finally:
        os.close(handle)


def make_room(path: Path, is_ours: Callable[[Path], bool]) -> None:
    """Put aside what has a name unless it is a regular file that is ours, as `is_ours` tells, and no link."""
    if not os.path.lexists(path):
        return
    ours = False
    with suppress(OSError):
        ours = stat.S_ISREG(path.lstat().st_mode) and is_ours(path)
    if not ours and (aside := put_aside(path)):
        said = f"warning: {path} was there and not written by this program: it is kept as {aside.name}"
        print(said, file=sys.stderr, flush=True)


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
