"""Directories for files that a user keeps between runs: compiled loops, transform plans.

These files are executed or trusted unread, so no other user may be able to write them: they are kept in a directory of
mode 0700 in the user's cache directory, or not at all.
"""

import os
import stat
from contextlib import suppress
from pathlib import Path

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def directory(name: str) -> Path | None:
    """Return the program's directory `name` in the user's cache directory, made if missing; None if it is not safe."""
    with suppress(OSError, RuntimeError):
        home = Path.home()
        given = Path(os.environ.get("XDG_CACHE_HOME") or "")
        cache = given if given.is_absolute() else home / ".cache"
        if given.is_absolute() or home.is_dir():  # a home that does not exist is not made
            cache.mkdir(mode=0o700, parents=True, exist_ok=True)
            place = cache.resolve() / "parcontact" / name
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            return place if _private(place) else None
    return None


def _private(place: Path) -> bool:
    """Return True if the directory belongs to this user and no other user can write to it or replace it."""
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & OTHERS_WRITE:
        return False
    if not all(_keeps_its_entries(parent) for parent in place.parents) or not os.access(place, os.W_OK | os.X_OK):
        return False
    if stat.S_IMODE(found.st_mode) != 0o700:
        place.chmod(0o700)
    return True


def _keeps_its_entries(parent: Path) -> bool:
    """Return True if only root and this user can replace entries of a directory.

    A group may write to the directory if it is the user's private group, which has the same number as the user.
    """
    found, own = parent.stat(), os.geteuid()
    if found.st_uid not in (0, own):
        return False
    others = stat.S_IWOTH if found.st_uid == found.st_gid == own else OTHERS_WRITE
    return not found.st_mode & others or bool(found.st_mode & stat.S_ISVTX)
