"""Files that are never half-written: a new file has another name until it is whole, what is not ours is put aside."""

import errno
import os
import re
import secrets
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import BinaryIO

MARK = "made by the program parcontact"  # in pages and in pictures, where their kind has a place for it


def unused(path: Path) -> Path:
    """Return a name beside `path` for what is to take its place."""
    return path.with_name(f"{path.name}.{secrets.token_hex(6)}.part")


def without_mark(path: Path) -> Path:
    """Return the name that a new file is to have; any other path as it is."""
    return path.with_name(re.sub(r"\.[0-9a-f]{12}\.part$", "", path.name))


@contextmanager
def replaced(path: Path, is_ours: Callable[[Path], bool] | None = None) -> Iterator[BinaryIO]:
    """Open a new file that takes the place of `path` at the end; after an error nothing has changed.

    With `is_ours`, what has the name and is not ours is put aside, and standard error says so.
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
    """Open a file of ours at its end, or begin it. Raises OSError, also for a link, which may lead anywhere."""
    try:
        handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise OSError(f"{path} is a link, which may lead anywhere; move it away") from None
        raise
    return FileIO(handle, "ab")


def replace_file(path: Path, text: str) -> None:
    """Replace a file by a text, in UTF-8."""
    with replaced(path) as file:
        file.write(text.encode(errors="backslashreplace"))


def is_marked(path: Path) -> bool:
    """Return whether this program has made a page or a picture; raises OSError."""
    return MARK.encode() in path.read_bytes()


def make_room(path: Path, is_ours: Callable[[Path], bool]) -> None:
    """Put aside what has a name, with a warning, unless it is a file of ours and no link."""
    with suppress(OSError):
        if path.is_file() and not path.is_symlink() and is_ours(path):
            return
    if aside := put_aside(path):
        message = f"warning: {path} was there and not written by this program: it is kept as {aside.name}"
        print(message, file=sys.stderr, flush=True)


def put_aside(path: Path) -> Path | None:
    """Rename what has a name to `NAME.aside`, or `NAME.aside-2` ...; returns the new name, if there was anything."""
    if not os.path.lexists(path):
        return None
    number, target = 1, path.with_name(f"{path.name}.aside")
    while os.path.lexists(target):
        number += 1
        target = path.with_name(f"{path.name}.aside-{number}")
    path.rename(target)
    return target
