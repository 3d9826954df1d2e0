"""Files that are kept for a user from one run to the next: compiled loops, transform plans.

Both are handed to the machine as they are read, so they are kept only where nobody else can have put them: in a
directory of this user with mode 0700, in the user's cache directory. Where there is no such place nothing is kept.
"""

import os
import stat
from contextlib import suppress
from pathlib import Path

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def directory(name: str) -> Path | None:
    """The directory `name` of this program in the user's cache directory, made if need be; None if it is not safe."""
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
    """Whether a directory is this user's, nobody else may write to it, and nobody else can put another in its place."""
    found = place.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & OTHERS_WRITE:
        return False
    if not all(_keeps_its_entries(parent) for parent in place.parents) or not os.access(place, os.W_OK | os.X_OK):
        return False
    if stat.S_IMODE(found.st_mode) != 0o700:
        place.chmod(0o700)
    return True


def _keeps_its_entries(parent: Path) -> bool:
    """Whether only root and this user can replace what lies in a directory.

    Also one that a group may write to if that is the user's own group, which by custom has the user's number.
    """
    found, own = parent.stat(), os.geteuid()
    if found.st_uid not in (0, own):
        return False
    others = stat.S_IWOTH if found.st_uid == found.st_gid == own else OTHERS_WRITE
    return not found.st_mode & others or bool(found.st_mode & stat.S_ISVTX)
