"""Errors that a user can correct, and directories for files that a user keeps between runs.

Such files are compiled loops and plans of transforms. They are executed or trusted unread, so that no other user may be
able to write them: they are stored in a directory of mode 0700 in the user's cache directory, or not at all.
"""

import os
import stat
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

DONE, FAILED, BAD_INPUT, STOPPED_EARLY = range(4)  # exit codes; stopped early: with a good checkpoint, run again


class InputError(Exception):
    """Bad input, described in one sentence: the program ends with exit code 2 and writes nothing."""


class JobError(InputError):
    """A job with mistakes; each of `mistakes` is a sentence that begins with file:line:column or the name of a key."""

    def __init__(self, mistakes: Sequence[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = list(mistakes)

    def __reduce__(self) -> tuple[type["JobError"], tuple[list[str]]]:
        return JobError, (self.mistakes,)  # for pickling, between ranks


class InUseError(InputError):
    """The output directory is in use by another running program."""


class RunError(Exception):
    """A run that cannot continue, described in one sentence: exit code 1."""


class UnsolvedError(RunError):
    """A steady state that cannot be solved: its `place` as text, and the `reason`."""

    def __init__(self, place: str, reason: str) -> None:
        super().__init__(f"{place}: {reason}")
        self.place, self.reason = place, reason

    def __reduce__(self) -> tuple[type["UnsolvedError"], tuple[str, str]]:
        return UnsolvedError, (self.place, self.reason)  # for pickling, between ranks


OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def directory(name: str) -> Path | None:
    """Return the program's directory `name` in the user's cache directory, created if missing; None if unsafe."""
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
