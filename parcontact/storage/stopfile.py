"""Files that ask programs to stop."""

import os
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

NAME = "stop"  # in an output directory, or in that of a sweep

Identity = tuple[int, ...]


@dataclass(frozen=True)
class StopFile:
    """One for all programs that work on the same sweep, and so removed by none of them.

    It asks those that run when it is made or touched. One that was there `before` a program began asks nothing of it:
    it is what others have left. By a second file, `own`, the ranks of one program ask each other; no other program
    knows its name.
    """

    path: Path
    before: Identity | None
    own: Path

    @classmethod
    def from_now_on(cls, path: Path) -> "StopFile":
        """One that asks if it is made, or touched, from now on."""
        return cls(path, _identity(path), path.with_name(f".{path.name}-{secrets.token_hex(8)}"))

    @property
    def asks(self) -> bool:
        """Whether to stop."""
        return os.path.lexists(self.own) or _identity(self.path) not in (None, self.before)

    def ask_own(self) -> None:
        """Stop the other ranks of this program; where that cannot be written, they end with their cases."""
        with suppress(OSError):
            self.own.touch()

    def forget_own(self) -> None:
        """Remove what the ranks of this program asked each other by, once all of them have ended."""
        with suppress(OSError):
            self.own.unlink(missing_ok=True)


def remove(path: Path) -> str:
    """Remove a stop file, also a directory of its name; returns why the next run would find it again, or ''."""
    try:
        if path.is_dir() and not path.is_symlink():
            path.rmdir()
        else:
            path.unlink(missing_ok=True)
    except OSError as error:
        return f"asked to stop by {path}, which cannot be removed: {error.strerror}; remove it"
    return ""


def _identity(path: Path) -> Identity | None:
    """What tells a file from one that was there before, and changes when it is touched; None where there is none."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_ctime_ns
