"""Writing of files that are never incomplete, by temporary names, and renaming of foreign files."""

import errno
import os
import re
import secrets
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import BinaryIO

from ..errors import InputError

PLACES = ("*", "checkpoint/*", "cases/*/*", "cases/*/checkpoint/*")  # of files in an output directory
TOO_LARGE = "file too large for its file system, or for the limit that ulimit -f shows"
MARK = "made by the program parcontact"  # mark in the metadata of pages and pictures


def unused(path: Path) -> Path:
    """Return a temporary name in the directory of `path`."""
    return path.with_name(f"{path.name}.{secrets.token_hex(6)}.part")


def without_mark(path: Path) -> Path:
    """Return the final name of a file whose temporary name was made by `unused`. Other paths are returned unchanged."""
    return path.with_name(re.sub(r"\.[0-9a-f]{12}\.part$", "", path.name))


@contextmanager
def replaced(path: Path, is_ours: Callable[[Path], bool] | None = None) -> Iterator[BinaryIO]:
    """Open a new file that replaces `path` at the end of the context. After an error `path` is unchanged.

    If the function `is_ours` is given and returns False for an existing file of this name, the existing file is
    renamed, with a warning on standard error.
    """
    part = unused(path)
    try:
        with part.open("xb") as file:
            yield file
        if is_ours is not None:
            make_room(path, is_ours)
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def open_to_append(path: Path) -> FileIO:
    """Open a file to append, or create it. Raises OSError, also for a symbolic link."""
    try:
        handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OSError(f"{path} is a symbolic link, which is not followed; move it away") from None
        raise
    return FileIO(handle, "ab")


def refuse_pipes(path: Path) -> None:
    """Raise InputError if a path, or a file in an output directory or in one of its cases, is a pipe or a device, from
    which a program might read forever."""
    for one in (path, *(found for pattern in PLACES for found in path.glob(pattern))):
        with suppress(OSError):
            if (mode := one.stat().st_mode) and (stat.S_ISFIFO(mode) or stat.S_ISCHR(mode) or stat.S_ISBLK(mode)):
                raise InputError(f"{one} is a device or a pipe, which is not read: move it away")


def reason(error: BaseException) -> str:
    """Return the reason of a failure in a few words, without HDF5's stack of calls."""
    text = str(error)
    if found := re.search(r"error message = '([^']+)'", text):
        return found.group(1)
    if found := re.search(r"truncated file: eof = (\d+), sblock->base_addr = (\d+), stored_eof = (\d+)", text):
        return f"it is incomplete: it has {int(found[1]) + int(found[2])} of {found[3]} bytes"
    if "file signature not found" in text:
        return "it is not an HDF5 file, or incomplete"
    if isinstance(error, OSError) and error.strerror and error.errno:
        return (
            TOO_LARGE if error.errno == errno.EFBIG else error.strerror if error.filename else os.strerror(error.errno)
        )
    return text.splitlines()[0] if text else type(error).__name__


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Create the directory of a file that is written within the context. Raises InputError if the directory or the file
    cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise InputError(f"{path} cannot be written: {reason(error)}") from error


def write_own(path: Path, text: str) -> None:
    """Write a text to a file. An existing file is replaced if it begins with the same line as the text; otherwise it is
    renamed, with a warning. Raises InputError."""
    first = text.partition("\n")[0].encode()
    with writing(path), replaced(path, lambda there: there.read_bytes().startswith(first)) as file:
        file.write(text.encode())


def replace_file(path: Path, text: str) -> None:
    """Replace a file by a text, in UTF-8."""
    with replaced(path) as file:
        file.write(text.encode(errors="backslashreplace"))


def is_marked(path: Path) -> bool:
    """Return True if a page or a picture has the `MARK` of this program. Raises OSError."""
    return MARK.encode() in path.read_bytes()


def make_room(path: Path, is_ours: Callable[[Path], bool]) -> None:
    """Rename an existing file with a warning, unless it is a regular file of this program.

    Raises PermissionError for a device or a pipe, such as /dev/null.
    """
    if os.path.lexists(path) and not (path.is_symlink() or path.is_file() or path.is_dir()):
        raise PermissionError(errno.EPERM, "it is a device or a pipe, which is not replaced", str(path))
    with suppress(OSError):
        if path.is_file() and not path.is_symlink() and is_ours(path):
            return
    if aside := put_aside(path):
        message = f"warning: {path} existed and was not written by this program: it was renamed to {aside.name}"
        print(message, file=sys.stderr, flush=True)


def put_aside(path: Path) -> Path | None:
    """Rename a file to `NAME.aside`, or to `NAME.aside-2` and so on if such a file exists. Return the new path, or None
    if there is no file."""
    if not os.path.lexists(path):
        return None
    number, target = 1, path.with_name(f"{path.name}.aside")
    while os.path.lexists(target):
        number += 1
        target = path.with_name(f"{path.name}.aside-{number}")
    path.rename(target)
    return target
